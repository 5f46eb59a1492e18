"""How well recordings cover the motions of an arm, and a list of what they do not cover.

Thresholds hold only for motion like that in the recordings. A bank that was calibrated on seven seconds of one motion
was above its thresholds 5 to 51 % of the time in another motion.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tauperp.calibrate.sources import Motion
from tauperp.robot import Robot

SPEED_SHARES = (0.05, 0.15, 0.3, 0.6, 1.0)  # of a joint's limit: edges of the bands that a motion should fill
SHORTEST_S = 0.5  # in a band that counts as covered
POSE_BINS = 10
FEWEST_REVERSALS = 5
RANGE_WANTED = 0.3  # of a joint's range
MOVING_RAD_S = 0.02
ACCELERATION_TIME_S = 0.25  # acceleration to a joint's full speed by a fast robot


def coverage(motions: Sequence[Motion], robot: Robot) -> dict[str, Any]:
    """Speed, acceleration, reversals and range of each joint. `missing`: sentences for the report."""
    joints: list[dict[str, Any]] = []
    missing: list[str] = []
    for joint, limits in enumerate(robot.joints):
        top = limits.velocity_max
        seconds = np.zeros(len(SPEED_SHARES))
        bins: set[int] = set()
        reversals, fastest, strongest = 0, 0.0, 0.0
        lowest, highest = np.inf, -np.inf
        for motion in motions:
            period_s = motion.period_us * 1e-6
            speed, angle = motion.qd[:, joint], motion.q[:, joint]
            share = np.abs(speed) / top
            band = np.clip(np.digitize(share, SPEED_SHARES), 0, len(SPEED_SHARES) - 1)
            seconds += period_s * np.bincount(band, minlength=len(SPEED_SHARES))
            moving = np.sign(speed[np.abs(speed) > MOVING_RAD_S])
            reversals += int((np.diff(moving) != 0).sum())
            fastest = max(fastest, float(np.abs(speed).max()))
            strongest = max(strongest, _acceleration(speed, period_s))
            lowest, highest = min(lowest, float(angle.min())), max(highest, float(angle.max()))
            span = limits.position_max - limits.position_min
            place = (angle - limits.position_min) / span * POSE_BINS
            bins |= set(np.clip(place.astype(int), 0, POSE_BINS - 1).tolist())
        name = f"joint {joint + 1} ({limits.name})"
        span = limits.position_max - limits.position_min
        range_share = (highest - lowest) / span
        one: dict[str, Any] = {
            "joint": joint + 1,
            "fastest_rad_s": round(fastest, 3),
            "fastest_share": round(fastest / top, 3),
            "acceleration_rad_s2": round(strongest, 2),
            "seconds_in_speed_band": [round(float(value), 1) for value in seconds],
            "reversals": reversals,
            "range_rad": [round(lowest, 3), round(highest, 3)],
            "range_share": round(range_share, 3),
            "pose_bins": len(bins),
        }
        joints.append(one)
        empty = [band for band in range(1, len(SPEED_SHARES)) if seconds[band] < SHORTEST_S]
        if empty:
            first = SPEED_SHARES[empty[0] - 1]
            missing.append(f"{name}: speed above {100 * first:.0f} % of its {top:.2f} rad/s")
        if strongest < 0.3 * top / ACCELERATION_TIME_S:
            missing.append(f"{name}: acceleration above {strongest:.1f} rad/s2")
        if reversals < FEWEST_REVERSALS:
            missing.append(f"{name}: reversals ({reversals} seen)")
        if range_share < RANGE_WANTED:
            missing.append(
                f"{name}: poses outside {lowest:.2f} to {highest:.2f} rad, {100 * range_share:.0f} % of its range"
            )
    return {"speed_bands": list(SPEED_SHARES), "joints": joints, "missing": missing}


def _acceleration(speed: np.ndarray, period_s: float) -> float:
    """The 99th percentile of |acceleration| over 50 ms, rad/s2: less than that is velocity noise."""
    step = max(1, round(0.05 / period_s))
    if len(speed) <= step:
        return 0.0
    return float(np.quantile(np.abs(speed[step:] - speed[:-step]) / (step * period_s), 0.99))
