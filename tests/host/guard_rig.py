"""An arm that stands still and a board's loop around the compiled guard, for tests of faults.

Every tick of the rig asserts that motion is permitted only if a snapshot was evaluated recently.
"""

import dataclasses
import itertools
from collections.abc import Callable, Iterable

import can
import numpy as np
import pytest
from plain import ONE_CHANNEL

from tauperp.config import Configuration, Numeric, load_configuration
from tauperp.firmware import Core, Guard, Verdict, reaction_us
from tauperp.wire import Sender

JOINT_DEADLINE = 4  # cycles, the DBC's
TASK_DEADLINE = 8
CLOCK_WINDOW = 64  # cycles over which the guard compares its clock with the cycles
LONG = 4000  # cycles in which all effects have happened
GAIN_PER_S = {1000: 50.0, 500: 50.0, 100: 40.0, 20: 15.0}

Frames = list[can.Message]


@dataclasses.dataclass(frozen=True)
class Case:
    """One installation that the tests run on."""

    robot: str
    rate_hz: int
    numeric: Numeric

    def __str__(self) -> str:
        return f"{self.robot}-{self.rate_hz}-{self.numeric}"

    def configuration(self) -> Configuration:
        slow = {} if self.rate_hz >= 100 else ONE_CHANNEL  # the bank of the preset needs 100 Hz
        overrides = slow | {
            "wire": {"rate_hz": self.rate_hz, "format": "fd"},
            "observer": {"gain_per_s": GAIN_PER_S[self.rate_hz]},
            "reset": {"healthy_ms": max(100.0, 6e3 / GAIN_PER_S[self.rate_hz])},
        }
        return load_configuration("default", robot=self.robot, overrides=overrides)


CASES = (
    Case("ku_dex", 1000, "float32"),
    Case("panda", 500, "q9.22"),
    Case("iiwa7", 100, "float32"),
    Case("kinova3", 20, "q9.22"),
)
on_every_case = pytest.mark.parametrize("case", CASES, ids=str)


class Rig:
    """An arm at rest, its controller, and a board that ticks once a cycle. `contact`: torque from outside, (n,) Nm."""

    def __init__(self, case: Case) -> None:
        self.configuration = configuration = case.configuration()
        block = configuration.block(case.numeric)
        self.reaction_cycles = -(-reaction_us(block) // configuration.period_us)
        self.guard = Guard(block)
        self.n = self.guard.n
        joints = configuration.robot.joints
        wanted = np.array([0.3, -0.4, 0.2, -1.4, 0.4, 1.2, 0.5][: self.n])
        low, high = (np.array([getattr(joint, f"position_{end}") for joint in joints]) for end in ("min", "max"))
        self.q = np.clip(wanted, low + 0.1, high - 0.1)
        self.gravity = Core(configuration.robot, case.numeric, configuration).terms(self.q, np.zeros(self.n)).gravity
        self.push = np.array([0.25 * joint.torque_max for joint in joints]) * (np.arange(self.n) == 1)
        self.contact = np.zeros(self.n)
        self.sender = Sender(configuration.wire, fd=True)
        self.period_us = configuration.period_us
        self.clock_us = 1_000_000.0
        self.clock_rate = 1.0
        self.cycle = 1
        self.since_evaluated = LONG
        self.verdict: Verdict | None = None

    def frame(self, name: str, **signals: float) -> can.Message:
        return self.sender.frame(name, signals, cycle=None if name == "GuardReset" else self.cycle)

    def sync(self) -> can.Message:
        return self.frame("Sync", Cycle=self.cycle & 0xFFFF)

    def task(self) -> can.Message:
        return self.frame("TaskCommand", Task=1, AccelX=0.0, AccelY=0.0, AccelZ=0.0)

    def joints(self) -> Frames:
        torque = self.gravity + self.contact
        return [
            self.frame(f"JointState{i + 1}", SensorStatus=0, Position=self.q[i], Velocity=0.0, Torque=torque[i])
            for i in range(self.n)
        ]

    def advance(self, stride: int = 1) -> None:
        """Advance to the next cycle: the guard's clock and the controller's cycle number."""
        self.clock_us += self.period_us * self.clock_rate
        self.cycle += stride

    def all_frames(self) -> Frames:
        return [self.sync(), self.task(), *self.joints()]

    def receive(self, frames: Iterable[can.Message]) -> None:
        for frame in frames:
            self.guard.receive(frame, int(self.clock_us))

    def tick(self) -> Verdict:
        verdict = self.verdict = self.guard.tick(int(self.clock_us))
        self.since_evaluated = 0 if verdict.fresh else self.since_evaluated + 1
        if verdict.permitted:
            assert self.since_evaluated <= JOINT_DEADLINE, "permitted without an evaluation"
            assert verdict.frames[0].data[2] == 0xE1
        else:
            assert verdict.frames[0].data[2] != 0xE1
        return verdict

    def step(self, stride: int = 1) -> Verdict:
        self.advance(stride)
        self.receive(self.all_frames())
        return self.tick()

    def resets(self) -> Callable[[], None]:
        """A function that sends one GuardReset per call: a square wave of Request with the trip number of the guard."""
        requests = itertools.cycle((0, 0, 1))

        def ask() -> None:
            number = self.verdict.trip_number if self.verdict else 0
            self.receive([self.frame("GuardReset", Request=next(requests), TripNumber=number)])

        return ask

    def permitted_within(self, cycles: int, step: Callable[[], Verdict] | None = None) -> int | None:
        """Runs with a controller that permanently requests resets; cycles to the first permission, or None."""
        ask = self.resets()
        for k in range(cycles):
            ask()
            if (step or self.step)().permitted:
                return k
        return None

    def started(self) -> "Rig":
        assert self.permitted_within(LONG) is not None, self.verdict
        return self

    def stopped_within(self, cycles: int, step: Callable[[], Verdict] | None = None) -> int | None:
        return next((k for k in range(1, cycles + 1) if not (step or self.step)().permitted), None)


def random_of(case: Case, seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, CASES.index(case)])
