"""The robot as nodes of the CAN bus: its controller and its joints, which share one bus connection here.

In each cycle it sends Sync, TaskCommand and one JointState a joint, and then obeys the guard by the rules of
docs/robot-side.md (tauperp.robot_side): it moves on a good answer to that very cycle, and any stop in the cycle wins.
"""

import time

import can
import numpy as np

from tauperp.errors import InputError
from tauperp.robot_side import NOT_AVAILABLE, SENSOR_OK, Answer, StopCheck
from tauperp.run.telling import Telling
from tauperp.sim.arm import Arm, JointSample
from tauperp.sim.motion import Motion, Permit
from tauperp.sim.sensors import SensorFault, Sensors
from tauperp.wire import Receiver, Sender, Wire
from tauperp.wire_values import Reason

FIRST_PERMISSION = (Reason.AWAITING_RESET, Reason.RESTARTED)  # everything is good, a reset is wanted
SILENCE = 1  # default stop category
RESET_HALF_S = 0.02  # s; half period of the square wave that requests a reset
CYCLE_MASK = 0xFFFF
OVERTIME_S = 0.05  # after the end of a wait, to read frames that are still queued


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
        self.stop_command: dict[str, float] | None = None  # that decided the last cycle
        self.permitted = False
        self.unusable = np.zeros(
            arm.n, bool
        )  # readings of this cycle that are frozen, out of range, broken or not sent
        self.sample = JointSample(*(np.zeros(arm.n) for _ in range(3)))
        n = arm.n
        self.telling = Telling(n)  # of GuardIndex and GuardStatus, if they are received
        self.deaf = False  # obeys no guard: never permitted
        self._check = StopCheck(wire)
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
        """Start from the arm's current state; `faults` of kind status, silent and crc affect the frames sent from now
        on."""
        self._faults = faults
        self.sample = self.arm.stand()

    def begin_cycle(self, cycle: int) -> None:
        """Sample and send."""
        self._check.begin(cycle)
        self._time_s = time_s = cycle * self.arm.period_s
        self._send("Sync", {"Cycle": cycle & CYCLE_MASK}, cycle)
        x, y, z = self.motion.tip_acceleration
        self._send("TaskCommand", {"Task": self.task, "AccelX": x, "AccelY": y, "AccelZ": z}, cycle)
        readings = self._sensors.read(self.sample, time_s)
        faults = [fault for fault in self._faults if fault.active(time_s)]
        self.unusable = np.zeros(self.arm.n, bool)
        for fault in faults:
            self.unusable[fault.joint - 1] |= fault.kind in ("stuck", "status", "silent", "crc")
        for joint, name in enumerate(self._messages):
            frame = self._joint_frame(name, readings, joint, cycle, faults)
            if frame is not None:
                self._bus.send(frame)

    def end_cycle(self, cycle: int, answer_timeout_s: float = 0.0) -> None:
        """Receive the guard's answer, and move the arm through the cycle if permitted.

        Waits up to `answer_timeout_s` of real time for the guard's answer. With 0 it reads all frames that have
        arrived.
        """
        permit = Permit(False, SILENCE) if self.deaf else self._permit(answer_timeout_s)
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
        except InputError:  # a reading that the wire cannot carry is reported as not available, not clamped
            self.unusable[joint] = True
            blank = {"SensorStatus": NOT_AVAILABLE, "Position": 0.0, "Velocity": 0.0, "Torque": 0.0}
            frame = self._sender.frame(name, blank, cycle=cycle, timestamp=self._time_s)
        if broken:
            frame.data[0] ^= 0xFF
        return frame

    @property
    def answer(self) -> Answer:
        """To the last cycle."""
        return self._check.answer

    @property
    def has_company(self) -> bool:
        """Two guards answer."""
        return self._check.has_company

    def forget_the_past(self) -> None:
        """Process frames from before the first cycle: they answer nothing."""
        end_s = time.monotonic() + OVERTIME_S
        while time.monotonic() < end_s and (frame := self._bus.recv(timeout=0.0)) is not None:
            self._check.forget(frame)
            self._receiver.receive(frame, decode=False)

    def _permit(self, timeout_s: float) -> Permit:
        """Read until the answer to this cycle arrives or the time is over, then everything else that has arrived."""
        self.telling.begin()
        end_s = time.monotonic() + timeout_s if timeout_s > 0.0 else 0.0
        while True:
            waiting = timeout_s > 0.0 and self.answer is not Answer.GOOD
            left_s = end_s - time.monotonic() if waiting else 0.0
            frame = self._bus.recv(timeout=max(0.0, left_s)) if left_s > -OVERTIME_S else None
            if frame is None:
                break
            self._hear(frame)
        permit = self._check.permit()
        self.stop_command = permit.command
        return Permit(permit.allowed, permit.category, not permit.allowed and permit.reason == Reason.COLLISION)

    def _hear(self, frame: can.Message) -> None:
        if frame.arbitration_id not in self._heard:
            return
        self._check.hear(frame)
        received = self._receiver.receive(frame)
        if received is not None and received.status.accepted and not received.invalid:
            self.telling.hear(received)

    def _ask_for_reset(self) -> None:
        """Request a reset with the number of the last trip while only the permission is missing.

        After a start the guard requires the same, and reports when everything is good.
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
