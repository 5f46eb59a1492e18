"""Sensor offsets and Coulomb friction: the part of a torque reading that is not the torque of the link.

For an arm at rest the offset is the mean of r. In motion, one regression of r on a constant and on the velocity's sign
gives offset and friction. Both regressors pass the observer's low-pass. A viscous term is also fitted and reported, but
never applied: on real arms it made the held-out data worse.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tauperp.calibrate.sources import Motion
from tauperp.errors import InputError
from tauperp.recording.offsets import conditioned, weights
from tauperp.robot import Robot
from tauperp.sim.dynamics import Dynamics

FloatArray = npt.NDArray[np.float64]

FULL_FRICTION_RAD_S = 0.05  # SENSOR_FULL_FRICTION_RAD_S of firmware/core/sensor.h
REST_RAD_S = 0.05
UNTOUCHED_NM = 0.5  # largest change of the mean of r between two windows of WINDOW_S in a recording at rest
WINDOW_S = 0.25
EACH_WAY_S = 1.0  # of motion in each direction that friction needs
LARGEST_NM = 60.0
PAYLOAD_KG = 0.4  # apparent payload above which the report mentions it
PAYLOAD_ROWS = 300  # of each motion that it is fitted to


@dataclass(frozen=True, eq=False)
class Correction:
    """(n,) Nm each. `viscous_gain` (n,): share by which a viscous term would lower the held-out rms of r."""

    offset_nm: FloatArray
    friction_nm: FloatArray
    viscous_gain: FloatArray

    def apply(self, motion: Motion) -> Motion:
        """The motion with the torque of the link, corrected as the firmware does it."""
        direction = np.clip(motion.qd / FULL_FRICTION_RAD_S, -1.0, 1.0)
        return motion.corrected(motion.tau - self.offset_nm - self.friction_nm * direction)


def offset_at_rest(motion: Motion, residual: FloatArray) -> FloatArray:
    """Mean of r (m, n) of an arm at rest, (n,) Nm. Raises InputError if it moves or is touched."""
    fastest = float(np.abs(motion.qd).max())
    if fastest > REST_RAD_S:
        raise InputError(f"{motion.name}: moves at {fastest:.2g} rad/s; offsets need an arm at rest")
    window = max(1, round(WINDOW_S * 1e6 / motion.period_us))
    blocks = len(residual) // window
    if blocks < 4:
        raise InputError(f"{motion.name}: shorter than the {4 * WINDOW_S:g} s at rest that offsets need")
    means = residual[: blocks * window].reshape(blocks, window, -1).mean(axis=1)
    change = means.max(axis=0) - means.min(axis=0)
    if change.max() > UNTOUCHED_NM:
        joint = int(np.argmax(change))
        raise InputError(
            f"{motion.name}: the torque of joint {joint + 1} changes by {change[joint]:.2f} Nm at rest: is it touched?"
        )
    result: FloatArray = means.mean(axis=0)
    return result


def fit_correction(
    fitted: Sequence[tuple[Motion, FloatArray]], held_out: Sequence[tuple[Motion, FloatArray]], gain_per_s: float
) -> Correction:
    """From pairs of a motion and its r (m, n), the start-up already cut off; judged on the held-out pairs."""
    n = fitted[0][1].shape[1]
    offset, friction, viscous_gain = np.zeros(n), np.zeros(n), np.zeros(n)
    for joint in range(n):
        columns, target = _stacked(fitted, joint, gain_per_s)
        both_ways = all(
            sum(float((sign * m.qd[:, joint] > FULL_FRICTION_RAD_S).sum()) * m.period_us * 1e-6 for m, _ in fitted)
            >= EACH_WAY_S
            for sign in (-1, 1)
        )
        used = columns[:, :2] if both_ways else columns[:, :1]
        found = np.linalg.lstsq(used, target, rcond=None)[0]
        if both_ways and found[1] < 0:  # a negative friction is a model error
            used = columns[:, :1]
            found = np.linalg.lstsq(used, target, rcond=None)[0]
        offset[joint] = found[0]
        friction[joint] = found[1] if used.shape[1] > 1 else 0.0
        if held_out and both_ways:
            viscous = np.linalg.lstsq(columns, target, rcond=None)[0]
            judge, left = _stacked(held_out, joint, gain_per_s)
            without = float(np.std(left - judge[:, : len(found)] @ found))
            viscous_gain[joint] = 1 - float(np.std(left - judge @ viscous)) / max(without, 1e-9)
    limit = LARGEST_NM
    if np.abs(offset).max() > limit or friction.max() > limit:
        joint = int(np.argmax(np.maximum(np.abs(offset), friction)))
        raise InputError(
            f"joint {joint + 1}: an offset of {offset[joint]:.1f} Nm is too large for a sensor: another robot or unit?"
        )
    return Correction(offset, friction, viscous_gain)


def _stacked(
    pairs: Sequence[tuple[Motion, FloatArray]], joint: int, gain_per_s: float
) -> tuple[FloatArray, FloatArray]:
    """Regressors 1, sign, velocity (k, 3) through the observer's low-pass, and r (k,)."""
    from scipy.signal import lfilter

    columns, target = [], []
    for motion, residual in pairs:
        decay = math.exp(-gain_per_s * motion.period_us * 1e-6)
        speed = motion.qd[:, joint]
        direction = np.clip(speed / FULL_FRICTION_RAD_S, -1.0, 1.0)
        filtered = [lfilter([1 - decay], [1, -decay], values) for values in (direction, speed)]
        columns.append(np.stack([np.ones(len(speed)), *filtered], axis=1))
        target.append(residual[:, joint])
    return np.concatenate(columns), np.concatenate(target)


@dataclass(frozen=True, eq=False)
class ApparentPayload:
    """The part of r that a rigid body at the end-effector would explain, fitted together with offset and friction."""

    mass_kg: float
    first_moment_kg_m: FloatArray  # (3,) in the last link's axes, about the end-effector point
    explained: float  # share of the variance of r without offsets and friction
    is_told_apart: bool  # the postures differ enough to distinguish its weight from offsets

    @property
    def is_there(self) -> bool:
        """Whether it is large and distinct enough to be a payload instead of model error."""
        return self.is_told_apart and abs(self.mass_kg) > PAYLOAD_KG and self.explained > 0.5

    def torque(self, motion: Motion, robot: Robot) -> FloatArray:
        """Its weight's torque in the motion's postures, (m, n) Nm."""
        dynamics, parameters = Dynamics(robot), np.append(self.mass_kg, self.first_moment_kg_m)
        return np.stack([weights(dynamics, q, robot.gravity) @ parameters for q in motion.q])


def apparent_payload(pairs: Sequence[tuple[Motion, FloatArray]], robot: Robot) -> ApparentPayload:
    """Least squares over some hundred rows of the pairs of a motion and its r (m, n)."""
    dynamics, n = Dynamics(robot), robot.n
    columns, target = [], []
    for motion, residual in pairs:
        for row in np.linspace(0, len(motion.q) - 1, PAYLOAD_ROWS).astype(int):
            direction = np.diag(np.clip(motion.qd[row] / FULL_FRICTION_RAD_S, -1.0, 1.0))
            columns.append(np.hstack([np.eye(n), direction, weights(dynamics, motion.q[row], robot.gravity)]))
            target.append(residual[row])
    x, y = np.concatenate(columns), np.concatenate(target)
    found = np.linalg.lstsq(x, y, rcond=1e-6)[0]
    is_told_apart = conditioned(x)
    without = y - x[:, : 2 * n] @ found[: 2 * n]
    left = without - x[:, 2 * n :] @ found[2 * n :]
    explained = 1 - float((left**2).sum()) / max(float((without**2).sum()), 1e-12)
    return ApparentPayload(float(found[2 * n]), found[2 * n + 1 :], explained, is_told_apart)
