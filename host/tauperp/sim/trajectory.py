"""Planned motion as samples of one control cycle, so that the desired values are known exactly, including
accelerations.

All motion under position control is one of these: a move, a stop, a retreat. They start and end at rest where stated,
keep within the given speeds and accelerations, and raise `Unreachable` if that is not possible.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauperp.robot import Robot
from tauperp.sim.dynamics import Dynamics, rotation_vector

Vector = NDArray[np.float64]

PEAK_SPEED = 1.875  # of the quintic 10u^3 - 15u^4 + 6u^5, in units of distance / duration
PEAK_ACCELERATION = 10 / math.sqrt(3)  # in units of distance / duration^2
SMALL_SINGULAR = 0.08  # singular value of the Jacobian below which damping starts
DAMPING = 0.05
TRACKING_PER_S = 20.0  # rate at which the resolved motion corrects its drift from the straight line
POSTURE_PER_S = 1.0
SETTLE_S = 0.2  # time at the end of a straight move, to correct the effect of damping
REACHED_M = 2e-3
AT_REST_RAD_S = 5e-3
MOVE_MARGIN = 0.98  # share of a joint's range and speed, so that tracking error does not exceed them


class Unreachable(ValueError):
    """The arm cannot do this. The message names the joint or the missing distance."""


@dataclass(frozen=True)
class Trajectory:
    """N samples, one each control cycle: joints (N, n) rad, rad/s, rad/s2; end-effector acceleration (N, 3) m/s2."""

    position: Vector
    velocity: Vector
    acceleration: Vector
    tip_acceleration: Vector

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True)
class Limits:
    """Of a Cartesian move, m/s, m/s2, rad/s; and of a joint move as fractions of what each joint can."""

    speed_m_s: float = 0.5
    acceleration_m_s2: float = 2.0
    turn_rad_s: float = 1.0
    joint_speed_rad_s: float = 0.8
    joint_acceleration_rad_s2: float = 3.0


class Planner:
    """Plans for one arm at one control period. Calls do not depend on each other."""

    def __init__(self, robot: Robot, dynamics: Dynamics, period_s: float) -> None:
        self._dynamics = dynamics
        self._period = period_s
        self._min = np.array([joint.position_min for joint in robot.joints])
        self._max = np.array([joint.position_max for joint in robot.joints])
        self._speed = np.array([joint.velocity_max for joint in robot.joints])
        self._names = [joint.name for joint in robot.joints]

    def joint_move(self, start: Vector, goal: Vector, limits: Limits) -> Trajectory:
        """From rest to rest, every joint along the same quintic."""
        distance = float(np.max(np.abs(goal - start)))
        duration = _duration(distance, limits.joint_speed_rad_s, limits.joint_acceleration_rad_s2)
        path = start + _quintic(self._steps(duration))[:, None] * (goal - start)
        return self._checked(self._differentiate(path))

    def straight_move(
        self, start: Vector, goal_m: Vector, goal_rotation: Vector, posture: Vector, limits: Limits
    ) -> Trajectory:
        """From rest at the joints `start` (n,) in a straight line of the end-effector to rest at `goal_m` (3,).

        The orientation turns evenly to `goal_rotation` (3, 3). Damped resolved motion; what the task leaves free
        drifts towards the joint posture `posture` (n,). An arm with fewer than six joints keeps to the line only.
        """
        dynamics, period = self._dynamics, self._period
        begin_m, begin_rotation = dynamics.tip(start)
        line = goal_m - begin_m
        turn = begin_rotation @ rotation_vector(begin_rotation.T @ goal_rotation)
        length, angle = float(np.linalg.norm(line)), float(np.linalg.norm(turn))
        duration = max(
            _duration(length, limits.speed_m_s, limits.acceleration_m_s2), PEAK_SPEED * angle / limits.turn_rad_s
        )
        rows = 6 if len(start) >= 6 else 3
        phase = np.concatenate([self._steps(duration), np.ones(round(SETTLE_S / period))])
        progress, rate = _quintic(phase), _quintic_rate(phase) / max(duration, period)
        path = np.empty((len(phase), len(start)))
        joints = start.copy()
        for step, (s, ds, u) in enumerate(zip(progress, rate, phase, strict=True)):
            path[step] = joints
            tip, rotation = dynamics.tip(joints)
            wanted = _rotate(turn * s) @ begin_rotation
            error = np.concatenate([begin_m + s * line - tip, rotation @ rotation_vector(rotation.T @ wanted)])
            twist = np.concatenate([line, turn]) * ds + TRACKING_PER_S * error
            # The null-space drift starts and ends at rest, like the move.
            drift = POSTURE_PER_S * math.sin(math.pi * u) ** 2 * (posture - joints)
            joints = joints + period * _resolve(dynamics.jacobian(joints)[:rows], twist[:rows], drift)
        if np.max(np.abs(path[-1] - path[-2])) > AT_REST_RAD_S * period:
            raise Unreachable("the straight line ends too near a singular posture to come to rest")
        missing = float(np.linalg.norm(dynamics.tip(path[-1])[0] - goal_m))
        if missing > REACHED_M:
            raise Unreachable(f"the straight line ends {missing * 1000:.0f} mm from its goal")
        return self._checked(self._differentiate(path))

    def stop(self, position: Vector, velocity: Vector, deceleration_rad_s2: float) -> Trajectory:
        """From full motion to rest. All joints stop together, so that the direction of motion stays; the fastest
        decelerates at `deceleration_rad_s2`."""
        steps = max(2, math.ceil(float(np.max(np.abs(velocity))) / deceleration_rad_s2 / self._period) + 1)
        duration = (steps - 1) * self._period
        time = np.arange(steps)[:, None] * self._period
        speed = velocity * (1 - time / duration)
        return self._with_tip(
            position + velocity * time * (1 - time / (2 * duration)), speed, np.tile(-velocity / duration, (steps, 1))
        )

    def retreat(self, path: Vector, distance_m: float, limits: Limits) -> Trajectory:
        """Back along `path` (M, n), its newest sample last and at rest, until the tip has moved by `distance_m`."""
        backwards = path[::-1]
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(backwards, axis=0), axis=1))])
        keep = np.concatenate([[True], np.diff(way) > 1e-7])
        backwards, way = backwards[keep], way[keep]
        tips = np.array([self._dynamics.tip(joints)[0] for joints in backwards])
        gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tips, axis=0), axis=1))])
        end = int(np.searchsorted(gone, distance_m))
        backwards, way, gone = backwards[: end + 1], way[: end + 1], gone[: end + 1]
        duration = max(
            _duration(float(gone[-1]), limits.speed_m_s, limits.acceleration_m_s2),
            _duration(float(way[-1]), limits.joint_speed_rad_s, limits.joint_acceleration_rad_s2),
        )
        along = way[-1] * _quintic(self._steps(duration))
        columns = [np.interp(along, way, backwards[:, joint]) for joint in range(path.shape[1])]
        return self._differentiate(np.stack(columns, axis=1))

    def _steps(self, duration: float) -> Vector:
        """0 to 1 in whole cycles, three samples at least."""
        return np.linspace(0.0, 1.0, max(3, math.ceil(duration / self._period) + 1))

    def _differentiate(self, path: Vector) -> Trajectory:
        velocity = np.gradient(path, self._period, axis=0)
        velocity[[0, -1]] = 0.0
        return self._with_tip(path, velocity, np.gradient(velocity, self._period, axis=0))

    def _with_tip(self, position: Vector, velocity: Vector, acceleration: Vector) -> Trajectory:
        linear = [self._dynamics.jacobian(q)[:3] @ qd for q, qd in zip(position, velocity, strict=True)]
        return Trajectory(position, velocity, acceleration, np.gradient(np.array(linear), self._period, axis=0))

    def _checked(self, trajectory: Trajectory) -> Trajectory:
        """The trajectory, if it keeps within the ranges and speeds of all joints."""
        middle, half = ((self._max + self._min) / 2, MOVE_MARGIN * (self._max - self._min) / 2)
        outside = np.max(np.abs(trajectory.position - middle), axis=0) > half
        fast = np.max(np.abs(trajectory.velocity), axis=0) > MOVE_MARGIN * self._speed
        for bad, what in ((outside, "range"), (fast, "speed limit")):
            if np.any(bad):
                raise Unreachable(f"{self._names[int(np.argmax(bad))]} would leave its {what}")
        return trajectory


def _duration(distance: float, speed: float, acceleration: float) -> float:
    return max(PEAK_SPEED * distance / speed, math.sqrt(PEAK_ACCELERATION * distance / acceleration))


def _quintic(u: Vector) -> Vector:
    return u**3 * (10 - 15 * u + 6 * u**2)


def _quintic_rate(u: Vector) -> Vector:
    return 30 * u**2 * (1 - u) ** 2


def _rotate(turn: Vector) -> Vector:
    """Rotation matrix (3, 3) of a rotation vector (3,) rad, by Rodrigues' formula."""
    angle = float(np.linalg.norm(turn))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = turn / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def _resolve(jacobian: Vector, twist: Vector, drift: Vector) -> Vector:
    """Joint velocity (n,) for a twist (k,), damped near singularities, plus the part of `drift` that moves no tip."""
    u, sigma, vt = np.linalg.svd(jacobian, full_matrices=False)
    damping = DAMPING**2 * np.clip(1 - (sigma / SMALL_SINGULAR) ** 2, 0, None)
    wanted = vt.T @ (sigma / (sigma**2 + damping + 1e-12) * (u.T @ twist))
    return wanted + drift - vt.T @ (vt @ drift)
