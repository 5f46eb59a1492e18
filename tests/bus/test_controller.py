"""The example of a robot's controller (firmware/examples/controller, on firmware/robot_side) against the guard's
process on vcan0."""

import subprocess

import bus_guard
import pytest
from bus_kit import Start
from bus_robot import POSE_RAD

from tauperp.config import Configuration, load_configuration
from tauperp.firmware import Core

CONTROLLER = bus_guard.ROOT / "build" / "controller"
PERIOD_US = 20_000_000  # the controller waits half a period for an answer, longer than any machine takes


def controller(configuration: Configuration, cycles: int, push_nm: float = 0.0) -> list[str]:
    """The controller's output for an arm at rest, with an excess torque on joint 2."""
    torque = Core(configuration.robot, config=configuration).terms(POSE_RAD, 0 * POSE_RAD).gravity
    torque[1] += push_nm
    pairs = [f"{position:.6f},{value:.3f}" for position, value in zip(POSE_RAD, torque, strict=True)]
    wire = configuration.settings.wire.format
    command = [str(CONTROLLER), "vcan0", wire, str(PERIOD_US), str(cycles), *pairs]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=120).stdout.splitlines()


@pytest.mark.parametrize("wire", ["fd", "classic"])
def test_the_example_controller_gets_its_permission_by_a_reset_and_keeps_it(start: Start, wire: str) -> None:
    overrides = {"wire": {"format": wire, "rate_hz": 500}}
    configuration = load_configuration("default", robot="ku_dex", overrides=overrides)
    process = start(configuration, "--lockstep")
    lines = controller(configuration, 600)
    assert lines[-1].split(": ")[1].startswith("move"), lines
    assert any("reason 27" in line for line in lines), "it waited for its reset"
    assert process.end()["crc_errors"] == 0


def test_the_example_controller_stops_on_a_contact(start: Start, configuration: Configuration) -> None:
    """The push is there from the start: no permission, although the controller requests it all the time."""
    process = start(configuration, "--lockstep")
    lines = controller(configuration, 400, push_nm=40.0)
    assert not any(": move" in line for line in lines)
    process.wait_for_state("Stopped", "Collision")
    process.end()


def test_without_a_guard_the_example_controller_never_moves(configuration: Configuration) -> None:
    command = [str(CONTROLLER), "vcan0", "fd", "2000", "50", *["0,0"] * configuration.robot.n]
    lines = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60).stdout.splitlines()
    assert lines == ["cycle 0: stop, category 1, reason 0, joint 0, trip 0"]
