"""Inertias that no body can have: the size of the error, the part that can be ignored, and the nearest possible
inertia."""

import numpy as np

from tauperp.robot.spatial import Array

# Files round inertias to six decimals of kg m^2 or to three digits. 1e-5 kg m^2 at 10 rad/s^2 is 1e-4 Nm, a hundredth
# of the wire's torque step; a thousandth of what the joint moves is below every error of a real arm's model.
INERTIA_ABSOLUTE = 1e-5
INERTIA_RELATIVE = 1e-3

# Beyond these no arm is meant, and products of the numbers leave float64.
MASS_MAX_KG = 1e6
LENGTH_MAX_M = 1e4
INERTIA_MAX_KG_M2 = 1e8


def slack(moved: Array) -> float:
    """Allowed error of an inertia, kg m^2, in a joint that moves the total inertia `moved` (3, 3)."""
    return INERTIA_ABSOLUTE + INERTIA_RELATIVE * float(np.max(np.abs(np.linalg.eigvalsh(moved))))


def moments(inertia: Array) -> tuple[float, float, float]:
    """Principal moments, ascending, kg m^2."""
    small, middle, large = (float(moment) for moment in np.linalg.eigvalsh(inertia))
    return small, middle, large


def excess(inertia: Array) -> tuple[float, str]:
    """The largest violation of a rule by an inertia (3, 3), kg m^2, and that rule; 0 for the inertia of a body."""
    small, middle, large = moments(inertia)
    negative, unequal = max(-small, 0.0), max(large - small - middle, 0.0)
    if negative > 0.0:
        return max(negative, unequal), "is not positive definite"
    return unequal, "breaks the triangle inequality"


def possible(inertia: Array) -> Array:
    """The nearest inertia of a distribution of mass: negative second moments of mass become zero."""
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    values, vectors = np.linalg.eigh(second)
    second = (vectors * np.maximum(values, 0.0)) @ vectors.T
    nearest: Array = np.trace(second) * np.eye(3) - second
    return nearest
