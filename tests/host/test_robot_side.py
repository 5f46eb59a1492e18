"""The robot's end of the wire, in Python and in C: its frames agree with cantools, and both judge StopCommand in the
same way, by the rules of docs/robot-side.md."""

import math
from collections.abc import Iterator
from typing import Any

import can
import numpy as np
import pytest

from tauperp.config import Configuration, load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Core, Guard, Library, load_library
from tauperp.robot_side import NOT_AVAILABLE, SILENCE_CATEGORY, Answer, Permit, RobotSide, StopCheck
from tauperp.wire import Receiver, Sender, Wire

MOVE = {
    "Joint": 3,
    "Permission": 1,
    "PermissionInverted": 14,
    "StopCategory": 2,
    "Cycle": 0,
    "Reason": 1,
    "TripNumber": 5,
    "IndexValue": 0.4,
    "Channel": 0,
    "FullSpeed": 1,
}
STOP = {**MOVE, "Permission": 0, "PermissionInverted": 15, "Reason": 6}
ANSWER_US, HOLD_US = 500, 1500


@pytest.fixture(scope="module")
def wire() -> Wire:
    return Wire.read()


@pytest.fixture(scope="module")
def library() -> Library:
    return load_library()


class InC:
    """firmware/robot_side, called by the library."""

    def __init__(self, library: Library, fd: bool = False) -> None:
        self.ffi, self.lib = library.ffi, library.lib
        self.robot, self.frame = library.new("robot_side_t *"), library.new("can_frame_t *")
        config = self.ffi.new("robot_side_config_t *", (7, fd, ANSWER_US, HOLD_US))
        assert self.lib.robot_side_init(self.robot, config)

    def packed(self) -> can.Message:
        frame = self.frame
        data = bytes(self.ffi.buffer(frame.data))[: frame.length]
        flags = {"is_fd": bool(frame.flags & 1), "bitrate_switch": bool(frame.flags & 2)}
        return can.Message(arbitration_id=frame.id, is_extended_id=False, data=data, **flags)

    def begin(self, now_us: int = 0) -> can.Message:
        self.lib.robot_side_begin(self.robot, now_us, self.frame)
        return self.packed()

    def hear(self, message: can.Message, now_us: int) -> None:
        frame = self.ffi.new("can_frame_t *", {"id": message.arbitration_id, "length": message.dlc})
        frame.flags = (4 if message.is_extended_id else 0) | (8 if message.is_remote_frame else 0)
        self.ffi.buffer(frame.data)[: len(message.data)] = bytes(message.data)
        self.lib.robot_side_hear(self.robot, frame, now_us)

    def permit(self, now_us: int) -> Any:
        return self.lib.robot_side_permit(self.robot, now_us)


def same(one: can.Message, other: can.Message) -> bool:
    return one.equals(other, timestamp_delta=None, check_channel=False, check_direction=False)


# --- frames that it sends ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fd", [False, True])
def test_frames_in_c_agree_with_cantools(fd: bool, wire: Wire, library: Library) -> None:
    rng = np.random.default_rng(12)
    robot, sender = InC(library, fd), Sender(wire, fd=fd)
    for cycle in range(300):
        assert same(robot.begin(), sender.frame("Sync", {"Cycle": cycle}, cycle=cycle))
        acceleration = [float(np.float32(value)) for value in rng.uniform(-32.7, 32.7, 3)]
        task = int(rng.integers(1, 4))
        assert robot.lib.robot_side_task(robot.robot, task, acceleration, robot.frame)
        wanted = {"Task": task, **dict(zip(("AccelX", "AccelY", "AccelZ"), acceleration, strict=True))}
        received = Receiver(wire)
        message = wire.message("TaskCommand")
        assert message.decode(robot.packed().data) == pytest.approx(wanted, abs=0.000501)
        assert received.receive(robot.packed()) is not None
        for joint in range(7):
            raw = rng.integers(-32767, 32768, 3)  # exact on the wire, whatever the rounding
            reading = (int(rng.integers(0, 4)), raw[0] * 0.000125, raw[1] * 0.00025, raw[2] * 0.01)
            given = robot.ffi.new("robot_side_reading_t *", reading)
            assert robot.lib.robot_side_joint(robot.robot, joint, given, robot.frame)
            signals = dict(zip(("SensorStatus", "Position", "Velocity", "Torque"), map(float, reading), strict=True))
            assert same(robot.packed(), sender.frame(f"JointState{joint + 1}", signals, cycle=cycle))
        robot.lib.robot_side_reset(robot.robot, cycle % 3 == 0, robot.frame)
        assert same(robot.packed(), sender.frame("GuardReset", {"Request": int(cycle % 3 == 0), "TripNumber": 0}))


def test_values_beyond_the_wire_are_refused_or_not_available_and_never_clamped(wire: Wire, library: Library) -> None:
    robot = InC(library)
    robot.begin()
    for acceleration in ((33.0, 0.0, 0.0), (0.0, math.nan, 0.0), (0.0, 0.0, -math.inf)):
        assert not robot.lib.robot_side_task(robot.robot, 1, list(acceleration), robot.frame)
    for task in (0, 7):
        assert not robot.lib.robot_side_task(robot.robot, task, [0.0] * 3, robot.frame)
    for reading in ((0, 4.2, 0.0, 0.0), (0, 0.0, -9.0, 0.0), (0, 0.0, 0.0, 400.0), (0, math.nan, 0.0, 0.0)):
        given = robot.ffi.new("robot_side_reading_t *", reading)
        assert robot.lib.robot_side_joint(robot.robot, 2, given, robot.frame)
        signals = wire.message("JointState3").decode(robot.packed().data)
        assert signals["SensorStatus"] == NOT_AVAILABLE
        assert signals["Position"] == signals["Velocity"] == signals["Torque"] == 0
    given = robot.ffi.new("robot_side_reading_t *", (0, 0.0, 0.0, 0.0))
    assert not robot.lib.robot_side_joint(robot.robot, 7, given, robot.frame)


def test_a_joint_on_its_own_node_follows_the_sync_of_another(wire: Wire, library: Library) -> None:
    sync = Sender(wire, fd=False).frame("Sync", {"Cycle": 41251}, cycle=41251)
    joint = InC(library)
    frame = joint.ffi.new("can_frame_t *", {"id": sync.arbitration_id, "length": 4})
    joint.ffi.buffer(frame.data)[:4] = bytes(sync.data)
    assert joint.lib.robot_side_follow(joint.robot, frame, 7)
    assert (joint.robot.cycle, joint.robot.begun_us) == (41251, 7)
    frame.data[2] ^= 1
    assert not joint.lib.robot_side_follow(joint.robot, frame, 8)
    assert joint.robot.begun_us == 7


@pytest.mark.parametrize("settings", [(0, False, 1, 2), (9, False, 1, 2), (7, False, 0, 2), (7, False, 3, 2)])
def test_settings_outside_their_range_permit_nothing(settings: tuple[int, bool, int, int], library: Library) -> None:
    robot = library.new("robot_side_t *")
    assert not library.lib.robot_side_init(robot, library.ffi.new("robot_side_config_t *", settings))
    assert not library.lib.robot_side_permit(robot, 0).allowed


# --- judgement of the answer ------------------------------------------------------------------------------------------


class Both:
    """The check in Python and in C on the same frames; they have to agree."""

    def __init__(self, wire: Wire, library: Library) -> None:
        self.wire = wire
        self.sender = Sender(wire, fd=False)
        self.check = StopCheck(wire, answer_s=ANSWER_US * 1e-6, hold_s=HOLD_US * 1e-6)
        self.in_c = InC(library)
        self.cycle, self.now_us = -1, 0

    def begin(self) -> None:
        self.cycle += 1
        self.now_us += 1000
        self.check.begin(self.cycle, self.now_us * 1e-6)
        self.in_c.begin(self.now_us)

    def answer(self, signals: dict[str, Any], late: int = 0) -> can.Message:
        return self.sender.frame("StopCommand", {**signals, "Cycle": (self.cycle - late) & 15})

    def hear(self, *frames: can.Message, after_us: int = 100) -> None:
        for frame in frames:
            self.check.hear(frame, (self.now_us + after_us) * 1e-6)
            self.in_c.hear(frame, self.now_us + after_us)

    def permit(self, after_us: int = 200) -> Permit:
        permit = self.check.permit((self.now_us + after_us) * 1e-6)
        found = self.in_c.permit(self.now_us + after_us)
        assert (found.allowed, found.category, found.reason) == (permit.allowed, permit.category, permit.reason)
        assert (found.allowed and found.full_speed) == permit.full_speed
        if permit.command is not None:
            assert (found.trip, found.joint) == (permit.trip_number, int(permit.command["Joint"]))
        assert self.in_c.lib.robot_side_has_company(self.in_c.robot) == self.check.has_company
        return permit

    def go(self, cycles: int) -> None:
        for _ in range(cycles):
            self.begin()
            self.hear(self.answer(MOVE))


@pytest.fixture
def both(wire: Wire, library: Library) -> Both:
    return Both(wire, library)


def test_a_good_answer_to_this_cycle_permits_until_its_time_is_over(both: Both) -> None:
    both.go(5)
    assert both.permit().allowed
    assert both.permit(HOLD_US - 1).allowed
    after = both.permit(HOLD_US + 1)
    assert (after.allowed, after.category) == (False, SILENCE_CATEGORY)


def test_a_permission_may_be_for_the_reduced_speed_only(both: Both) -> None:
    both.go(5)
    assert both.permit().full_speed
    both.begin()
    both.hear(both.answer({**MOVE, "FullSpeed": 0}))
    assert both.permit().allowed
    assert not both.permit().full_speed


def test_the_first_frame_of_a_sender_permits_nothing(both: Both) -> None:
    both.go(1)
    assert not both.permit().allowed
    assert both.check.answer is Answer.GOOD


def test_an_answer_after_its_window_permits_nothing(both: Both) -> None:
    both.go(5)
    both.begin()
    both.hear(both.answer(MOVE), after_us=ANSWER_US + 1)
    assert not both.permit(ANSWER_US + 2).allowed


def test_silence_in_a_cycle_is_a_stop_of_category_1(both: Both) -> None:
    both.go(5)
    both.begin()
    permit = both.permit()
    assert (permit.allowed, permit.category, permit.answer) == (False, SILENCE_CATEGORY, Answer.MISSING)


def test_an_answer_to_another_cycle_permits_nothing(both: Both) -> None:
    both.go(20)
    for late in range(1, 16):
        both.begin()
        both.hear(both.answer(MOVE, late=late))
        assert not both.permit().allowed


@pytest.mark.parametrize("order", ["before", "behind"])
def test_any_stop_in_a_cycle_wins(both: Both, order: str) -> None:
    both.go(5)
    both.begin()
    frames = [both.answer(STOP), both.answer(MOVE)]
    both.hear(*(frames if order == "before" else frames[::-1]))
    permit = both.permit()
    assert (permit.allowed, permit.category, permit.reason) == (False, 2, 6)


def test_a_stop_of_another_cycle_or_counter_wins_too(both: Both) -> None:
    both.go(5)
    both.begin()
    stale = both.answer(STOP, late=3)
    both.hear(both.answer(MOVE), stale, stale)
    assert not both.permit().allowed


def test_the_worst_stop_of_a_cycle_is_obeyed(both: Both) -> None:
    both.go(5)
    both.begin()
    both.hear(*(both.answer({**STOP, "StopCategory": category}) for category in (2, 0, 1)))
    assert both.permit().category == 0


def test_a_frame_that_fails_its_crc_is_neither_a_permission_nor_a_stop(both: Both) -> None:
    both.go(5)
    both.begin()
    broken = both.answer(STOP)
    broken.data[4] ^= 0x10
    both.hear(broken)
    assert both.permit().answer is Answer.MISSING
    both.hear(both.answer(MOVE))
    assert both.permit().allowed


def sealed(both: Both, changed: dict[int, int]) -> can.Message:
    """A permission with other bytes, and a CRC that fits."""
    frame = both.answer(MOVE)
    counter = frame.data[1] & 15
    for place, value in changed.items():
        frame.data[place] = value
    both.wire.message("StopCommand").seal(frame.data, counter)
    return frame


@pytest.mark.parametrize("pair", [pair for pair in range(256) if pair != 0xE1])
def test_only_one_pair_of_permission_copies_permits(both: Both, pair: int) -> None:
    both.go(3)
    both.begin()
    both.hear(sealed(both, {2: pair}))
    assert not both.permit().allowed


@pytest.mark.parametrize("changed", [{4: 6}, {4: 0}, {1: 0x90}, {6: 0x00, 7: 0x80}], ids=str)
def test_a_permission_that_contradicts_its_own_fields_is_a_stop(both: Both, changed: dict[int, int]) -> None:
    both.go(3)
    both.begin()
    both.hear(sealed(both, changed))
    assert not both.permit().allowed
    both.go(2)
    assert both.permit().allowed


def test_two_alternating_guards_are_never_obeyed_for_long(both: Both) -> None:
    other = Sender(both.wire, fd=False)
    allowed = []
    for _ in range(60):
        both.begin()
        both.hear(both.answer(MOVE))
        both.hear(other.frame("StopCommand", {**MOVE, "Cycle": both.cycle & 15}))
        allowed.append(both.permit().allowed)
    assert both.check.has_company
    assert not any(allowed[24:])


def test_python_and_c_agree_on_any_mixture_of_frames(both: Both) -> None:
    rng = np.random.default_rng(2024)
    allowed = stopped = 0
    for _ in range(4000):
        both.begin()
        for _ in range(int(rng.choice([0, 1, 1, 1, 1, 2, 3]))):
            signals = {**(MOVE if rng.random() < 0.8 else STOP), "StopCategory": int(rng.integers(0, 3))}
            frame = both.answer(signals, late=int(rng.choice([0, 0, 0, 0, 1, 15])))
            if rng.random() < 0.1:
                frame.data[int(rng.integers(0, 8))] ^= int(rng.integers(1, 256))
            if rng.random() < 0.1:
                frame = sealed(both, {int(rng.integers(2, 6)): int(rng.integers(0, 256))})
            if rng.random() < 0.9:
                both.hear(frame, after_us=2 * int(rng.integers(0, 350)) + 1)  # never at the end of the window
        permit = both.permit(2 * int(rng.integers(350, 850)) + 1)
        allowed, stopped = allowed + permit.allowed, stopped + (permit.command is not None and not permit.allowed)
    assert allowed > 100
    assert stopped > 100


# --- together with the guard ------------------------------------------------------------------------------------------


@pytest.fixture
def buses() -> Iterator[tuple[can.BusABC, can.BusABC]]:
    with can.Bus("test robot side", "virtual") as robot, can.Bus("test robot side", "virtual") as guard:
        yield robot, guard


class Cell:
    """RobotSide and the library's guard, which answers on request."""

    def __init__(self, buses: tuple[can.BusABC, can.BusABC], configuration: Configuration) -> None:
        self.bus = buses[1]
        self.period_us = configuration.period_us
        self.guard = Guard(configuration.block())
        # Half a minute to answer: nothing here depends on how fast the machine is.
        fd = configuration.settings.wire.format == "fd"
        self.robot = RobotSide(buses[0], joints=7, fd=fd, period_s=60.0, answer_s=30.0, wire=configuration.wire)
        self.q = np.array([0.3, 0.6, -0.2, 0.9, 0.1, -0.5, 0.2])
        self.torque = Core(configuration.robot, config=configuration).terms(self.q, 0 * self.q).gravity

    def turn(self, torque: Any = None) -> Permit:
        self.robot.send_cycle(self.q, 0 * self.q, self.torque if torque is None else torque)
        now_us = self.robot.cycle * self.period_us
        while (frame := self.bus.recv(timeout=0.0)) is not None:
            self.guard.receive(frame, now_us)
        for frame in self.guard.tick(now_us).frames:
            self.bus.send(frame)
        return self.robot.listen()


def test_a_controller_gets_its_permission_by_a_reset_and_loses_it_by_a_contact(
    buses: tuple[can.BusABC, can.BusABC],
) -> None:
    cell = Cell(buses, load_configuration("default", robot="ku_dex"))
    permit = cell.turn()
    for _ in range(600):
        if permit.reason == 27:  # AwaitingReset
            break
        permit = cell.turn()
    assert permit.reason == 27
    for request in (False, False, True):
        cell.robot.ask_for_reset(request)
        permit = cell.turn()
    assert permit.allowed
    pushed = cell.torque + np.array([0, 40.0, 0, 20.0, 0, 0, 0])
    for _ in range(200):
        permit = cell.turn(pushed)
        if not permit.allowed:
            break
    assert not permit.allowed
    assert permit.trip_number == 1


def test_arrays_and_settings_of_another_size_are_refused_in_one_line(buses: tuple[can.BusABC, can.BusABC]) -> None:
    with pytest.raises(InputError, match="joints: 9"):
        RobotSide(buses[0], joints=9, fd=False, period_s=0.002)
    with pytest.raises(InputError, match="period_s"):
        RobotSide(buses[0], joints=7, fd=False, period_s=math.nan)
    robot = RobotSide(buses[0], joints=7, fd=False, period_s=0.002)
    with pytest.raises(InputError, match="velocity: 6 values for 7 joints"):
        robot.send_cycle([0.0] * 7, [0.0] * 6, [0.0] * 7)
