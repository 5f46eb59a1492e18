"""The frames of a robot and a guard, cycle by cycle, with the values that a script states.

As a program: plays a script on python-can's virtual bus from a thread, and runs `tauperp` on the same bus.

    python monitor_feed.py SCRIPT monitor ARGUMENTS...
"""

import dataclasses
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass

import can

from tauperp import cli
from tauperp.wire import Sender, Wire

COLLISION, NONE, WAITING_JOINT = 6, 1, 4
MONITORING, STOPPED, WAITING = 3, 4, 2
CONFIG_CRC = 0x1BADCAFE


@dataclass(frozen=True)
class Script:
    """The bus in one cycle. Torques Nm, one number per joint."""

    joints: int = 7
    residual: tuple[float, ...] = (0.5, -6.25, 1.0, -3.0, 0.25, 0.0, -0.5)
    index: tuple[float, ...] = (0.1, -0.2, 1.6, 0.05, 0.0, -0.01, 0.02)
    threshold: float = 2.0
    permitted: bool = True
    state: int = MONITORING
    reason: int = NONE
    task: int = 2
    joint: int = 0
    trip: int = 0
    value: float = 0.0
    silent_joints: tuple[int, ...] = ()
    variant: int = 0
    guard: bool = True
    robot: bool = True


MOVING = Script()
TRIPPED = dataclasses.replace(
    MOVING,
    permitted=False,
    state=STOPPED,
    reason=COLLISION,
    joint=3,
    trip=7,
    value=4.21,
    index=(0.1, -0.2, 4.21, 0.05, 0.0, -0.01, 0.02),
)
SCRIPTS = {
    "moving": MOVING,
    "tripped": TRIPPED,
    "waiting": dataclasses.replace(
        MOVING, permitted=False, state=WAITING, reason=WAITING_JOINT, joint=5, silent_joints=(5,)
    ),
    "silence": dataclasses.replace(MOVING, guard=False, robot=False),
}


class Feed:
    """The frames of a script, cycle after cycle; the guard's pages and joints alternate as the firmware's do."""

    PAGES = 11

    def __init__(self, wire: Wire, *, fd: bool = False) -> None:
        self._sender = Sender(wire, fd=fd)
        self._cycle = 0

    def frames(self, script: Script) -> Iterator[can.Message]:
        """One cycle."""
        cycle, frame = self._cycle, self._sender.frame
        self._cycle += 1
        if script.robot:
            yield frame("Sync", {"Cycle": cycle & 0xFFFF}, cycle=cycle)
            yield frame("TaskCommand", {"Task": script.task, "AccelX": 0.0, "AccelY": 0.0, "AccelZ": 0.0}, cycle=cycle)
            for joint in range(1, script.joints + 1):
                if joint not in script.silent_joints:
                    signals = {"SensorStatus": 0, "Position": 0.1 * joint, "Velocity": 0.0, "Torque": 1.0}
                    yield frame(f"JointState{joint}", signals, cycle=cycle)
        if script.guard:
            yield self._stop_command(script, cycle)
            turn = cycle // 2
            yield self._index(script, turn % script.joints) if cycle % 2 else self._page(script, turn % self.PAGES)

    def _stop_command(self, script: Script, cycle: int) -> can.Message:
        return self._sender.frame(
            "StopCommand",
            {
                "Joint": script.joint,
                "Permission": int(script.permitted),
                "PermissionInverted": 15 - int(script.permitted),
                "StopCategory": 2,
                "Cycle": cycle & 0xF,
                "Reason": script.reason,
                "TripNumber": script.trip,
                "IndexValue": script.value,
                "Channel": 1,
                "FullSpeed": int(script.permitted),
            },
        )

    def _index(self, script: Script, joint: int) -> can.Message:
        values = {
            "Residual": script.residual[joint],
            "Index": script.index[joint],
            "Threshold": script.threshold,
            "Channel": 1,
        }
        named = {f"{name}{joint + 1}": value for name, value in values.items()}
        return self._sender.frame("GuardIndex", {"Joint": joint, **named})

    def _page(self, script: Script, page: int) -> can.Message:
        signals: tuple[dict[str, float], ...] = (
            {
                "State": script.state,
                "Task": script.task,
                "Reason": script.reason,
                "SmallestSingular": 0.1234,
                "TickTime": 45,
            },
            {"CrcErrors": 11, "SequenceErrors": 12, "LostFrames": 13},
            {"RangeErrors": 14, "FormatErrors": 15, "LateFrames": 16},
            {"ResetsRefused": 17, "TripCount": script.trip, "Saturations": 0},
            {"FirmwareVersion": 0x0102, "WireVersion": 1, "ConfigSchema": 3, "BuildId": 0xBEEF},
            {"ConfigCrc": CONFIG_CRC},
            {"RobotJoints": script.joints, "Numeric": 1, "Format": 1, "WorstTickTime": 61, "DeadlineMargin": 7210},
            {"StartCause": 1, "Variant": script.variant, "Restarts": 0, "Channels": 1},
            {
                "TripChannel": 1,
                "TripJoint": script.joint,
                "TripReason": 6,
                "TripValue": script.value,
                "TripThreshold": 1.0,
            },
            {
                "ContactLink": 4,
                "ContactClass": 1,
                "ContactForce": 35.0,
                "ContactX": 0.6,
                "ContactY": 0.0,
                "ContactZ": 0.8,
            },
            {"BlindLinks": 0b1100000, "NeededLinks": 0b0100000},
        )
        return self._sender.frame("GuardStatus", {"Page": page, **signals[page]})


def play(bus: can.BusABC, script: Script, rate_hz: float = 500.0) -> None:
    """Send the cycles for ever, in real time. Late cycles follow at once, so that the mean rate is correct."""
    feed, begin, cycle = Feed(Wire.read()), time.monotonic(), 0
    while True:
        for frame in feed.frames(script):
            bus.send(frame)
        cycle += 1
        time.sleep(max(0.0, begin + cycle / rate_hz - time.monotonic()))


def main() -> int:
    name, arguments = sys.argv[1], sys.argv[2:]
    bus = can.Bus(interface="virtual", channel="tauperp")
    threading.Thread(target=play, args=(bus, SCRIPTS[name]), daemon=True).start()
    return cli.main(arguments)


if __name__ == "__main__":
    sys.exit(main())
