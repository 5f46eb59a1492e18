"""A robot at rest that obeys the guard: its frames cycle by cycle, and whether it may move after each."""

import time
from collections.abc import Callable, Sequence

import can
import numpy as np
from bus_guard import GuardProcess

from tauperp.config import Configuration
from tauperp.firmware import Core
from tauperp.wire import Receiver, Sender, Wire

POSE_RAD = np.array([0.2, 0.5, -0.3, 0.9, 0.1, 0.6, 0.0])
STOP_COMMAND, STATUS, INDEX = 0x010, 0x200, 0x201
CALM_PERIOD_S = 0.05  # of conftest's calm configuration
FIRST_PERMISSION = (27, 28)  # StopCommand.Reason AwaitingReset, Restarted
LONGEST_START = 400  # cycles: self-test, settling and health
PATIENCE_S = 3.0  # for the answer to a cycle

Fault = Callable[[int, list[can.Message]], Sequence[can.Message]]  # cycle, its frames -> the frames that reach the bus


def open_channel(channel: str) -> can.BusABC:
    return can.Bus(interface="socketcan", channel=channel, fd=True)


def copy_of(frame: can.Message, *, id: int | None = None, data: bytes | None = None) -> can.Message:
    """The frame with another id or other bytes."""
    return can.Message(
        arbitration_id=frame.arbitration_id if id is None else id,
        is_extended_id=False,
        data=frame.data if data is None else data,
        is_fd=frame.is_fd,
        bitrate_switch=frame.bitrate_switch,
    )


class Robot:
    """Stands at POSE_RAD with exactly the torque that holds it, so that every index is about zero."""

    def __init__(self, configuration: Configuration, wire: Wire, bus: can.BusABC, fault: Fault | None = None) -> None:
        self.n = configuration.robot.n
        self.task = 1
        self.cycle = 0
        self.resets = 0  # GuardResets sent
        self.torque_nm = Core(configuration.robot, config=configuration).terms(POSE_RAD, 0 * POSE_RAD).gravity
        self.answer: dict[str, float] | None = None  # the newest valid StopCommand
        self.permitted = False
        self.patience_s = PATIENCE_S
        self.due_s = 0.0  # time of the next cycle
        self.log: list[bool] = []  # whether each cycle was permitted
        self.bus = bus
        self.fault = fault
        self.sender = Sender(wire, fd=configuration.settings.wire.format == "fd")
        self._receiver = Receiver(wire)

    def frames(self) -> list[can.Message]:
        """Frames of the current cycle, in the order of the bus."""
        cycle = self.cycle
        task = {"Task": self.task, "AccelX": 0.0, "AccelY": 0.0, "AccelZ": 0.0}
        frames = [
            self.sender.frame("Sync", {"Cycle": cycle & 0xFFFF}, cycle=cycle),
            self.sender.frame("TaskCommand", task, cycle=cycle),
        ]
        for joint in range(self.n):
            signals = {"SensorStatus": 0, "Position": POSE_RAD[joint], "Velocity": 0.0, "Torque": self.torque_nm[joint]}
            frames.append(self.sender.frame(f"JointState{joint + 1}", signals, cycle=cycle))
        return frames

    def step(self, *, wait: bool = True) -> bool:
        """One cycle: send, and receive whether motion is permitted until the next. Without `wait`, only check what has
        arrived."""
        frames = self.frames()
        for frame in frames if self.fault is None else self.fault(self.cycle, frames):
            self.bus.send(frame)
        self._receive_answer(self.patience_s if wait else 0.0)
        self.log.append(self.permitted)
        self.cycle += 1
        return self.permitted

    def steps(self, count: int) -> list[bool]:
        return [self.step() for _ in range(count)]

    def live(self, seconds: float, period_s: float) -> None:
        """Cycles in real time, on a schedule, so that the mean period is correct."""
        for _ in range(max(1, round(seconds / period_s))):
            now = time.monotonic()
            if now > self.due_s + period_s:
                self.due_s = now
            time.sleep(max(0.0, self.due_s - now))
            self.due_s += period_s
            self.step(wait=False)

    def ask_for_reset(self, request: int, trip: int) -> None:
        self.resets += 1
        self.bus.send(self.sender.frame("GuardReset", {"Request": request, "TripNumber": trip}))

    def _receive_answer(self, timeout_s: float) -> None:
        """A permission holds for one cycle, and only with a valid answer to that cycle."""
        self.permitted = False
        while (frame := self.bus.recv(timeout_s)) is not None:
            received = self._receiver.receive(frame)
            if received is None or received.message.name != "StopCommand" or not received.status.accepted:
                continue
            if received.invalid:
                continue
            self.answer = received.signals
            answered = received.signals["Cycle"] == self.cycle & 0xF
            self.permitted = answered and (
                (received.signals["Permission"], received.signals["PermissionInverted"]) == (1, 14)
            )
            if answered and timeout_s > 0:
                break


def start_in_lockstep(robot: Robot) -> None:
    """Run cycles until the guard requests the first reset, then send it. Motion is permitted afterwards."""
    for _ in range(LONGEST_START):
        robot.step()
        if robot.answer is not None and robot.answer["Reason"] in FIRST_PERMISSION:
            break
    for request in (0, 0, 1):
        robot.ask_for_reset(request, 0)
        robot.step()
    assert robot.permitted


def run_until_permitted(process: GuardProcess, robot: Robot) -> int:
    """Run until motion is permitted; returns how many lines the process has written."""
    end = time.monotonic() + 20
    while not robot.permitted:
        assert time.monotonic() < end, process.events()
        if robot.answer is not None and robot.answer["Reason"] in FIRST_PERMISSION:
            reset(robot)
        robot.live(CALM_PERIOD_S, CALM_PERIOD_S)
    return len(process.events())


def reset(robot: Robot) -> None:
    """Request the end of the newest trip as a controller does."""
    assert robot.answer is not None
    trip = int(robot.answer["TripNumber"])
    for request in (0, 0, 1):
        robot.ask_for_reset(request, trip)
        robot.live(CALM_PERIOD_S, CALM_PERIOD_S)
    robot.live(3 * CALM_PERIOD_S, CALM_PERIOD_S)
