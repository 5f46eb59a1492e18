"""Every gate is seen red: it fails on a violation (planted.py) in a copy of the checkout.

A gate is a test of tests/gates, and any other test with the marker `gate`. A gate without a planted violation fails.
"""

import ast
import functools
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from checkout import ROOT
from planted import PLANTS, Plant, copy_of_the_checkout, failures, plant, rounds

ROUNDS = rounds(PLANTS)
# Gates that are expensive to run. Their verdict is a function, and the test on the right plants violations for it.
ELSEWHERE = {
    "tests/gates/test_coverage.py::test_unit_tests_reach_every_branch_and_condition": (
        "tests/host/test_coverage_tool.py::test_a_branch_or_condition_without_a_test_is_named"
    ),
    "tests/target/test_image_stack.py::test_the_stack_of_an_image_is_bounded_and_has_not_grown": (
        "tests/target/test_image_stack.py::test_a_stack_that_grew_or_is_too_large_is_refused"
    ),
    "tests/target/test_instruction_counts.py::test_no_count_has_grown_by_more_than_one_percent": (
        "tests/host/test_bench.py::test_growth_of_one_percent_passes_and_of_more_does_not"
    ),
}


@pytest.fixture(scope="module")
def red(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], dict[str, str]]:
    """The failures of the gates of a round, by node id."""

    @functools.cache
    def of(number: int) -> dict[str, str]:
        folder = tmp_path_factory.mktemp("planted")
        copy_of_the_checkout(folder)
        plant(folder, ROUNDS[number])
        return failures(folder, [violation.gate for violation in ROUNDS[number]])

    return of


@pytest.mark.parametrize(
    ("number", "violation"),
    [
        pytest.param(
            number,
            violation,
            id=f"{number}-{violation.gate.rpartition('::test_')[2]}",
            marks=[pytest.mark.needs(violation.needs)] if violation.needs else [],
        )
        for number, group in enumerate(ROUNDS)
        for violation in group
    ],
)
def test_a_violation_turns_its_gate_red(red: Callable[[int], dict[str, str]], number: int, violation: Plant) -> None:
    said = red(number).get(violation.gate, "")
    assert re.search(violation.says, said), f"{violation.gate} says:\n{said[-3000:]}"


def of_tests_gates() -> set[str]:
    """Node ids of the gates in this folder."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-n0", "-p", "no:cacheprovider", "tests/gates"]
    command += ["-o", "addopts=", f"--ignore={Path(__file__).relative_to(ROOT)}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    found = {line for line in done.stdout.splitlines() if "::" in line}
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(found) > 5
    return found


def functions(file: Path) -> list[ast.FunctionDef]:
    return [node for node in ast.parse(file.read_text()).body if isinstance(node, ast.FunctionDef)]


def marked() -> set[str]:
    """Tests with the marker `gate`, by file and function."""
    return {
        f"{file.relative_to(ROOT)}::{node.name}"
        for file in sorted((ROOT / "tests").rglob("test_*.py"))
        for node in functions(file)
        if any(ast.unparse(mark) == "pytest.mark.gate" for mark in node.decorator_list)
    }


def lacking(gates: set[str], planted: set[str]) -> list[str]:
    """Gates without a violation. A violation of the gate's function with any parameters counts."""
    return sorted(gate for gate in gates if gate not in planted and gate.partition("[")[0] not in planted)


def test_every_gate_has_a_planted_violation() -> None:
    planted = {violation.gate for violation in PLANTS} | set(ELSEWHERE)
    assert lacking(of_tests_gates(), planted) == []
    assert lacking(marked(), {gate.partition("[")[0] for gate in planted}) == []


def test_a_gate_without_a_planted_violation_is_found() -> None:
    gates = {"a.py::test_one", "a.py::test_two[x]", "a.py::test_two[y]", "a.py::test_three[x]"}
    assert lacking(gates, {"a.py::test_two[x]", "a.py::test_three"}) == ["a.py::test_one", "a.py::test_two[y]"]


@pytest.mark.parametrize("test", ELSEWHERE.values())
def test_the_tests_that_replace_a_planted_violation_exist(test: str) -> None:
    file, _, name = test.partition("::")
    assert name in [node.name for node in functions(ROOT / file)]
