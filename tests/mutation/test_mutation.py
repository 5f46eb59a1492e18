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
# Every mutant of these files was judged, so that an unlisted survivor is a new finding.
JUDGED = (
    "wire/", "schedule/", "core/acceleration", "core/bank", "core/detector", "core/observer", "core/sensor",
    "core/robot", "core/token", "guard/config_filters", "guard/config_parts", "guard/crc32",
    "guard/event_log", "guard/guard_reason", "guard/guard_rise", "guard/scale", "guard/snapshot",
)  # fmt: skip
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


@pytest.mark.parametrize(("is_active", "result"), [(False, 12), (True, 3)])
def test_a_mutant_is_selected_at_run_time(tmp_path: Path, is_active: bool, result: int) -> None:
    text, keys = instrumented("int f(int a, int b) { return a * b; }")
    number = 1 + keys.index("a.c:f: a * b -> a / b #1")
    globals_ = (
        "int mutant_active; unsigned char mutant_reached[99];\n"
        "unsigned long long mutant_steps, mutant_limit; void mutant_hangs(void) {}\n"
    )
    main = f"int main(int n, char **v) {{ mutant_active = (n > 1) ? {number} : 0; return f(6, 2); }}\n"
    (tmp_path / "a.c").write_text(globals_ + text + main)
    subprocess.run(["gcc", "-include", ROOT / "tools/mutate/mutant.h", "a.c", "-o", "a"], cwd=tmp_path, check=True)
    command = [str(tmp_path / "a"), "x"] if is_active else [str(tmp_path / "a")]
    assert subprocess.run(command, check=False).returncode == result


def test_every_entry_of_the_list_has_a_reason() -> None:
    assert all(reason for changes in tomllib.loads(LIST.read_text()).values() for reason in changes.values())


@pytest.mark.slow
@pytest.mark.needs("unity")
def test_no_mutant_of_the_sample_survives_unlisted() -> None:
    command = [sys.executable, str(ROOT / "tools" / "mutate" / "mutate.py"), *JUDGED, "--sample", str(SAMPLE)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    print(done.stdout)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
