"""The firmware on the emulated Cortex-R5F, on a real SocketCAN bus against the simulated robot: its answers equal
those of the library byte for byte.

Both receive the same frames, and only the target's answers move the robot. So if all answers are equal, this run is the
run of the library alone, with the same stops in the same cycles.
"""

import os
import time

import can
import pytest
from emulator import Emulator, versal_image

from tauperp.bus import open_bus
from tauperp.config import Numeric
from tauperp.firmware import Guard, Reason, Start, State, Verdict
from tauperp.run.lockstep import Lockstep
from tauperp.run.scenario import Scenario, load_scenario, shipped
from tauperp.wire import Sender, Wire

pytestmark = pytest.mark.needs("qemu", "arm")
CHANNEL = "vcan0"
FROM_GUARD = (0x010, 0x200, 0x201)
ANSWER_TIMEOUT_S = 60.0
# With CI=true all but one of these runs end after SLICE_CYCLES, because four complete runs take almost half an hour.
# The complete run contains both collisions of the contact experiment.
COMPLETE_IN_CI = ("contact", "float32")
SLICE_CYCLES = 2000

Answer = tuple[int, bytes, bool, bool]


def answer_of(frame: can.Message) -> Answer:
    return frame.arbitration_id, bytes(frame.data), frame.is_fd, frame.bitrate_switch


class Enough(Exception):
    """The limit of cycles was reached."""


class ComparedGuard:
    """The guard on a SocketCAN interface and the library's guard: both must give the same answers.

    Raises Enough after `cycles` cycles.
    """

    remote = True
    verdict: Verdict | None = None

    def __init__(self, bus: can.BusABC, library: Guard, cycles: int | None) -> None:
        self.cycles = 0
        self._limit = cycles
        self._bus = bus
        self._library = library

    def turn(self, now_us: int) -> None:
        answers: list[Answer] = []
        deadline = time.monotonic() + ANSWER_TIMEOUT_S
        while len(answers) < 2:  # StopCommand and one more
            frame = self._bus.recv(timeout=max(0.0, deadline - time.monotonic()))
            assert frame is not None, f"no answer to the cycle at {now_us} us"
            if frame.arbitration_id in FROM_GUARD:
                answers.append(answer_of(frame))
            else:
                self._library.receive(frame, now_us)
        expected = [answer_of(frame) for frame in self._library.tick(now_us).frames]
        assert answers == expected, f"at {now_us} us"
        self.cycles += 1
        if self.cycles == self._limit:
            raise Enough


@pytest.mark.parametrize(("numeric", "build"), [("float32", "float"), ("q9.22", "fixed")])
@pytest.mark.parametrize("name", ["payload", "contact"])
def test_an_experiment_has_the_same_stops_and_the_same_bytes_as_with_the_library(
    name: str, numeric: Numeric, build: str
) -> None:
    scenario: Scenario = load_scenario(shipped(name))
    block = scenario.configuration.block(numeric)
    fd = scenario.configuration.settings.wire.format == "fd"
    bus = {"interface": "socketcan", "channel": CHANNEL, "fd": fd}
    cut = os.environ.get("CI") == "true" and (name, numeric) != COMPLETE_IN_CI
    image = versal_image(f"{name}-{build}", block, numeric=build)
    with Emulator(image, CHANNEL) as emulator, open_bus(**bus) as robot, open_bus(**bus) as ear:
        emulator.wait_for("on the bus")
        guard = ComparedGuard(ear, Guard(block, start=Start.POWER_ON), SLICE_CYCLES if cut else None)
        try:
            trace = Lockstep(scenario, robot, guard).run()
        except Enough:
            assert list(emulator.lines).count("permission") == 1
            return
        lines = list(emulator.lines)

    strikes = len(trace.contacts)
    assert trace.finished
    assert guard.cycles == len(trace.time_s)
    assert [stop.reason for stop in trace.stops].count(Reason.COLLISION) == strikes > 0
    assert lines.count("permission") == strikes + 1
    assert not any("fault" in line for line in lines)


def test_a_stop_command_of_another_guard_gets_through_the_filters_and_stops_it() -> None:
    configuration = load_scenario(shipped("contact")).configuration
    image = versal_image("contact-float", configuration.block("float32"), numeric="float")
    sender = Sender(Wire.read(), fd=True)
    with Emulator(image, CHANNEL) as emulator, open_bus(interface="socketcan", channel=CHANNEL, fd=True) as robot:
        emulator.wait_for("on the bus")
        for cycle in range(6):  # each Sync causes the tick of the previous cycle
            robot.send(sender.frame("Sync", {"Cycle": cycle}, cycle=cycle))
            if cycle == 3:
                robot.send(can.Message(arbitration_id=0x010, is_extended_id=False, is_fd=True, data=bytes(8)))
        emulator.wait_for(f"state {State.STOPPED:d} reason {Reason.ANOTHER_GUARD:d}")
