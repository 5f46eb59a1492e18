"""A sample of the mutants of the firmware: a unit test detects each one, or the list of survivors contains it."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from checkout import ROOT

sys.path.insert(0, str(ROOT / "tools" / "mutate"))

from schemata import Schemata

LIST = ROOT / "tests" / "mutation" / "survivors.toml"
SAMPLE = 60


def instrumented(text: str) -> tuple[str, list[str]]:
    schemata = Schemata({"LIMIT"})
    return schemata.instrument("a.c", text), [mutant.key for mutant in schemata.mutants]


def test_each_operator_constant_and_condition_is_a_mutant() -> None:
    text = "int f(int a, int b) { if (a < LIMIT && !b) { a += b; } return a - 2; }"
    assert sorted(key.partition("f: ")[2] for key in instrumented(text)[1]) == sorted(
        [
            "a < LIMIT && !b -> a < LIMIT || !b #1",
            "a < LIMIT -> a <= LIMIT #1",
            "a < LIMIT -> 1 #1",
            "a < LIMIT -> 0 #1",
            "LIMIT -> LIMIT + 1 #1",
            "!b -> b #1",
            "!b -> 1 #1",
            "!b -> 0 #1",
            "a += b -> a -= b #1",
            "a - 2 -> a + 2 #1",
            "2 -> 2 + 1 #1",
        ]
    )


def test_constant_expressions_are_not_mutated() -> None:
    text = "static int t[4 + 1] = {1}; void f(int x) { static int k = 3 * 2; int a[5]; switch (x) { case 1: break; } }"
    assert instrumented(text) == (text, [])


def test_the_start_of_a_count_that_nothing_reads_is_no_mutant() -> None:
    unread = "void f(int x) { uint32_t held = 0; /* held */ g(x, &held); }"
    read = "void f(int x) { uint32_t held = 0; g(x, &held); h(held); }"
    assert instrumented(unread)[1] == []
    assert instrumented(read)[1] == ["a.c:f: 0 -> 0 + 1 #1"]


def run_c(folder: Path, text: str, body: str) -> int:
    """The exit code of main with this body, beside the instrumented text."""
    globals_ = (
        "int mutant_active; unsigned char mutant_reached[99];\n"
        "unsigned long long mutant_steps, mutant_limit; void mutant_hangs(void) {}\n"
    )
    (folder / "a.c").write_text(f"{globals_}{text}\nint main(void) {{ {body} }}\n")
    subprocess.run(["gcc", "-include", ROOT / "tools/mutate/mutant.h", "a.c", "-o", "a"], cwd=folder, check=True)
    return subprocess.run([str(folder / "a")], check=False).returncode


@pytest.mark.parametrize(
    ("operation", "change", "operands", "results"),
    [
        ("a * b", "a * b -> a / b", "6, 2", (12, 3)),
        ("a < b", "a < b -> a <= b", "2, 2", (0, 1)),
        ("a < 3", "3 -> 3 + 1", "3, 0", (0, 1)),
        ("a && b", "a && b -> a || b", "1, 0", (0, 1)),
        ("a || b / a", "a || b / a -> a && b / a", "1, 0", (1, 0)),
    ],
)
def test_a_mutant_is_selected_at_run_time(
    tmp_path: Path, operation: str, change: str, operands: str, results: tuple[int, int]
) -> None:
    text, keys = instrumented(f"int f(int a, int b) {{ return {operation}; }}")
    number = 1 + keys.index(f"a.c:f: {change} #1")
    assert run_c(tmp_path, text, f"return f({operands});") == results[0]
    assert run_c(tmp_path, text, f"mutant_active = {number}; return f({operands});") == results[1]


@pytest.mark.parametrize(
    ("operation", "change", "same", "other"),
    [
        ("a < b", "a < b -> a <= b", "1, 2", "2, 2"),
        ("a < 3", "3 -> 3 + 1", "2, 0", "3, 0"),
        ("a + b", "a + b -> a - b", "1, 0", "1, 1"),
        ("a && b", "a && b -> a || b", "1, 1", "0, 1"),
    ],
)
def test_a_mutant_that_changes_no_value_is_not_run(
    tmp_path: Path, operation: str, change: str, same: str, other: str
) -> None:
    text, keys = instrumented(f"int f(int a, int b) {{ return {operation}; }}")
    number = 1 + keys.index(f"a.c:f: {change} #1")
    assert run_c(tmp_path, text, f"f({same}); return mutant_reached[{number}];") == 0
    assert run_c(tmp_path, text, f"f({other}); return mutant_reached[{number}];") == 1


def test_every_entry_of_the_list_has_a_reason() -> None:
    assert all(reason for changes in tomllib.loads(LIST.read_text()).values() for reason in changes.values())


def mutate(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "tools" / "mutate" / "mutate.py"), *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.needs("unity")
def test_no_mutant_of_the_sample_survives_unlisted() -> None:
    done = mutate("--sample", str(SAMPLE))
    print(done.stdout)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]


@pytest.mark.slow
@pytest.mark.needs("unity")
def test_a_survivor_without_a_reason_is_an_error(tmp_path: Path) -> None:
    change = "reach < NUM(60) -> reach <= NUM(60) #1"
    rest = [line for line in LIST.read_text().splitlines(keepends=True) if change not in line]
    (tmp_path / "survivors.toml").write_text("".join(rest))
    key = f"core/robot.c:reach_is_moderate: {change}"
    assert mutate("--only", key).returncode == 0
    done = mutate("--only", key, "--list", str(tmp_path / "survivors.toml"))
    assert done.returncode == 1
    assert f"survives and is not listed: {key}" in done.stdout
