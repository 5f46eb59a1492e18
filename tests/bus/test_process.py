"""The process in real time, on a healthy bus."""

import signal
import time

import can
import pytest
from bus_kit import HurriedConfiguration, Start, run
from bus_robot import CALM_PERIOD_S, STOP_COMMAND, Robot, run_until_permitted, start_in_lockstep

from tauperp.config import Configuration, load_configuration
from tauperp.firmware import Reason
from tauperp.wire import Wire


def test_deadlines_are_checked_on_a_silent_bus_too(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    event = process.wait_for_state("Stopped", "SyncTimeout", after=lines)  # the robot becomes silent
    assert event["permitted"] is False
    frames = [bus.recv(1.0) for _ in range(12)]
    stops = [bytes(frame.data) for frame in frames if frame is not None and frame.arbitration_id == STOP_COMMAND]
    assert len(stops) == 6, "the guard keeps reporting the stop"
    assert {data[2] for data in stops[-2:]} == {0xF0}
    assert process.end()["timer_ticks"] > 5


def test_the_process_does_not_receive_its_own_frames(start: Start, calm: Configuration) -> None:
    process = start(calm)
    time.sleep(2.0)
    end = process.end()
    assert end["sent"] > 10
    assert (end["frames"], end["format_errors"]) == (0, 0)


def test_foreign_ids_stay_in_the_kernel(start: Start, calm: Configuration, bus: can.BusABC) -> None:
    process = start(calm)
    for id in range(0x300, 0x340):
        bus.send(can.Message(arbitration_id=id, is_extended_id=False, data=[1], is_fd=True))
    bus.send(can.Message(arbitration_id=0x101, is_extended_id=True, data=[1], is_fd=True))
    bus.send(can.Message(arbitration_id=0x101, is_extended_id=False, is_remote_frame=True, dlc=8))
    bus.send(can.Message(arbitration_id=0x101, is_extended_id=False, data=bytes(8)))  # classic, although FD is expected
    bus.send(can.Message(arbitration_id=0x101, is_extended_id=False, data=bytes(12), is_fd=True))
    time.sleep(0.3)
    end = process.end()
    assert (end["frames"], end["format_errors"]) == (3, 3)


def test_the_age_of_a_frame_counts_from_the_kernels_time_stamp(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(calm)
    robot = Robot(calm, wire, bus)
    run_until_permitted(process, robot)
    process.process.send_signal(signal.SIGSTOP)
    robot.step(wait=False)
    waited_s = 0.4
    time.sleep(waited_s)
    process.process.send_signal(signal.SIGCONT)
    robot.live(CALM_PERIOD_S, CALM_PERIOD_S)
    end = process.end()
    assert end["response_us"]["max"] >= waited_s * 1e6, "from reception to answer"


def test_a_step_of_the_real_time_clock_does_not_change_guard_time(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC, in_uml: bool
) -> None:
    if not in_uml:
        pytest.skip("a test must not set the clock of this machine; User-Mode Linux has its own (VCAN_UML=1)")
    process = start(calm)
    robot = Robot(calm, wire, bus)
    lines = run_until_permitted(process, robot)
    for step_s in (-3600, 7200, -86400):
        now = time.clock_gettime(time.CLOCK_REALTIME)
        time.clock_settime(time.CLOCK_REALTIME, now + step_s)
        robot.live(3 * CALM_PERIOD_S, CALM_PERIOD_S)
        assert robot.permitted
    assert process.events()[lines:] == []


def test_classic_can_works_too(start: Start, wire: Wire) -> None:
    overrides = {"wire": {"rate_hz": 500, "format": "classic"}, "deadline": {"tick_budget_us": 1000}}
    configuration = load_configuration("default", robot="ku_dex", overrides=overrides)
    run("ip", "link", "set", "vcan0", "down")
    run("ip", "link", "set", "vcan0", "mtu", "16", "up")
    start(configuration, "--lockstep")
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        robot = Robot(configuration, wire, bus)
        start_in_lockstep(robot)


def test_a_tick_over_its_budget_by_the_clock_is_a_fault(
    start: Start, calm: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    hurried = HurriedConfiguration(calm.settings, calm.robot, calm.wire, calm.source)
    start(hurried)
    robot = Robot(hurried, wire, bus)
    robot.live(10 * CALM_PERIOD_S, CALM_PERIOD_S)
    assert robot.answer is not None
    assert robot.answer["Reason"] == Reason.TICK_OVER_BUDGET
    assert not any(robot.log)
