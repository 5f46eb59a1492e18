"""The robot's behaviour from cycle to cycle: its jobs one after the other, its stops, and its return.

Follows the paper's flowchart (Fig. 4): the task continues while motion is permitted. Otherwise the robot stops,
retreats along its path, requests a reset, and continues with a trajectory planned from its position.

    READY -> FOLLOWING -> STOPPING -> PAUSING -> RETREATING -> READY      stop category 2: it stays in control
                          STOPPING -> BRAKED  -> READY                    1: brakes at standstill
                          BRAKED -> READY                                 0: brakes at once, motors off
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from tauperp.sim.arm import JointSample
from tauperp.sim.control import ComputedTorque, Impedance, ImpedanceGains, blend
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.trajectory import Limits, Planner, Trajectory

Vector = NDArray[np.float64]

PATH_S = 3.0  # how far back the robot remembers its path
FOLLOWING_ERROR_RAD = 0.15  # a drive with this position error is no longer in control: brakes
AT_REST_RAD_S = 0.02
RETURN_S = 1.5  # s in which impedance control returns the tip to the pose that it holds


@dataclass(frozen=True)
class Move:
    """To rest at joints `joints` (n,) rad, or in a straight line to `tip_m` (3,) m with `rotation` (3, 3)."""

    joints: Vector | None = None
    tip_m: Vector | None = None
    rotation: Vector | None = None
    limits: Limits = field(default_factory=Limits)


@dataclass(frozen=True)
class Wait:
    """Stand still in position control."""

    duration_s: float


@dataclass(frozen=True)
class Yield:
    """Hold the current pose in impedance control, so that a person can push the arm out of it."""

    duration_s: float
    gains: ImpedanceGains = field(default_factory=ImpedanceGains)


Job = Move | Wait | Yield


@dataclass(frozen=True)
class Recovery:
    """How the robot stops and returns."""

    deceleration_rad_s2: float = 6.0
    pause_s: float = 0.4  # s at standstill, for the person to remove the hand
    retreat_m: float = 0.05
    limits: Limits = field(default_factory=lambda: Limits(0.1, 0.5, 0.5, 0.3, 1.0))


class Mode(Enum):
    """State of the robot."""

    READY = auto()
    FOLLOWING = auto()
    STOPPING = auto()
    PAUSING = auto()
    RETREATING = auto()
    BRAKED = auto()


@dataclass(frozen=True)
class Permit:
    """What this cycle's StopCommand, or its absence, requires."""

    allowed: bool
    category: int = 1
    collision: bool = False  # a person is in the way: retreat before continuing


class Motion:
    """The robot's state machine. `step` is called once per cycle and returns the motors' torque.

    Raises `Unreachable` from `step` if a job cannot be planned from the current position.
    """

    def __init__(
        self,
        planner: Planner,
        dynamics: Dynamics,
        period_s: float,
        start: Vector,
        jobs: Sequence[Job],
        recovery: Recovery = Recovery(),
    ) -> None:
        self._planner = planner
        self._dynamics = dynamics
        self._period = period_s
        self._jobs = tuple(jobs)
        self._recovery = recovery
        self._position_control = ComputedTorque(dynamics, period_s)
        self._home = start.copy()
        self._rest = start.copy()  # position without a trajectory
        self._trajectory: Trajectory | None = None
        self._sample = 0
        self._cycles_left = 0  # of a Wait, a Yield or a pause
        self._impedance: Impedance | None = None
        self._pose: tuple[Vector, Vector] | None = None  # pose that a Yield holds
        self._yielded = 0
        self._category = 2
        self._cycles_paused = 0
        self._retreat_due = False
        self._path: deque[Vector] = deque(maxlen=round(PATH_S / period_s))
        self.job = 0
        self.mode = Mode.READY

    @property
    def finished(self) -> bool:
        """All jobs are done."""
        return self.job == len(self._jobs)

    @property
    def standing(self) -> bool:
        """The robot has stopped, and waits for a permission or a person."""
        return self.mode in (Mode.READY, Mode.PAUSING, Mode.BRAKED)

    @property
    def wants_reset(self) -> bool:
        """It is ready to continue; only the permission is missing."""
        return self.mode in (Mode.READY, Mode.BRAKED)

    @property
    def brakes(self) -> bool:
        """Whether the brakes must be on."""
        return self.mode is Mode.BRAKED

    @property
    def tip_acceleration(self) -> Vector:
        """Desired acceleration of the end-effector now, base frame (3,) m/s2."""
        if self._trajectory is None:
            return np.zeros(3)
        return self._trajectory.tip_acceleration[self._sample]

    def step(self, permit: Permit, sample: JointSample) -> Vector:
        """Motor torque (n,) Nm for the cycle that starts with this sample."""
        if permit.allowed:
            self._go_on(sample)
        else:
            self._heed(permit, sample)
        if self._lost(sample):
            self._position_control.reset()
            self._enter(Mode.BRAKED)
        torque = self._torque(sample)
        self._advance(sample)
        return torque

    def _lost(self, sample: JointSample) -> bool:
        """Whether it is pushed too far off its reference, as a weak arm with saturated motors may be."""
        if self.mode is Mode.BRAKED or self._impedance is not None:
            return False
        return bool(np.max(np.abs(self._reference(sample)[0] - sample.position)) > FOLLOWING_ERROR_RAD)

    def _heed(self, permit: Permit, sample: JointSample) -> None:
        """No permission: stop as requested. A stricter category may follow during the stop."""
        self._retreat_due |= permit.collision
        moving = self.mode in (Mode.FOLLOWING, Mode.RETREATING, Mode.STOPPING)
        if permit.category == 0:
            self._enter(Mode.BRAKED)
        elif self.mode is Mode.FOLLOWING or (self.mode is Mode.RETREATING and permit.category == 1):
            self._category = permit.category
            self._stop(sample)
        elif permit.category == 1 and not moving:
            self._enter(Mode.BRAKED)
        else:
            self._category = min(self._category, permit.category)

    def _go_on(self, sample: JointSample) -> None:
        if self.mode is Mode.BRAKED and np.max(np.abs(sample.velocity)) < AT_REST_RAD_S:
            self._rest = sample.position.copy()
            self._enter(Mode.READY)
        if self.mode is not Mode.READY:
            return
        if self._retreat_due and len(self._path) > 1:
            self._retreat()
        else:
            self._retreat_due = False
            self._enter(Mode.FOLLOWING)
            self._resume(sample)

    def _stop(self, sample: JointSample) -> None:
        position, velocity = self._reference(sample)[:2]
        self._trajectory, self._sample = (self._planner.stop(position, velocity, self._recovery.deceleration_rad_s2), 0)
        self._impedance = None
        self.mode = Mode.STOPPING

    def _retreat(self) -> None:
        path = np.array(self._path)
        self._path.clear()
        self._retreat_due = False
        self._trajectory = self._planner.retreat(path, self._recovery.retreat_m, self._recovery.limits)
        self._sample = 0
        self.mode = Mode.RETREATING

    def _enter(self, mode: Mode) -> None:
        self.mode = mode
        self._trajectory, self._sample, self._impedance = None, 0, None

    def _resume(self, sample: JointSample) -> None:
        """Start or continue the current job, from the current position."""
        if self.finished:
            return
        job = self._jobs[self.job]
        if isinstance(job, Move):
            self._trajectory, self._sample = self._plan(job), 0
            return
        if self._cycles_left == 0:
            self._cycles_left = max(1, round(job.duration_s / self._period))
            self._pose = None
        if isinstance(job, Yield):
            self._impedance = Impedance(self._dynamics, job.gains, sample.position, self._home)
            self._yielded = 0
            if self._pose is None:
                self._pose = self._dynamics.tip(self._rest)

    def _plan(self, move: Move) -> Trajectory:
        if move.joints is not None:
            return self._planner.joint_move(self._rest, move.joints, move.limits)
        assert move.tip_m is not None
        assert move.rotation is not None
        return self._planner.straight_move(self._rest, move.tip_m, move.rotation, self._home, move.limits)

    def _reference(self, sample: JointSample) -> tuple[Vector, Vector, Vector]:
        if self._impedance is not None:
            return sample.position, sample.velocity, np.zeros_like(sample.position)
        if self._trajectory is None:
            still = np.zeros_like(self._rest)
            return self._rest, still, still
        now = self._sample
        return (self._trajectory.position[now], self._trajectory.velocity[now], self._trajectory.acceleration[now])

    def _torque(self, sample: JointSample) -> Vector:
        if self.mode is Mode.BRAKED:
            return np.zeros_like(sample.position)
        if self._impedance is not None:
            assert self._pose is not None
            goal = blend(self._impedance.start_m, self._pose[0], self._yielded * self._period / RETURN_S)
            return self._impedance.torque(sample.position, sample.velocity, goal, self._pose[1])
        learn = self.mode not in (Mode.STOPPING, Mode.PAUSING)
        return self._position_control.torque(sample.position, sample.velocity, self._reference(sample), learn=learn)

    def _advance(self, sample: JointSample) -> None:
        """Advance to the next cycle, and to the next state if this one ends."""
        if self.mode in (Mode.FOLLOWING, Mode.STOPPING):
            self._path.append(self._reference(sample)[0])
        if self._trajectory is not None:
            self._sample += 1
            if self._sample == len(self._trajectory):
                self._rest = self._trajectory.position[-1].copy()
                self._trajectory_done(sample)
        elif self.mode is Mode.PAUSING:
            self._cycles_paused += 1
            if self._cycles_paused * self._period >= self._recovery.pause_s:
                if self._retreat_due and len(self._path) > 1:
                    self._retreat()
                else:
                    self._enter(Mode.READY)
        elif self.mode is Mode.FOLLOWING and not self.finished:
            self._yielded += 1
            self._cycles_left -= 1
            if self._cycles_left == 0:
                self._job_done(sample)

    def _trajectory_done(self, sample: JointSample) -> None:
        if self.mode is Mode.STOPPING:
            self._enter(Mode.PAUSING if self._category == 2 else Mode.BRAKED)
            self._cycles_paused = 0
        elif self.mode is Mode.RETREATING:
            self._enter(Mode.READY)
        else:
            self._job_done(sample)

    def _job_done(self, sample: JointSample) -> None:
        if self._impedance is not None:
            self._rest = sample.position.copy()
            self._position_control.reset()
        self._trajectory, self._impedance, self._cycles_left = None, None, 0
        self._path.clear()  # a retreat ends where the job started, not on the path before
        self.job += 1
        self._resume(sample)
