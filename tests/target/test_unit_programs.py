"""Every unit test of the firmware passes on every emulated processor, in both numeric types, and none is missing."""

import pytest
from checkout import ROOT
from emulator import built, run_to_end
from unity_items import NUMERICS, VERDICT, WRITTEN

pytestmark = pytest.mark.needs("qemu", "arm")
# Tests of board models, of their registers, of the Linux process and of the robot's end run only on the host.
HOST_ONLY = ("test_board_", "test_fdcan", "test_linux_", "test_robot_side")
PROGRAMS = sorted(
    path.stem for path in (ROOT / "tests" / "unit").glob("test_*.c") if not path.stem.startswith(HOST_ONLY)
)
SLOWEST_S = 1500  # whole ranges of sine and square root, in software floating point on the M3


@pytest.mark.parametrize("numeric", NUMERICS)
@pytest.mark.parametrize("target", ["m3", "m4f", "m7", "r5f"])
@pytest.mark.parametrize("program", PROGRAMS)
def test_every_unit_test_passes_on_the_target_as_on_the_host(program: str, target: str, numeric: str) -> None:
    folder = f"{target}-{numeric}"
    image = built(f"unit-images-{folder}", ROOT / "build" / "unit" / folder / program)
    code, output = run_to_end(target, image, SLOWEST_S)
    verdicts = VERDICT.findall(output)
    assert [test for test, verdict in verdicts if verdict != "PASS"] == []
    source = (ROOT / "tests" / "unit" / f"{program}.c").read_text(encoding="utf-8")
    assert {test for test, _ in verdicts} == set(WRITTEN.findall(source)) != set()
    assert code == 0, output[-500:]
