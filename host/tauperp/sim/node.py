"""The robot as nodes of the CAN bus: its controller and its joints, which share one bus connection here.

In each cycle it sends Sync, TaskCommand and one JointState a joint, and then obeys what StopCommand answers for that
very cycle. It trusts nothing else: no answer, an answer to another cycle, or one that fails its E2E check is a stop.
"""

import enum
import time
from collections import deque

import can
import numpy as np

from tauperp.errors import InputError
from tauperp.sim.arm import Arm, JointSample
from tauperp.sim.motion import Motion, Permit
from tauperp.sim.sensors import SensorFault, Sensors
from tauperp.sim.telling import Telling
from tauperp.wire import E2EStatus, Received, Receiver, Sender, Wire

PERMITTED = (1, 14)  # Permission and its inverse: everything else is a stop
COLLISION = 6  # StopCommand.Reason
FIRST_PERMISSION = (27, 28)  # StopCommand.Reason: everything is good, a reset is wanted
SILENCE = 1  # stop category when nobody says which
SENSOR_OK, NOT_AVAILABLE = 0, 3  # JointState.SensorStatus
RESET_HALF_S = 0.02  # a reset is asked for with a square wave of this half period, for its edges
CYCLE_MASK, NIBBLE = 0xFFFF, 0xF
COMPANY, COMPANY_FRAMES = 8, 24  # so many StopCommands out of sequence among so many are a second guard's
OVERTIME_S = 0.05  # after the end of a wait, to read what a busy bus has put in the way


class Answer(enum.Enum):
    """What came to a cycle's frames."""

    MISSING = enum.auto()
    OTHER = enum.auto()  # only StopCommands of another cycle, or of this one with a counter out of sequence
    GOOD = enum.auto()


class RobotNode:
    """One robot on one bus. `begin_cycle` and `end_cycle` are called once a cycle each, with the guard in between."""

    def __init__(
        self,
        bus: can.BusABC,
        wire: Wire,
        arm: Arm,
        sensors: Sensors,
        motion: Motion,
        *,
        fd: bool,
        hears_indexes: bool = False,
    ) -> None:
        self.motion = motion
        self.arm = arm
        self.task = 1  # as on the wire
        self.stop_command: dict[str, float] | None = None  # the newest that passed its check
        self.permitted = False
        self.sample = JointSample(*(np.zeros(arm.n) for _ in range(3)))
        n = arm.n
        self.telling = Telling(n)  # of GuardIndex and GuardStatus, if they are to be heard
        self.deaf = False  # obeys nobody any more: never permitted
        self.answer = Answer.MISSING  # to the last cycle
        self._out_of_sequence: deque[bool] = deque(maxlen=COMPANY_FRAMES)  # of StopCommands: refused by the counter
        self._bus = bus
        self._sensors = sensors
        self._sender = Sender(wire, fd=fd)
        self._receiver = Receiver(wire)
        names = ("StopCommand", "GuardStatus", "GuardIndex") if hears_indexes else ("StopCommand",)
        self._heard = {wire.message(name).id for name in names}
        if hears_indexes:  # others may be on that bus
            bus.set_filters([{"can_id": id, "can_mask": 0x7FF, "extended": False} for id in sorted(self._heard)])
        self._faults: tuple[SensorFault, ...] = ()
        self._time_s = 0.0
        self._reset_cycles = 0
        self._reset_half = max(1, round(RESET_HALF_S / arm.period_s))
        self._messages = tuple(f"JointState{joint + 1}" for joint in range(n))

    def start(self, faults: tuple[SensorFault, ...] = ()) -> None:
        """Take the arm as it stands; `faults` of kind status, silent and crc happen to the frames sent from now on."""
        self._faults = faults
        self.sample = self.arm.stand()

    def begin_cycle(self, cycle: int) -> None:
        """Sample and send."""
        self._time_s = time_s = cycle * self.arm.period_s
        self._send("Sync", {"Cycle": cycle & CYCLE_MASK}, cycle)
        x, y, z = self.motion.tip_acceleration
        self._send("TaskCommand", {"Task": self.task, "AccelX": x, "AccelY": y, "AccelZ": z}, cycle)
        readings = self._sensors.read(self.sample, time_s)
        faults = [fault for fault in self._faults if fault.active(time_s)]
        for joint, name in enumerate(self._messages):
            frame = self._joint_frame(name, readings, joint, cycle, faults)
            if frame is not None:
                self._bus.send(frame)

    def end_cycle(self, cycle: int, answer_timeout_s: float = 0.0) -> None:
        """Hear the guard, and move the arm through the cycle as it permits.

        Waits up to `answer_timeout_s` of real time for the guard's answer; with 0 it reads what is there, all of it.
        """
        self.answer = Answer.MISSING
        permit = Permit(False, SILENCE) if self.deaf else self._permit(cycle, answer_timeout_s)
        self.permitted = permit.allowed
        self._ask_for_reset()
        torque = self.motion.step(permit, self.sample)
        self.arm.brake(self.motion.brakes)
        self.sample = self.arm.step(torque)

    def _joint_frame(
        self, name: str, readings: JointSample, joint: int, cycle: int, faults: list[SensorFault]
    ) -> can.Message | None:
        status, broken = SENSOR_OK, False
        for fault in faults:
            if fault.joint != joint + 1:
                continue
            if fault.kind == "silent":
                return None
            if fault.kind == "status":
                status = int(fault.value)
            broken |= fault.kind == "crc"
        signals = {
            "SensorStatus": status,
            "Position": readings.position[joint],
            "Velocity": readings.velocity[joint],
            "Torque": readings.torque[joint],
        }
        try:
            frame = self._sender.frame(name, signals, cycle=cycle, timestamp=self._time_s)
        except InputError:  # a reading that the wire cannot carry: say so instead of clamping it
            blank = {"SensorStatus": NOT_AVAILABLE, "Position": 0.0, "Velocity": 0.0, "Torque": 0.0}
            frame = self._sender.frame(name, blank, cycle=cycle, timestamp=self._time_s)
        if broken:
            frame.data[0] ^= 0xFF
        return frame

    @property
    def has_company(self) -> bool:
        """StopCommands of two counters come in: two guards, which a robot cannot obey. Of two that take turns about
        half are out of sequence; of one whose frames get lost, one each time."""
        return self._out_of_sequence.count(True) >= COMPANY

    def forget_the_past(self) -> None:
        """What was said on the bus before the first cycle answers nothing."""
        end_s = time.monotonic() + OVERTIME_S
        while time.monotonic() < end_s and (frame := self._bus.recv(timeout=0.0)) is not None:
            self._receiver.receive(frame)

    def _permit(self, cycle: int, timeout_s: float) -> Permit:
        """Read the bus dry, or until the answer to this cycle is there."""
        self.telling.begin()
        answered = False
        end_s = time.monotonic() + timeout_s if timeout_s > 0.0 else 0.0
        while self.answer is not Answer.GOOD or timeout_s == 0.0:
            left_s = end_s - time.monotonic() if timeout_s > 0.0 else 0.0
            frame = self._bus.recv(timeout=max(0.0, left_s)) if left_s > -OVERTIME_S else None
            if frame is None:
                break
            if frame.arbitration_id not in self._heard:
                continue
            received = self._receiver.receive(frame)
            if received is None:
                continue
            if received.message.name == "StopCommand":
                answered |= self._take(received, frame, cycle)
            elif received.status.accepted and not received.invalid:
                self.telling.hear(received)
        if not answered or self.stop_command is None or self.has_company:
            return Permit(False, SILENCE)
        command = self.stop_command
        if (command["Permission"], command["PermissionInverted"]) == PERMITTED:
            return Permit(True)
        return Permit(False, int(command["StopCategory"]), command["Reason"] == COLLISION)

    def _take(self, received: Received, frame: can.Message, cycle: int) -> bool:
        """A StopCommand: whether it is the answer to this cycle and may be obeyed."""
        self.answer = Answer.OTHER
        self._out_of_sequence.append(received.status in (E2EStatus.REPEATED, E2EStatus.WRONG_SEQUENCE))
        if received.status.accepted and not received.invalid:
            self.stop_command = received.signals
            if received.signals["Cycle"] != cycle & NIBBLE:
                return False
            self.answer = Answer.GOOD
            return True
        if received.status is E2EStatus.INITIAL and received.message.decode(frame.data)["Cycle"] == cycle & NIBBLE:
            self.answer = Answer.GOOD  # the first frame of all is not obeyed, but its sender is there
        return False

    def _ask_for_reset(self) -> None:
        """While only the permission is missing, ask for it with the number of the trip that took it.

        After a start the guard wants the same, and says so when everything is good.
        """
        command = self.stop_command
        missing = command is not None and not self.permitted and self.answer is Answer.GOOD
        first = missing and command is not None and command["Reason"] in FIRST_PERMISSION
        tripped = missing and command is not None and command["TripNumber"] != 0
        if not (first or (tripped and self.motion.wants_reset)):
            self._reset_cycles = 0
            return
        assert command is not None
        request = self._reset_cycles // self._reset_half % 2
        self._send("GuardReset", {"Request": request, "TripNumber": int(command["TripNumber"])}, None)
        self._reset_cycles += 1

    def _send(self, name: str, signals: dict[str, float], cycle: int | None) -> None:
        self._bus.send(self._sender.frame(name, signals, cycle=cycle, timestamp=self._time_s))
