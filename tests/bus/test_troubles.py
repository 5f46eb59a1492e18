"""All faults of the process's bus: the permission ends, the stop latches, and the process uses the bus again."""

import signal
import subprocess
import time
from pathlib import Path

import bus_guard
import can
import pytest
from bus_kit import Start, run
from bus_robot import CALM_PERIOD_S, Robot, open_channel, reset, run_until_permitted

from tauperp.config import Configuration
from tauperp.wire import Wire

BUS_OFF = "20000040#0000000000000000"  # CAN_ERR_FLAG | CAN_ERR_BUSOFF, as can-utils write it
RESTARTED = "20000100#0000000000000000"
# Time and cycles are compared over 16 cycles of 50 ms. The first comparison spans the silence; the second and third may
# each contain a delay of the machine.
RECOVERY_S = 5.0


def test_an_interface_that_goes_down_and_up_causes_a_latched_trip(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    run("ip", "link", "set", "vcan0", "down")
    event = process.wait_for_state("Stopped", "BusDown", after=lines)
    assert event["permitted"] is False
    cpu = _cpu_ticks(process)
    time.sleep(1.0)
    assert _cpu_ticks(process) - cpu < 30, "the process polls without a pause"
    run("ip", "link", "set", "vcan0", "up")
    process.wait_for_bus("takes frames again")
    with open_channel("vcan0") as again:
        back = Robot(calm, wire, again)
        back.cycle = robot.cycle
        back.live(RECOVERY_S, CALM_PERIOD_S)
        assert not any(back.log), "the trip is latched"
        assert back.answer is not None
        assert back.answer["Reason"] == 20
        reset(back)
        assert back.permitted
    end = process.end()
    assert end["unsent"] > 0


def test_an_interface_that_is_removed_and_created_again_is_opened_again(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    run("ip", "link", "del", "vcan0")
    process.wait_for_state("Stopped", "BusDown", after=lines)
    run("ip", "link", "add", "vcan0", "type", "vcan")
    run("ip", "link", "set", "vcan0", "mtu", "72", "up")
    process.wait_for_bus("reopened")
    with open_channel("vcan0") as again:
        back = Robot(calm, wire, again)
        back.live(RECOVERY_S, CALM_PERIOD_S)
        assert back.answer is not None
        assert back.answer["Reason"] == 20
        assert not any(back.log)
        reset(back)
        assert back.permitted
    process.end()


def test_an_interface_that_is_down_at_the_start_is_a_trip_before_the_first_permission(
    start: Start, calm: Configuration, wire: Wire
) -> None:
    run("ip", "link", "set", "vcan0", "down")
    process = start(calm)
    process.wait_for_bus("does not take frames")
    run("ip", "link", "set", "vcan0", "up")
    process.wait_for_bus("takes frames again")
    with open_channel("vcan0") as bus:
        robot = Robot(calm, wire, bus)
        robot.live(RECOVERY_S, CALM_PERIOD_S)
        assert robot.answer is not None
        assert (robot.answer["Reason"], robot.answer["TripNumber"]) == (20, 1)
        assert not any(robot.log)
        reset(robot)
        assert robot.permitted
    process.end()


def test_bus_off_ends_the_permission(start: Start, calm: Configuration, wire: Wire, bus: can.BusABC) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    run("cansend", "vcan0", BUS_OFF)
    event = process.wait_for_state("Stopped", "BusOff", after=lines)
    assert event["trip"] == 1
    run("cansend", "vcan0", RESTARTED)
    process.wait_for_bus("restarted after bus-off")
    robot.live(RECOVERY_S, CALM_PERIOD_S)
    assert not robot.permitted, "the trip is latched"
    reset(robot)
    assert robot.permitted
    assert process.end()["error_frames"] == 2


@pytest.mark.parametrize(
    ("frame", "reason"),
    [("20000001#0000000000000000", "BusDown"), ("20000004#0001000000000000", "RxOverflow")],
    ids=["transmission timeout", "controller overflow"],
)
def test_an_error_reported_by_the_controller_ends_the_permission(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC, frame: str, reason: str
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    run("cansend", "vcan0", frame)
    process.wait_for_state("Stopped", reason, after=lines)


def test_many_error_frames_give_one_line_and_no_trip(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    for _ in range(40):
        run("cansend", "vcan0", "20000088#0000000000000000")  # protocol violation, bus error
        robot.live(CALM_PERIOD_S, CALM_PERIOD_S)  # so that no deadline expires
    robot.live(3 * CALM_PERIOD_S, CALM_PERIOD_S)
    assert robot.permitted
    assert len([event for event in process.events()[lines:] if event["event"] == "bus"]) == 1
    assert process.end()["error_frames"] == 40


def test_a_full_transmit_queue_ends_the_permission(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    try:
        run("tc", "qdisc", "add", "dev", "vcan0", "root", "pfifo", "limit", "0")  # every frame: ENOBUFS
        event = process.wait_for_state("Stopped", "BusDown", after=lines)
    finally:
        run("tc", "qdisc", "del", "dev", "vcan0", "root")
    assert event["permitted"] is False
    process.wait_for_bus("takes frames again")
    assert "No buffer space" in process.wait_for_bus("does not take frames")["detail"]


def test_frames_lost_in_the_receive_buffer_end_the_permission(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    process.process.send_signal(signal.SIGSTOP)
    flood = 5000
    subprocess.run([bus_guard.PEER, "flood", "vcan0", str(flood), "0", "00" * 8], check=True, capture_output=True)
    process.process.send_signal(signal.SIGCONT)
    time.sleep(0.1)
    robot.step(wait=False)  # the kernel reports the loss with the next frame
    process.wait_for_bus("the receive buffer lost frames")
    event = process.wait_for_state("Stopped", after=lines)
    assert event["reason"] in (
        "RxOverflow",
        "SyncTimeout",
        "JointTimeout",
        "ErrorRate",
    )  # the first one that the process detected
    robot.live(3 * CALM_PERIOD_S, CALM_PERIOD_S)
    assert not robot.permitted
    end = process.end()
    assert end["overflows"] > 0
    assert end["frames"] + end["overflows"] == flood + 9 * robot.cycle + robot.resets, (
        "every frame is in exactly one counter"
    )


def _cpu_ticks(process: bus_guard.GuardProcess) -> int:
    fields = Path(f"/proc/{process.process.pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])
