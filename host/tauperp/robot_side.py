"""The robot's end of the wire, for programs that use python-can: the frames to send, and when motion is permitted.

    from tauperp.robot_side import RobotSide

    robot = RobotSide(bus, joints=7, fd=True, period_s=1e-3)
    while True:                                            # once per period
        q, qd, tau = read_joints()
        robot.send_cycle(q, qd, tau, task=CONTACT)         # Sync, TaskCommand, one JointState per joint
        permit = robot.listen()                            # returns with the answer, or after half a period
        if not permit.allowed:
            stop(permit.category)

docs/robot-side.md states the rules and the time budget. `StopCheck` contains the rules alone, for programs that receive
frames themselves. firmware/robot_side is the same in C.
"""

import enum
import math
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import can

from tauperp.errors import InputError
from tauperp.wire import E2EStatus, Receiver, Sender, Wire

NO_TASK, PAYLOAD, CONTACT = 1, 2, 3  # TaskCommand.Task
SENSOR_OK, NOT_AVAILABLE = 0, 3  # JointState.SensorStatus
MOVE = (1, 14)  # Permission and its inverse: every other pair is a stop
NO_REASON = 1  # StopCommand.Reason of a permission
SILENCE_CATEGORY = 1  # stop category of IEC 60204-1 if no valid frame arrived
COMPANY, COMPANY_FRAMES = 8, 24  # 8 of 24 StopCommands out of sequence show a second guard
_CYCLE_MASK, _NIBBLE = 0xFFFF, 0xF


class Answer(enum.Enum):
    """Kind of answer in a cycle."""

    MISSING = enum.auto()
    OTHER = enum.auto()  # only StopCommands of another cycle, or of this one with a counter out of sequence
    GOOD = enum.auto()


@dataclass(frozen=True, slots=True)
class Permit:
    """What the robot may do in this cycle. Without permission it performs a stop of `category` (IEC 60204-1)."""

    allowed: bool
    category: int
    answer: Answer
    command: dict[str, float] | None = None  # signals of the StopCommand that decided; None without a valid one

    @property
    def reason(self) -> int:
        """StopCommand.Reason; 0 without a valid frame."""
        return 0 if self.command is None else int(self.command["Reason"])

    @property
    def full_speed(self) -> bool:
        """False: at the robot's reduced speed only, because the guard detects no force on a link."""
        return self.allowed and self.command is not None and bool(self.command["FullSpeed"])

    @property
    def trip_number(self) -> int:
        """The trip that a GuardReset must name; 0 before the first trip and without a valid frame."""
        return 0 if self.command is None else int(self.command["TripNumber"])


_SILENT = Permit(False, SILENCE_CATEGORY, Answer.MISSING)


class StopCheck:
    """The rules of docs/robot-side.md over the StopCommands of one guard, a cycle at a time.

    answer_s    after `begin`, by the caller's clock, until which an answer permits; infinite where a robot waits for it
    hold_s      after `begin` for which the permission lasts, if no next cycle begins; infinite likewise

    Times are seconds of one monotonic clock.
    """

    def __init__(self, wire: Wire, *, answer_s: float = math.inf, hold_s: float = math.inf) -> None:
        self.answer = Answer.MISSING
        self._receiver = Receiver(wire)
        self._message = wire.message("StopCommand")
        self._answer_s, self._hold_s = answer_s, hold_s
        self._cycle, self._begun_s = 0, 0.0
        self._command: dict[str, float] | None = None  # the answer that permits this cycle
        self._stop: dict[str, float] | None = None  # the worst stop of this cycle
        self._out_of_sequence: deque[bool] = deque(maxlen=COMPANY_FRAMES)

    def begin(self, cycle: int, now_s: float = 0.0) -> None:
        """Call before the Sync of this cycle is sent, and after `hear` got every earlier frame."""
        self._cycle, self._begun_s = cycle, now_s
        self._command, self._stop, self.answer = None, None, Answer.MISSING

    def hear(self, frame: can.Message, now_s: float = 0.0) -> None:
        """Process any frame of the bus; frames other than StopCommand are ignored. `now_s`: time of reception."""
        if frame.arbitration_id != self._message.id:
            return
        received = self._receiver.receive(frame)
        if received is None or received.status is E2EStatus.WRONG_CRC:
            return
        self._out_of_sequence.append(received.status in (E2EStatus.REPEATED, E2EStatus.WRONG_SEQUENCE))
        signals = self._message.decode(frame.data)
        answers = int(signals["Cycle"]) == self._cycle & _NIBBLE
        self.answer = Answer.OTHER if self.answer is Answer.MISSING else self.answer
        if answers and (received.status.accepted or received.status is E2EStatus.INITIAL):
            self.answer = Answer.GOOD  # the first frame permits nothing, but shows that its sender exists
        both = (signals["Permission"], signals["PermissionInverted"]) == MOVE
        if not both or signals["Reason"] != NO_REASON or self._message.out_of_range(signals):
            self._hear_stop(signals)
        elif answers and received.status.accepted and now_s - self._begun_s <= self._answer_s:
            self._command = signals

    def _hear_stop(self, signals: dict[str, float]) -> None:
        """A stop needs neither a fresh counter nor the cycle. The worst stop applies."""
        if self._stop is None or _category(signals) <= _category(self._stop):
            self._stop = signals

    def forget(self, frame: can.Message) -> None:
        """Process a frame from before the first cycle. It answers nothing, but sets the reference of the counter."""
        if frame.arbitration_id == self._message.id:
            self._receiver.receive(frame, decode=False)

    @property
    def has_company(self) -> bool:
        """Whether StopCommands with two counters arrive: two guards, which a robot cannot obey. Of two alternating
        guards about half of the frames are out of sequence; with one guard, only one frame after each loss."""
        return self._out_of_sequence.count(True) >= COMPANY

    def permit(self, now_s: float = 0.0) -> Permit:
        """The verdict of this cycle from the frames received so far. May be called at any time."""
        if self._stop is not None:
            return Permit(False, _category(self._stop), self.answer, self._stop)
        if self._command is None or self.has_company or now_s - self._begun_s > self._hold_s:
            return Permit(False, SILENCE_CATEGORY, self.answer)
        return Permit(True, _category(self._command), self.answer, self._command)


def _category(signals: dict[str, float]) -> int:
    """Category of IEC 60204-1; an unknown one counts as category 0."""
    category = int(signals["StopCategory"])
    return category if category <= 2 else 0


class RobotSide:
    """A robot's controller on a python-can bus: sends a cycle, receives the answer, requests resets.

    joints      1 to 8
    fd          the wire format: CAN FD with bit-rate switch, or classic CAN
    period_s    of a cycle, as in the guard's configuration
    answer_s    after Sync until which an answer permits; half a period unless given

    Raises InputError for settings outside their range. For one thread only.
    """

    def __init__(
        self,
        bus: can.BusABC,
        *,
        joints: int,
        fd: bool,
        period_s: float,
        answer_s: float | None = None,
        wire: Wire | None = None,
    ) -> None:
        if not 1 <= joints <= 8:
            raise InputError(f"joints: {joints} is outside 1 to 8")
        if not (math.isfinite(period_s) and period_s > 0):
            raise InputError(f"period_s: {period_s} is not a positive number")
        self.joints = joints
        self.cycle = -1  # the current one
        wire = Wire.read() if wire is None else wire
        self.answer_s = period_s / 2 if answer_s is None else answer_s
        self.check = StopCheck(wire, answer_s=self.answer_s, hold_s=period_s + self.answer_s)
        self._bus = bus
        self._sender = Sender(wire, fd=fd)
        self._begun_s = 0.0
        self._last = _SILENT

    def send_cycle(
        self,
        position_rad: Sequence[float],
        velocity_rad_s: Sequence[float],
        torque_nm: Sequence[float],
        *,
        task: int = NO_TASK,
        acceleration_m_s2: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Begin the next cycle: Sync, TaskCommand, one JointState per joint; arrays of `joints` values.

        A reading that the wire cannot carry is sent as not available, which stops the robot. Raises InputError for
        arrays of another length, and for a task or an acceleration that the wire cannot carry.
        """
        for name, values in (("position", position_rad), ("velocity", velocity_rad_s), ("torque", torque_nm)):
            if len(values) != self.joints:
                raise InputError(f"{name}: {len(values)} values for {self.joints} joints")
        x, y, z = acceleration_m_s2
        cycle = self.cycle + 1
        order = self._sender.frame("TaskCommand", {"Task": task, "AccelX": x, "AccelY": y, "AccelZ": z}, cycle=cycle)
        self._drain()
        self.cycle = cycle
        self._begun_s = time.monotonic()
        self.check.begin(cycle, self._begun_s)
        self._bus.send(self._sender.frame("Sync", {"Cycle": cycle & _CYCLE_MASK}, cycle=cycle))
        self._bus.send(order)
        for joint, reading in enumerate(zip(position_rad, velocity_rad_s, torque_nm, strict=True)):
            self._bus.send(self._joint(joint, reading))

    def _joint(self, joint: int, reading: tuple[float, float, float]) -> can.Message:
        name, cycle = f"JointState{joint + 1}", self.cycle
        signals = dict(zip(("Position", "Velocity", "Torque"), reading, strict=True))
        try:
            return self._sender.frame(name, {"SensorStatus": SENSOR_OK, **signals}, cycle=cycle)
        except InputError:
            blank = {"SensorStatus": NOT_AVAILABLE, "Position": 0.0, "Velocity": 0.0, "Torque": 0.0}
            return self._sender.frame(name, blank, cycle=cycle)

    def listen(self, timeout_s: float | None = None) -> Permit:
        """Hear until this cycle is answered or `timeout_s` after its Sync (`answer_s` unless given) has passed."""
        end_s = self._begun_s + (self.answer_s if timeout_s is None else timeout_s)
        while self.check.answer is not Answer.GOOD:
            left_s = end_s - time.monotonic()
            frame = self._bus.recv(timeout=max(0.0, left_s))
            if frame is not None:
                self.check.hear(frame, time.monotonic())
            elif left_s <= 0.0:
                break
        self._drain()
        self._last = self.check.permit(time.monotonic())
        return self._last

    def _drain(self) -> None:
        """Process frames that have already arrived: a stop after an answer counts."""
        while (frame := self._bus.recv(timeout=0.0)) is not None:
            self.check.hear(frame, time.monotonic())

    def ask_for_reset(self, request: bool, trip_number: int | None = None) -> None:
        """Send a GuardReset that names the last trip, or the given one. The guard needs an edge: False, then True in a
        later cycle, both after the trip. Send it only on a person's command (IEC 60204-1, ISO 14118)."""
        number = self._last.trip_number if trip_number is None else trip_number
        self._bus.send(self._sender.frame("GuardReset", {"Request": int(request), "TripNumber": number}))
