"""Start posture of an arm if the scenario has none: elbow bent, hand in front, far from every singular posture."""

import numpy as np
from numpy.typing import NDArray

from tauperp.robot import Robot
from tauperp.sim.dynamics import Dynamics

HOMES: dict[str, tuple[float, ...]] = {
    "ku_dex": (0.0, 0.4, 0.0, 1.5, 0.0, 1.0, 0.0),
    "panda": (0.0, -0.4, 0.0, -2.1, 0.0, 1.7, 0.8),
    "panda_bare": (0.0, -0.4, 0.0, -2.1, 0.0, 1.7, 0.8),
    "iiwa7": (0.0, 0.5, 0.0, -1.5, 0.0, 1.0, 0.0),
    "kinova3": (0.0, 0.4, 0.0, 1.6, 0.0, 1.0, 0.0),
}
TRIES = 300
SEED = 7  # seed of the search, so that the same arm always starts in the same posture
CLEAR_M = 0.15  # of the tip above the base


def home(robot: Robot, dynamics: Dynamics) -> NDArray[np.float64]:
    """Joints (n,) rad: of a shipped robot its own, else the best conditioned of some random ones in mid-range."""
    return postures(robot, dynamics)[0]


def postures(robot: Robot, dynamics: Dynamics, count: int = 12) -> list[NDArray[np.float64]]:
    """Up to `count` start postures (n,) rad, the best first: `home`, then other random ones in mid-range."""
    low = np.array([joint.position_min for joint in robot.joints])
    high = np.array([joint.position_max for joint in robot.joints])
    middle, half = (low + high) / 2, np.minimum((high - low) / 2, np.pi / 2)
    rng = np.random.default_rng(SEED)
    up = -robot.gravity / np.linalg.norm(robot.gravity)
    found: list[tuple[float, NDArray[np.float64]]] = []
    for _ in range(TRIES):
        joints = middle + 0.8 * half * rng.uniform(-1, 1, robot.n)
        smallest = float(np.linalg.svd(dynamics.jacobian(joints), compute_uv=False)[-1])
        if dynamics.tip(joints)[0] @ up > CLEAR_M:
            found.append((smallest, joints))
    found.sort(key=lambda one: -one[0])
    best = [joints for _, joints in found[:count]] or [middle]
    known = HOMES.get(robot.name)
    return [np.array(known), *best] if known is not None and len(known) == robot.n else best
