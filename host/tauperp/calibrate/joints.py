"""Check of the columns of a recording: every joint's sign, order and unit against the model.

A joint with the wrong sign of torque, or two swapped joints, would give thresholds of hundreds of newton metres, with
which the guard detects nothing. The check compares the measured torque with the model's torque for the recorded motion,
and the recorded velocity with the rate of the recorded position.
"""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tauperp.calibrate.sources import Motion
from tauperp.errors import InputError
from tauperp.robot import Robot
from tauperp.sim.dynamics import Dynamics

FloatArray = npt.NDArray[np.float64]

SAMPLES = 400
POSES = 24
TELLING_NM = 1.0  # a smaller model torque gives no information about a joint
SMOOTHING_S = 0.02
BETTER = 0.35  # remaining misfit below which another order of columns is accepted as the cause
BAD = 0.5  # misfit relative to the model's torque above which the check searches a cause
MOVING_RAD_S = 0.05


def check_joints(motions: Sequence[Motion], robot: Robot) -> list[str]:
    """The checks, one line per joint. Raises InputError with the joint and its error."""
    for motion in motions:
        _check_ranges(motion, robot)
        _check_velocity(motion, robot)
    dynamics = Dynamics(robot)
    torque, model, postures, velocities = _sampled(motions, dynamics)
    _check_order(motions, robot, dynamics, torque, model, postures, velocities)
    return _check_torque(motions, robot, torque, model)


def _check_ranges(motion: Motion, robot: Robot) -> None:
    """Angles beyond the joint's range are in degrees, or belong to another joint."""
    for joint, limits in enumerate(robot.joints):
        low, high = float(motion.q[:, joint].min()), float(motion.q[:, joint].max())
        if high > limits.position_max + 0.2 or low < limits.position_min - 0.2:
            unit = "; in degrees?" if max(abs(low), abs(high)) > 2 * math.pi else ""
            raise InputError(
                f"{motion.name}: joint {joint + 1} ({limits.name}) goes from {low:.3g} to {high:.3g} rad, "
                f"and its range is {limits.position_min:.3g} to {limits.position_max:.3g}{unit}"
            )


def _check_velocity(motion: Motion, robot: Robot) -> None:
    """The velocity must be the rate of the position: factor 1, not 57.3, and the same sign."""
    steps = np.diff(motion.time_s)
    good = steps > 0
    if good.sum() < 10:
        return
    rate = np.diff(motion.q, axis=0)[good] / steps[good, None]
    mean = (0.5 * (motion.qd[1:] + motion.qd[:-1]))[good]
    for joint, limits in enumerate(robot.joints):
        x, y = mean[:, joint], rate[:, joint]
        if np.abs(y).max() < MOVING_RAD_S or float(x @ x) == 0.0 or np.std(y) < MOVING_RAD_S / 4:
            continue
        slope, fit = float(x @ y / (x @ x)), float(x @ y / math.sqrt((x @ x) * (y @ y)))
        if fit < -0.5:
            wrong = "has the opposite sign of its position's rate"
        elif fit > 0.5 and not 0.5 < slope < 2.0:
            unit = " (degrees a second?)" if 0.01 < slope < 0.025 else ""
            wrong = f"is {1 / slope:.3g} times its position's rate{unit}"
        else:
            continue
        raise InputError(f"{motion.name}: joint {joint + 1} ({limits.name}): its velocity {wrong}")


def _sampled(motions: Sequence[Motion], dynamics: Dynamics) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Measured and modelled torque, posture and velocity at some hundred rows, (k, n) each."""
    torque, model, postures, velocities = [], [], [], []
    for motion in motions:
        window = max(1, round(SMOOTHING_S * 1e6 / motion.period_us))
        acceleration = np.gradient(_smooth(motion.qd, window), motion.period_us * 1e-6, axis=0)
        smooth = _smooth(motion.tau, window)
        rows = np.linspace(window, len(motion.q) - window - 1, max(2, SAMPLES // len(motions))).astype(int)
        for row in rows:
            q, qd = motion.q[row], motion.qd[row]
            torque.append(smooth[row])
            model.append(dynamics.bias(q, qd) + dynamics.inertia(q) @ acceleration[row])
            postures.append(q)
            velocities.append(qd)
    return np.array(torque), np.array(model), np.array(postures), np.array(velocities)


def _smooth(values: FloatArray, window: int) -> FloatArray:
    if window < 2:
        return values
    kernel = np.ones(window) / window
    return np.stack([np.convolve(column, kernel, mode="same") for column in values.T], axis=1)


def _misfit(torque: FloatArray, model: FloatArray) -> float:
    """The misfit of each joint's torque with the better sign, relative to the model's torque."""
    left = np.minimum(((torque - model) ** 2).sum(axis=0), ((torque + model) ** 2).sum(axis=0))
    return math.sqrt(float(left.sum()) / max(float((model**2).sum()), 1e-12))


def _check_order(
    motions: Sequence[Motion],
    robot: Robot,
    dynamics: Dynamics,
    torque: FloatArray,
    model: FloatArray,
    postures: FloatArray,
    velocities: FloatArray,
) -> None:
    """Whether another order of the columns fits the model far better."""
    own = _misfit(torque, model)
    if own < BAD:
        return
    picked = np.linspace(0, len(postures) - 1, min(POSES, len(postures))).astype(int)
    best, best_order = own, None
    for order in itertools.permutations(range(robot.n)):
        columns = list(order)
        poses = postures[picked][:, columns]
        sample = picked[:: max(1, len(picked) // 4)]
        rough = np.array([dynamics.bias(postures[k][columns], velocities[k][columns]) for k in sample])
        if _misfit(torque[sample][:, columns], rough) > 0.8 * best:
            continue
        wanted = np.array([dynamics.bias(q, velocities[k][columns]) for q, k in zip(poses, picked, strict=True)])
        misfit = _misfit(torque[picked][:, columns], wanted)
        if misfit < best:
            best, best_order = misfit, columns
    if best_order is not None and best < BETTER * own:
        places = ", ".join(
            f"joint {place + 1} ({robot.joints[place].name}) is in column {column + 1}"
            for place, column in enumerate(best_order)
            if place != column
        )
        raise InputError(f"{motions[0].name}: the columns are in another order: {places}")


def _check_torque(motions: Sequence[Motion], robot: Robot, torque: FloatArray, model: FloatArray) -> list[str]:
    """Sign and unit of each joint's torque."""
    said = []
    for joint, limits in enumerate(robot.joints):
        x, y = model[:, joint], torque[:, joint]
        size = math.sqrt(float((x**2).mean()))
        where = f"joint {joint + 1} ({limits.name})"
        if size < TELLING_NM:
            said.append(f"{where}: {size:.2f} Nm of model torque are too little to check sign and unit")
            continue
        slope = float(x @ y / (x @ x))
        fit = float(x @ y) / max(math.sqrt(float(x @ x) * float(y @ y)), 1e-12)
        if fit < -0.7:
            raise InputError(
                f"{motions[0].name}: {where}: its torque is minus the model's ({slope:.2f} times it): turn its sign"
            )
        if fit > 0.7 and not 0.4 < slope < 2.5:
            raise InputError(
                f"{motions[0].name}: {where}: its torque is {slope:.3g} times the model's: another unit, or a motor "
                "current?"
            )
        if fit < 0.5:
            raise InputError(
                f"{motions[0].name}: {where}: its torque does not follow the model ({size:.1f} Nm; correlation "
                f"{fit:.2f}): another joint, another robot, or a payload"
            )
        said.append(f"{where}: {slope:.2f} times the model's torque, correlation {fit:.2f}")
    return said
