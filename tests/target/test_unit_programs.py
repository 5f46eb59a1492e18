"""Every unit test of the firmware passes on every emulated processor, in both numeric types: as many as on the host."""

import re
import subprocess
from functools import cache

import pytest
from emulator import ROOT, make, run_to_end

VERDICT = re.compile(r"^[^\n:]*:\d+:(test_\w+):(PASS|FAIL|IGNORE)", re.MULTILINE)
# Models of boards and of their registers, and the Linux process: they run where these run.
HOST_ONLY = ("test_board_", "test_fdcan", "test_linux_")
PROGRAMS = sorted(
    path.stem for path in (ROOT / "tests" / "unit").glob("test_*.c") if not path.stem.startswith(HOST_ONLY)
)
SLOWEST_S = 1500  # whole ranges of sine and square root, in software floating point on the M3
NUMERICS = ("float", "fixed") if (ROOT / "firmware" / "core" / "num_fixed.h").exists() else ("float",)


@cache
def passed_on_host(numeric: str) -> dict[str, set[str]]:
    """Names of the tests that pass here, by program."""
    make(f"unit-programs-{numeric}")
    passed: dict[str, set[str]] = {}
    for program in PROGRAMS:
        done = subprocess.run(
            [ROOT / "build" / "unit" / numeric / program], capture_output=True, text=True, cwd=ROOT, check=False
        )
        passed[program] = {test for test, verdict in VERDICT.findall(done.stdout) if verdict == "PASS"}
    return passed


@pytest.mark.parametrize("numeric", NUMERICS)
@pytest.mark.parametrize("target", ["m3", "m4f", "m7", "r5f"])
@pytest.mark.parametrize("program", PROGRAMS)
def test_every_unit_test_passes_on_the_target_as_on_the_host(program: str, target: str, numeric: str) -> None:
    image = ROOT / "build" / "unit" / f"{target}-{numeric}" / program
    assert image.exists(), "make unit-images"
    code, output = run_to_end(target, image, SLOWEST_S)
    verdicts = VERDICT.findall(output)
    assert [test for test, verdict in verdicts if verdict != "PASS"] == []
    assert {test for test, _ in verdicts} == passed_on_host(numeric)[program] != set()
    assert code == 0, output[-500:]
