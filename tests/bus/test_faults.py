"""Faults of the frames between robot and guard (the list of IEC 61784-3), and the guard's reaction.

The guard's process runs in lockstep, so latencies are whole cycles. A fault begins while motion is permitted, lasts,
and ends; the robot requests no reset. Corrupted and forged readings have 50 Nm more: using one of them causes a trip.
The table goes to out/bus/faults.json.
"""

import dataclasses
import json
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import bus_guard
import bus_robot
import can
import pytest
from bus_kit import Start, run
from bus_robot import Fault, Robot, copy_of, open_channel, start_in_lockstep

from tauperp.config import Configuration
from tauperp.files import write_atomically
from tauperp.wire import Wire

WARM_UP = 250  # cycles: the first permission could come after 210 good ones
LONG, LONGER = 7, 12  # cycles: beyond the deadline of a reading, and beyond every deadline
AFTER = 8
PATIENCE_S = 0.6  # for an answer while a fault lasts
JOINT_DEADLINE, TASK_DEADLINE = 4, 8  # cycles, from the DBC
SYNC, TASK, JOINT_2, JOINT_3 = 0, 1, 3, 4  # positions in the frames of a cycle


def modified(what: str, frame: str) -> str:
    """cangw's modification of a CAN FD frame: the frame is id.flags.length.data; zeros pad the data."""
    head, _, data = frame.rpartition(".")
    return f"{what}:{head}.{data.ljust(128, '0')}"


CANGW: dict[str, tuple[list[str], str, str]] = {
    # rules for joint 3's frames instead of passing them on: (filter, modification), the reason, a counter
    "corruption, by cangw": (["103:7FF", modified("XOR:D", "0.0.0.0000000000008813")], "JointTimeout", "crc_errors"),
    "loss, by cangw": ([], "JointTimeout", ""),
    "masquerade, by cangw": (["102:7FF", modified("SET:I", "103.0.0.")], "JointTimeout", "crc_errors"),
    "stuck at zeros, by cangw": (["103:7FF", modified("AND:D", "0.0.0.")], "JointTimeout", "crc_errors"),
    "stuck at ones, by cangw": (["103:7FF", modified("OR:D", f"0.0.0.{'FF' * 64}")], "JointTimeout", "crc_errors"),
    "one bit of the counter, by cangw": (["103:7FF", modified("XOR:D", "0.0.0.0001")], "JointTimeout", "crc_errors"),
    "wrong address, by cangw": (["103:7FF", modified("OR:I", "008.0.0.")], "JointTimeout", ""),
    "cut to 7 bytes, by cangw": (["103:7FF", modified("SET:L", "0.0.7.")], "JointTimeout", "format_errors"),
    "made 12 bytes, by cangw": (["103:7FF", modified("SET:L", "0.0.C.")], "JointTimeout", "format_errors"),
    "without bit-rate switch, by cangw": (["103:7FF", modified("AND:F", "0.E.0.")], "none", ""),
}


@dataclass
class Row:
    fault: str
    how: str
    reaction: str  # the reason of the stop, or "none"
    latency_cycles: (
        int | None
    )  # answers that still permitted motion after the fault began; None: the permission did not end
    counted: dict[str, int]  # the counters of the guard that changed
    permitted_on_bad_input: int  # answers; must be 0


ROWS: list[Row] = []


@pytest.fixture(scope="module", autouse=True)
def table() -> Iterator[None]:
    yield
    path = bus_guard.ROOT / "out" / "bus" / "faults.json"
    write_atomically(path, json.dumps([dataclasses.asdict(row) for row in ROWS], indent=2) + "\n")
    print(f"\n{'fault':<44}{'reaction':<15}{'cycles':>6}  counted")
    for row in ROWS:
        latency = "-" if row.latency_cycles is None else str(row.latency_cycles)
        counted = ", ".join(f"{name} {count}" for name, count in row.counted.items())
        print(f"{row.fault:<44}{row.reaction:<15}{latency:>6}  {counted}")


# --- faults: from the robot's frames of a cycle to the frames that reach the guard ------------------------------------


def changed(place: int, change: Callable[[can.Message], Sequence[can.Message]]) -> Fault:
    return lambda _, frames: [*frames[:place], *change(frames[place]), *frames[place + 1 :]]


def lost(place: int) -> Fault:
    return changed(place, lambda _: [])


def flipped(frame: can.Message) -> can.Message:
    """Torque + 50 Nm (0x1388 steps of 0.01 Nm), CRC unchanged."""
    data = bytearray(frame.data)
    torque = int.from_bytes(data[6:8], "little", signed=True) + 5000
    data[6:8] = torque.to_bytes(2, "little", signed=True)
    return copy_of(frame, data=bytes(data))


def corrupted_everywhere(_: int, frames: list[can.Message]) -> list[can.Message]:
    return [copy_of(frame, data=bytes([frame.data[0] ^ 0x5A, *frame.data[1:]])) for frame in frames]


class Delayed:
    """Joint 3's frame arrives in the next cycle, after its Sync."""

    def __init__(self) -> None:
        self._late: list[can.Message] = []

    def __call__(self, _: int, frames: list[can.Message]) -> list[can.Message]:
        out = [*frames[:2], *self._late, *frames[2:JOINT_3], *frames[JOINT_3 + 1 :]]
        self._late = [frames[JOINT_3]]
        return out


class Stale:
    """A frame from five cycles before is repeated before each frame of joint 3."""

    def __init__(self) -> None:
        self._old: list[can.Message] = []

    def __call__(self, _: int, frames: list[can.Message]) -> list[can.Message]:
        self._old.append(frames[JOINT_3])
        stale = self._old[-6:-5]
        return [*frames[:JOINT_3], *stale, *frames[JOINT_3:]]


def early(_: int, frames: list[can.Message]) -> list[can.Message]:
    return [frames[JOINT_3], *frames[:JOINT_3], *frames[JOINT_3 + 1 :]]


def joints_backwards(_: int, frames: list[can.Message]) -> list[can.Message]:
    return [*frames[:2], *reversed(frames[2:])]


def classic(frame: can.Message) -> list[can.Message]:
    return [can.Message(arbitration_id=frame.arbitration_id, is_extended_id=False, data=frame.data)]


def with_length(length: int) -> Callable[[can.Message], list[can.Message]]:
    return lambda frame: [copy_of(frame, data=bytes(frame.data[:length]).ljust(length, b"\0"))]


def remote(frame: can.Message) -> list[can.Message]:
    return [can.Message(arbitration_id=frame.arbitration_id, is_extended_id=False, is_remote_frame=True, dlc=8)]


CASES: dict[str, tuple[Fault | Callable[[], Fault], str, int | None, str]] = {
    # fault: (its effect on the frames, the reason of the stop, the latest answer that may permit, a counter)
    "corruption of a reading": (changed(JOINT_3, lambda f: [flipped(f)]), "JointTimeout", JOINT_DEADLINE, "crc_errors"),
    "corruption of Sync": (changed(SYNC, lambda f: [flipped_sync(f)]), "SyncTimeout", JOINT_DEADLINE, "crc_errors"),
    "corruption of every frame": (corrupted_everywhere, "SyncTimeout", JOINT_DEADLINE, "crc_errors"),
    "loss of a reading": (lost(JOINT_3), "JointTimeout", JOINT_DEADLINE, ""),
    "loss of Sync": (lost(SYNC), "SyncTimeout", JOINT_DEADLINE, ""),
    "loss of TaskCommand": (lost(TASK), "TaskTimeout", TASK_DEADLINE, ""),
    "unacceptable delay of a reading": (Delayed, "JointTimeout", JOINT_DEADLINE, "late_frames"),
    "unintended repetition of a reading": (
        changed(JOINT_3, lambda f: [f, f]), "AnotherSender", JOINT_DEADLINE, "sequence_errors",
    ),
    "repetition of every frame": (
        lambda _, frames: [f for f in frames for _ in "12"], "AnotherSender", JOINT_DEADLINE, "sequence_errors",
    ),
    "repetition of an old reading": (Stale, "ErrorRate", JOINT_DEADLINE + 5, "sequence_errors"),
    "insertion of a forged reading": (changed(JOINT_3, lambda f: [flipped(f), f]), "none", None, "crc_errors"),
    "insertion of an unknown joint": (
        changed(JOINT_3, lambda f: [f, copy_of(f, id=0x108)]), "none", None, "format_errors",
    ),
    "incorrect sequence: reading before Sync": (early, "JointTimeout", JOINT_DEADLINE, "late_frames"),
    "incorrect sequence: joints backwards": (joints_backwards, "none", None, ""),
    "masquerade: joint 2 as joint 3": (
        lambda _, frames: [*frames[:JOINT_3], copy_of(frames[JOINT_2], id=0x103), *frames[JOINT_3 + 1 :]],
        "JointTimeout", JOINT_DEADLINE, "crc_errors",
    ),
    "addressing: joint 3 as TaskCommand": (
        changed(JOINT_3, lambda f: [copy_of(f, id=0x040)]), "JointTimeout", JOINT_DEADLINE, "crc_errors",
    ),
    "too short": (changed(JOINT_3, with_length(7)), "JointTimeout", JOINT_DEADLINE, "format_errors"),
    "too long": (changed(JOINT_3, with_length(12)), "JointTimeout", JOINT_DEADLINE, "format_errors"),
    "wrong format: classic CAN": (changed(JOINT_3, classic), "JointTimeout", JOINT_DEADLINE, "format_errors"),
    "remote request": (changed(JOINT_3, remote), "JointTimeout", JOINT_DEADLINE, "format_errors"),
}  # fmt: skip


def flipped_sync(frame: can.Message) -> can.Message:
    return copy_of(frame, data=bytes([*frame.data[:2], frame.data[2] ^ 1, frame.data[3]]))


# --- one fault --------------------------------------------------------------------------------------------------------


@dataclass
class Run:
    """The effect of a fault."""

    log: list[bool]  # permitted, from the fault's first cycle
    reason: str
    end: bus_guard.Event

    @property
    def latency(self) -> int | None:
        return self.log.index(False) if False in self.log else None


def run_fault(process: bus_guard.GuardProcess, robot: Robot, fault: Fault | None, cycles: int) -> Run:
    start_in_lockstep(robot)
    lines = len(process.events())
    robot.fault, robot.patience_s = fault, PATIENCE_S
    log = robot.steps(cycles)
    robot.fault = None
    log += robot.steps(AFTER)
    stops = [event for event in process.events()[lines:] if event["event"] == "state" and not event["permitted"]]
    return Run(log, stops[0]["reason"] if stops else "none", process.end())


def add_row(name: str, how: str, result: Run, bad: int) -> None:
    names = ("crc_errors", "sequence_errors", "lost_frames", "range_errors", "format_errors", "late_frames")
    counted = {name: result.end[name] for name in names if result.end[name]}
    ROWS.append(Row(name, how, result.reason, result.latency, counted, bad))


def permitted_on_bad_input(result: Run, tolerated: int | None) -> int:
    """Answers with permission after the last good input is too old, or after the trip."""
    return 0 if tolerated is None else sum(result.log[tolerated:])


@pytest.mark.parametrize("name", CASES)
def test_a_lasting_fault_of_the_wire_ends_the_permission_in_time(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC, name: str
) -> None:
    fault, reason, tolerated, counter = CASES[name]
    cycles = LONGER if tolerated is not None and tolerated > JOINT_DEADLINE else LONG
    process = start(configuration, "--lockstep")
    robot = Robot(configuration, wire, bus)
    result = run_fault(process, robot, fault() if isinstance(fault, type) else fault, cycles)
    bad = permitted_on_bad_input(result, tolerated)
    add_row(name, "fault node", result, bad)
    assert result.reason == reason
    assert bad == 0
    assert (result.latency is None) == (reason == "none")
    if counter:
        assert result.end[counter] >= cycles - 1
    if reason == "none":
        assert all(result.log)


@pytest.mark.parametrize(
    "name",
    [
        "corruption of a reading",
        "loss of a reading",
        "unacceptable delay of a reading",
        "too short",
        "corruption of Sync",
    ],
)
def test_one_bad_frame_is_dropped_and_counted_and_stops_nothing(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC, name: str
) -> None:
    fault = CASES[name][0]
    process = start(configuration, "--lockstep")
    robot = Robot(configuration, wire, bus)
    result = run_fault(process, robot, fault() if isinstance(fault, type) else fault, 1)
    assert all(result.log[1:]), result
    assert result.reason == "none"
    assert result.end["trips"] == 1  # a last tick at the end of the process


def test_one_cycle_of_corrupted_frames_does_not_stop(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    process = start(configuration, "--lockstep")
    result = run_fault(process, Robot(configuration, wire, bus), corrupted_everywhere, 1)
    assert result.reason == "none"
    assert result.end["crc_errors"] == 9


@pytest.mark.parametrize("name", CANGW)
def test_a_gateway_that_modifies_loses_or_readdresses_frames_ends_the_permission(
    start: Start, configuration: Configuration, wire: Wire, vcan1: str, name: str
) -> None:
    """Robot on vcan1, guard on vcan0, the kernel's CAN gateway between them."""
    rule, reason, counter = CANGW[name]
    to_guard = ["cangw", "-A", "-s", vcan1, "-d", "vcan0", "-X", "-e"]
    run(*to_guard, "-f", "103~7FF")
    run(*to_guard, "-f", "103:7FF")
    run("cangw", "-A", "-s", "vcan0", "-d", vcan1, "-X", "-e", "-f", "10:7FF")
    process = start(configuration, "--lockstep")
    with open_channel(vcan1) as bus:
        robot = Robot(configuration, wire, bus)
        start_in_lockstep(robot)
        lines = len(process.events())
        run("cangw", "-D", "-s", vcan1, "-d", "vcan0", "-X", "-e", "-f", "103:7FF")
        if rule:
            run(*to_guard, "-f", rule[0], "-M", rule[1])
        robot.patience_s = PATIENCE_S
        log = robot.steps(LONG)
    stops = [event for event in process.events()[lines:] if event["event"] == "state" and not event["permitted"]]
    result = Run(log, stops[0]["reason"] if stops else "none", process.end())
    bad = 0 if reason == "none" else permitted_on_bad_input(result, JOINT_DEADLINE)
    add_row(name, "cangw", result, bad)
    assert (result.reason, bad) == (reason, 0)
    assert (result.latency is None) == (reason == "none")
    if counter:
        assert result.end[counter] >= LONG


# --- the bus as a whole -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "id"), [("babbling node, highest priority", "000"), ("babbling node, with a joint's id", "103")]
)
def test_a_babbling_node_at_full_load_causes_no_wrong_permission(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC, name: str, id: str
) -> None:
    bus.set_filters([{"can_id": bus_robot.STOP_COMMAND, "can_mask": 0x7FF}])
    process = start(configuration, "--lockstep", program=bus_guard.RELEASE)
    robot = Robot(configuration, wire, bus)
    start_in_lockstep(robot)
    lines = len(process.events())
    robot.patience_s = PATIENCE_S
    babble = subprocess.Popen(["cangen", "vcan0", "-g", "0", "-i", "-f", "-b", "-I", id, "-L", "8", "-D", "r"])
    try:
        log = robot.steps(20)
    finally:
        babble.terminate()
        babble.wait()
    log += robot.steps(AFTER)
    stops = [event for event in process.events()[lines:] if event["event"] == "state" and not event["permitted"]]
    result = Run(log, stops[0]["reason"] if stops else "none", process.end())
    tripped = log.index(False) if False in log else len(log)
    bad = sum(log[tripped:])
    add_row(name, "cangen", result, bad)
    assert bad == 0
    if id == "000":
        assert result.reason == "none"
        assert result.end["crc_errors"] == 0, "the kernel keeps foreign ids"
    else:
        assert result.end["crc_errors"] > 10  # as fast as cangen sends on this machine


def step_with_two(robot: Robot, listener: can.BusABC) -> bool:
    """A cycle that waits for the answers of both guards. Without the wait one guard may be many cycles behind."""
    permitted = robot.step()
    answers = 0
    while answers < 2:
        frame = listener.recv(bus_guard.TIMEOUT_S)
        assert frame is not None, "only one guard answered"
        answers += frame.arbitration_id == bus_robot.STOP_COMMAND
    return permitted


@pytest.mark.parametrize("cycles_between", [0, 1, 5])
def test_a_second_guard_on_the_bus_ends_the_permission(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC, cycles_between: int
) -> None:
    """Each guard receives the other's frames, and neither permits. So the robot need not compare the two counters."""
    process = start(configuration, "--lockstep")
    robot = Robot(configuration, wire, bus)
    start_in_lockstep(robot)
    robot.steps(cycles_between)
    second = start(configuration, "--lockstep")
    robot.patience_s = 0.05  # most answers fail the robot's check
    with open_channel("vcan0") as listener:
        log = [step_with_two(robot, listener) for _ in range(LONG)]
        for request in (0, 0, 1):
            robot.ask_for_reset(request, 1)
            log.append(step_with_two(robot, listener))
        log += [step_with_two(robot, listener) for _ in range(WARM_UP)]
    process.wait_for_bus("another guard answers on this bus")
    second.wait_for_bus("another guard answers on this bus")
    stop = process.wait_for_state("Stopped")
    result = Run(log, stop["reason"], process.end())
    bad = sum(log[1:])
    if cycles_between == 0:
        add_row("a second guard on the bus", "a second process", result, bad)
    assert (result.reason, bad) == ("AnotherGuard", 0)
    assert result.end["resets_refused"] == 1
    assert second.end()["permits"] == 0


def test_two_guards_that_start_together_permit_nothing(
    start: Start, configuration: Configuration, wire: Wire, bus: can.BusABC
) -> None:
    """Their frames have the same bits, so that no check of the robot could distinguish them."""
    processes = [start(configuration, "--lockstep") for _ in "12"]
    robot = Robot(configuration, wire, bus)
    robot.patience_s = 0.05
    with open_channel("vcan0") as listener:
        assert not any(step_with_two(robot, listener) for _ in range(WARM_UP))
    assert [process.end()["permits"] for process in processes] == [0, 0]
