"""The safety record has no gap, its pages are current, and its computations agree with enumeration."""

import dataclasses
import itertools
import subprocess
import sys
from pathlib import Path

import pytest
from checkout import ROOT

sys.path.insert(0, str(ROOT / "tools" / "safety"))

import trace as tracing

import figures
import wire


def test_no_requirement_has_a_gap_and_the_pages_are_current() -> None:
    requirements = tracing.read()
    informs = tracing.read_informs()
    assert tracing.gaps(requirements, tracing.hazards()) == []
    assert tracing.untraced(requirements, informs) == []
    assert tracing.PAGE.read_text() == tracing.page(requirements, informs)
    assert figures.PAGE.read_text() == figures.page()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"tests": []}, "SR-01: no tests"),
        ({"code": []}, "SR-01: no code"),
        ({"hazards": ["H-99"]}, "SR-01: no hazard H-99"),
        ({"tests": ["tests/unit/test_guard_states.c:test_nothing"]}, "test_guard_states.c:test_nothing does not exist"),
        ({"code": ["firmware/guard/guard.c:no_such_function"]}, "guard.c:no_such_function does not exist"),
        ({"code": ["firmware/guard/nowhere.c:guard_tick"]}, "nowhere.c:guard_tick does not exist"),
        ({"reasons": []}, "reason NONE: no requirement"),
        ({"reasons": ["NOWHERE"]}, "reason NOWHERE: not in the DBC"),
    ],
)
def test_a_planted_gap_is_found(change: dict[str, list[str]], said: str) -> None:
    first, *rest = tracing.read()
    lines = tracing.gaps([dataclasses.replace(first, **change), *rest], tracing.hazards())
    assert any(said in line for line in lines), lines


def test_a_source_without_a_requirement_is_found() -> None:
    requirements, informs = tracing.read(), tracing.read_informs()
    lost = [dataclasses.replace(one, code=[c for c in one.code if "schedule.c" not in c]) for one in requirements]
    assert tracing.untraced(lost, informs) == ["firmware/schedule/schedule.c: no requirement"]
    twice = [*informs, tracing.Informs(["firmware/core/bank.c", "firmware/core/gone.c"], "nothing")]
    assert tracing.untraced(requirements, twice) == [
        "firmware/core/bank.c: both in a requirement and among those that only inform",
        "firmware/core/gone.c: does not exist",
    ]


def test_a_unit_test_that_no_program_runs_does_not_count(tmp_path: Path) -> None:
    file = tmp_path / "tests" / "unit" / "test_x.c"
    file.parent.mkdir(parents=True)
    file.write_text("static void test_a(void) {\n}\nint main(void) {\n}\n")
    assert not tracing.defines("tests/unit/test_x.c:test_a", tmp_path)
    file.write_text("static void test_a(void) {\n}\nint main(void) {\n    RUN_TEST(test_a);\n}\n")
    assert tracing.defines("tests/unit/test_x.c:test_a", tmp_path)


def test_a_hazard_without_a_requirement_is_found() -> None:
    assert "H-7: no requirement" in tracing.gaps(tracing.read(), [*tracing.hazards(), "H-7"])


def test_a_result_is_the_worst_of_a_tests_parameters(tmp_path: Path) -> None:
    file = tmp_path / "results.xml"
    file.write_text(
        '<testsuites><testsuite><testcase classname="tests.host.test_x" name="test_a[1]"/>'
        '<testcase classname="tests.host.test_x" name="test_a[2]"><failure/></testcase>'
        '<testcase classname="tests.host.test_x" name="test_b"><skipped/></testcase>'
        '<testcase classname="tests.unit.test_y.c" name="test_c[float]"/></testsuite></testsuites>'
    )
    found = tracing.results(file)
    assert found["tests/host/test_x.py:test_a"] == "failed"
    assert found["tests/host/test_x.py:test_b"] == "skipped"
    assert found["tests/unit/test_y.c:test_c"] == "passed"


@pytest.mark.needs("unity")
def test_the_results_of_a_unity_program_are_found(tmp_path: Path) -> None:
    """As pytest itself writes them."""
    file = tmp_path / "results.xml"
    program = "tests/unit/test_schedule.c"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--junitxml={file}", program]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    traced = {name for one in tracing.read() for name in one.tests if name.startswith(program)}
    assert traced
    assert {tracing.results(file)[name] for name in traced} == {"passed"}


def test_the_weights_of_the_crc_agree_with_enumeration() -> None:
    """Of a frame of 3 bytes: CRC, counter and data, one more byte; every error pattern that the CRC does not detect."""
    bits = 24
    positions = (*range(8), *range(16, bits + 8))
    syndromes = [wire.reduce(1 << position) for position in positions]
    counted = [0] * 5
    for weight in range(1, 5):
        for errors in itertools.combinations(syndromes, weight):
            total = 0
            for syndrome in errors:
                total ^= syndrome
            counted[weight] += total == 0
    assert wire.weights(bits)[1:5] == counted[1:]
    assert sum(wire.weights(bits)) == 2 ** (bits - 8)


def test_a_frame_without_errors_has_no_residual_error() -> None:
    assert wire.residual(0.0) == 0.0
    assert 0 < wire.residual(1e-4) < wire.residual(1e-3)
