"""Capsules for links whose file has none: sufficient for strikes in a simulation, not for planning."""

import numpy as np

from tauperp.robot.model import Capsule
from tauperp.robot.spatial import Array

DENSITY_KG_M3 = 1500.0  # of a light arm's link with its drive
RADIUS_M = (0.03, 0.08)
SHORTEST_M = 0.02


def volume(capsule: Capsule) -> float:
    """m^3"""
    length = float(np.linalg.norm(capsule.p1 - capsule.p0))
    return np.pi * capsule.radius**2 * (length + 4.0 / 3.0 * capsule.radius)


def automatic_capsule(mass: float, com: Array, end: Array) -> Capsule:
    """From the joint's origin to the next joint's (or the tip) at `end` (3,) m, as thick as its mass kg makes likely.

    Where the next joint is at the same point the link reaches through its centre of mass instead.
    """
    length = float(np.linalg.norm(end))
    if length < 2.0 * RADIUS_M[0] and np.linalg.norm(com) > 0.5 * length:
        end = 2.0 * com
        length = float(np.linalg.norm(end))
    if length < SHORTEST_M:
        end, length = np.array([0.0, 0.0, SHORTEST_M]), SHORTEST_M
    radius = np.clip(np.sqrt(mass / (DENSITY_KG_M3 * np.pi * length)), *RADIUS_M)
    return Capsule(np.zeros(3), np.array(end, dtype=float), float(radius))
