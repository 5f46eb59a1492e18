"""Foreign tools on the guard's bus: can-utils, cantools, python-can."""

import subprocess
import time
from pathlib import Path

import bus_guard
import can
import pytest
from bus_kit import Start, run
from bus_robot import Robot, start_in_lockstep

from tauperp.config import Configuration
from tauperp.files import dbc_path
from tauperp.wire import Receiver, Sender, Wire

CYCLES = 150  # after the first permission


@pytest.fixture
def dumped(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC, tmp_path: Path
) -> tuple[Path, Robot]:
    """candump's log of a robot and a guard."""
    path = tmp_path / "candump.log"
    with bus_guard.candump(path, "vcan0"):
        process = start(configuration, "--lockstep")
        robot = Robot(configuration, wire, bus)
        start_in_lockstep(robot)
        robot.steps(CYCLES)
        process.end()
    return path, robot


def test_every_frame_decodes_and_passes_its_check(dumped: tuple[Path, Robot], wire: Wire) -> None:
    """candump's log, python-can's reader, cantools' decoding, autosar-e2e's CRC."""
    path, robot = dumped
    receiver = Receiver(wire)
    names: dict[str, int] = {}
    permissions = []
    with can.CanutilsLogReader(path) as reader:
        for frame in reader:
            received = receiver.receive(frame)
            assert received is not None, frame
            assert received.status.name in ("OK", "INITIAL"), frame
            assert received.invalid == (), frame
            names[received.message.name] = names.get(received.message.name, 0) + 1
            if received.message.name == "StopCommand" and received.status.accepted:
                permissions.append(received.signals["Permission"] == 1)
    ticks = robot.cycle + 1  # one more at the end
    assert names["StopCommand"] == ticks
    assert names["GuardStatus"] + names["GuardIndex"] == ticks
    assert names["Sync"] == names["JointState7"] == robot.cycle
    assert permissions[:-1] == robot.log[1:]  # the first answer only sets the counter
    assert any(permissions)
    assert not permissions[-1]


def test_cantools_decodes_candumps_lines(dumped: tuple[Path, Robot]) -> None:
    path, robot = dumped
    with open(path) as file:
        decoded = run_with("cantools", "decode", "--single-line", str(dbc_path()), stdin=file)
    lines = decoded.splitlines()
    assert len(lines) == len(path.read_text().splitlines())
    assert [line for line in lines if "Unknown frame id" in line or "failed" in line or "::" not in line] == []
    assert sum("StopCommand(" in line for line in lines) == robot.cycle + 1
    assert "Reason: None" in decoded
    assert "Reason: Shutdown" in lines[-2]


def run_with(*command: str, stdin) -> str:
    program = bus_guard.ROOT / ".venv" / "bin" / command[0]
    return subprocess.run([program, *command[1:]], stdin=stdin, check=True, capture_output=True, text=True).stdout


def test_a_frame_of_cansend_is_received_and_checked(start: Start, configuration: Configuration, wire: Wire) -> None:
    process = start(configuration, "--lockstep")
    sender = Sender(wire, fd=True)
    for cycle in range(3):
        frame = sender.frame("Sync", {"Cycle": cycle}, cycle=cycle)
        run("cansend", "vcan0", f"020##5{frame.data.hex()}")
    run("cansend", "vcan0", "020##500000000")  # CRC
    run("cansend", "vcan0", "101##50000")  # length
    run("cansend", "vcan0", "101#0000000000000000")  # classic
    run("cansend", "vcan0", "040##5000000000000FFFF")  # CRC
    time.sleep(0.5)
    end = process.end()
    assert (end["frames"], end["crc_errors"], end["format_errors"], end["sequence_errors"]) == (7, 2, 2, 0)


def test_random_traffic_of_cangen_never_permits_motion(
    start: Start, configuration: Configuration, in_uml: bool
) -> None:
    process = start(configuration, "--lockstep")
    for kind in (["-m"], ["-f", "-b"], ["-e"], ["-R"]):
        for id in ("r", "020", "103"):
            run("cangen", "vcan0", "-g", "0", "-n", "1500", "-i", "-I", id, "-L", "r", "-D", "r", *kind)
    end = process.end()
    assert end["frames"] > 5000
    assert end["permits"] == 0
    counted = sum(end[name] for name in ("crc_errors", "format_errors", "sequence_errors"))
    assert counted >= 0.98 * end["frames"], "1 of 256 passes its CRC"
