"""Rotor inertia of a simulated arm whose description has none.

URDF cannot state a rotor's inertia, and an arm without rotors is not realistic: through a gear of 1:100 the rotor is as
heavy as the link, or heavier. A wrist without it is so light that a controller at 1 kHz cannot hold it steady. Unknown
values are estimated from the joint's effort and the inertia that it carries. RATE is the acceleration that drives of
the shipped arms reach with their own rotor (80 to 250 rad/s2). The bounds prevent an unrealistic rotor if the effort is
only a placeholder.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tauperp.robot import Robot
from tauperp.sim.dynamics import Dynamics

RATE_RAD_S2 = 150.0  # largest torque over rotor inertia
LINK_SHARE = (0.05, 3.0)  # of the carried inertia, at least and at most
SPARE_KG_M2 = 0.15  # a second upper bound: a wrist's drive is heavier than its load
POSTURES = 32
SEED = 3


def with_rotors(robot: Robot, given: Sequence[float] | None = None) -> tuple[Robot, str | None]:
    """The robot with rotor inertia on every joint, and a line that states the estimates; None if nothing was estimated.

    given   (n,) kg m2 reflected to the joint, instead of the description's; 0 is also estimated
    """
    known = np.array([joint.rotor_inertia for joint in robot.joints] if given is None else given, float)
    missing = known <= 0.0
    if not missing.any():
        return _changed(robot, known), None
    estimate = np.where(missing, estimated_rotors(robot), known)
    values = ", ".join(f"{value:.2g}" for value in estimate)
    which = "" if missing.all() else " of " + ", ".join(robot.joints[at].name for at in np.flatnonzero(missing))
    note = f"rotor inertia{which} is not given: estimated from effort and link inertia as {values} kg m2"
    return _changed(robot, estimate), note


def estimated_rotors(robot: Robot) -> NDArray[np.float64]:
    """A typical reflected rotor inertia, (n,) kg m2."""
    bare = _changed(robot, np.zeros(robot.n))
    dynamics, rng = Dynamics(bare), np.random.default_rng(SEED)
    low = np.array([joint.position_min for joint in robot.joints])
    high = np.array([joint.position_max for joint in robot.joints])
    postures = rng.uniform(low, high, (POSTURES, robot.n))
    carried = np.median([np.diag(dynamics.inertia(posture)) for posture in postures], axis=0)
    effort = np.array([joint.torque_max for joint in robot.joints])
    return np.clip(effort / RATE_RAD_S2, LINK_SHARE[0] * carried, LINK_SHARE[1] * carried + SPARE_KG_M2)


def _changed(robot: Robot, rotors: NDArray[np.float64]) -> Robot:
    joints = tuple(
        replace(joint, rotor_inertia=float(rotor)) for joint, rotor in zip(robot.joints, rotors, strict=True)
    )
    return replace(robot, joints=joints)
