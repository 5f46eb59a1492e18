"""Both experiments again, from the frames that the simulated robot sent, in float and in Q9.22. The firmware stops the
robot within one cycle of a float64 reference; within three cycles where the explained part exceeds its limits."""

from collections.abc import Iterator
from dataclasses import dataclass

import can
import numpy as np
import pytest
from reference import Reference

from tauperp.config import NUMERICS, Numeric
from tauperp.experiment import load_experiment, run_scenario
from tauperp.firmware import Guard, Reason
from tauperp.judge.judge import DETECTIONS
from tauperp.robot import Joint
from tauperp.run.scenario import Scenario
from tauperp.wire import Receiver

STOP_COMMAND, OF_GUARD = 0x010, (0x010, 0x200, 0x201)
RESIDUAL_NM = 0.02
ESTIMATE_CYCLES = (
    3  # explained.h: the estimate of the explained part converges over several cycles; float64 solves for it
)

Run = tuple[Scenario, list[can.Message]]


@pytest.fixture(
    scope="module",
    params=[
        ("payload", "ku_dex", None),
        ("contact", "ku_dex", None),
        ("payload", "panda", 31),
        ("contact", "iiwa7", 32),
    ],
    ids=lambda parameters: "-".join(map(str, parameters)),
)
def run(request: pytest.FixtureRequest) -> Run:
    name, robot, seed = request.param
    # The float64 reference is the published method: one filter, then the projection.
    scenario = load_experiment(name, robot=robot, seed=seed, config="paper", sensors="paper")
    frames: list[can.Message] = []
    run_scenario(scenario, listener=frames.append)
    return scenario, frames


def cycles(frames: list[can.Message]) -> Iterator[list[can.Message]]:
    """The robot's frames of each cycle; the guard's answer begins with its StopCommand."""
    cycle: list[can.Message] = []
    for frame in frames:
        if frame.arbitration_id == STOP_COMMAND:
            yield cycle
            cycle = []
        elif frame.arbitration_id not in OF_GUARD:
            cycle.append(frame)


@dataclass
class Course:
    """The firmware's reaction in each cycle."""

    permitted: list[bool]
    residual: list[np.ndarray]
    collisions: list[int]  # cycles
    late: list[int]  # cycles by which each may differ from float64's


def firmware(run: Run, numeric: Numeric) -> Course:
    scenario, frames = run
    guard = Guard(scenario.configuration.block(numeric))
    course = Course([], [], [], [])
    trip = 0
    for number, cycle in enumerate(cycles(frames)):
        now_us = number * scenario.configuration.period_us
        for frame in cycle:
            guard.receive(frame, now_us)
        verdict = guard.tick(now_us)
        course.permitted.append(verdict.permitted)
        course.residual.append(verdict.residual)
        if verdict.trip_number != trip:
            assert verdict.reason in DETECTIONS
            trip = verdict.trip_number
            course.collisions.append(number)
            course.late.append(1 if verdict.reason == Reason.COLLISION else ESTIMATE_CYCLES)
    return course


@pytest.fixture(scope="module")
def reference(run: Run) -> tuple[list[bool], list[np.ndarray]]:
    """Whether each cycle is a collision, and its residual. An impossible reading is not used."""
    scenario, frames = run
    method, receiver, robot = Reference(scenario.configuration), Receiver(scenario.configuration.wire), scenario.robot
    readings = np.zeros((3, robot.n))
    acceleration, task, last = np.zeros(3), 0, 0
    collisions: list[bool] = []
    residuals: list[np.ndarray] = []
    for number, cycle in enumerate(cycles(frames)):
        fresh = 0
        for frame in cycle:
            received = receiver.receive(frame)
            assert received is not None
            assert not received.invalid
            signals, at = received.signals, received.message.joint - 1
            if at >= 0 and signals:  # the first frame of each sender only sets its counter
                reading = [signals[name] for name in ("Position", "Velocity", "Torque")]
                if within(robot.joints[at], *reading):
                    readings[:, at] = reading
                    fresh += 1
            elif received.message.name == "TaskCommand" and signals:
                task = int(signals["Task"])
                acceleration = np.array([signals[f"Accel{axis}"] for axis in "XYZ"])
        whole = fresh == robot.n
        collisions.append(whole and method.step(*readings, task, acceleration, number - last))
        last = number if whole else last
        residuals.append(method.residual.copy())
    return collisions, residuals


def within(joint: Joint, position: float, velocity: float, torque: float) -> bool:
    return (
        joint.position_min <= position <= joint.position_max
        and abs(velocity) <= joint.velocity_max
        and abs(torque) < joint.torque_max
    )


@pytest.mark.parametrize("numeric", NUMERICS)
def test_the_firmware_stops_in_the_cycle_in_which_float64_does(
    run: Run, reference: tuple[list[bool], list[np.ndarray]], numeric: Numeric
) -> None:
    course = firmware(run, numeric)
    collisions, residuals = reference
    difference = float(np.max(np.abs(np.array(course.residual) - np.array(residuals))))
    theirs: list[int] = []
    watched = False  # the robot is permitted to move, and float64 has found no collision since then
    for number, permitted in enumerate(course.permitted):
        watched = watched or (permitted and not course.permitted[number - 1])
        stopped_now = not permitted and number > 0 and course.permitted[number - 1]
        late = not permitted and number > 1 and course.permitted[number - 2]
        if watched and collisions[number] and (permitted or stopped_now or late):
            theirs.append(number)
            watched = False
    print(f"stops {course.collisions}, float64 {theirs}; residual within {difference:.1e} Nm")
    assert len(course.collisions) == sum(len(phase.strikes) for phase in run[0].phases)
    assert difference <= RESIDUAL_NM
    assert len(theirs) == len(course.collisions)
    assert (np.abs(np.array(course.collisions) - np.array(theirs)) <= course.late).all()
