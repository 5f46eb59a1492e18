"""Detects a simulation that is no longer physical: divergence or chatter must not count as a fault detected by the
guard.

All motion of a controlled arm is slow. Its control laws have bandwidths of a few hertz, and even a
hand's tissue oscillates below 150 Hz. If a joint's acceleration changes sign every few milliseconds, with a size that
no drive can sustain, the integration fails. The most frequent cause is a joint with too little inertia for the control
cycle. Touched or braked arms are not checked, because contact and dry friction may chatter.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from tauperp.sim.arm import Arm

WINDOW_S = 0.1
FLIPS_HZ = 200.0  # changes of sign of the acceleration, of an oscillation of 100 Hz and more
ROUGH_RAD_S2 = 20.0  # median size of the acceleration below which this is harmless
WILD_SPEEDS = 20.0  # factor of a joint's largest speed above which it diverges


class Stability:
    """Checks one arm, one cycle at a time."""

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self._rows = max(8, round(WINDOW_S / arm.period_s))
        self._speed_max = np.array([joint.velocity_max for joint in arm.robot.joints])
        self._before = np.zeros(arm.n)
        self._steps = np.zeros((self._rows, arm.n))
        self._count = 0

    def look(self, velocity: NDArray[np.float64], *, alone: bool) -> str | None:
        """The error in this cycle's joint velocities (n,), or None.

        `alone`: nobody touches the arm, and no brake is on.
        """
        if self._arm.data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(velocity).all():
            return "its numbers are no longer finite"
        wild = np.abs(velocity) > WILD_SPEEDS * self._speed_max
        if wild.any():
            joint = int(np.argmax(wild))
            return f"joint {joint + 1} runs away: {abs(float(velocity[joint])):.0f} rad/s"
        step, self._before = velocity - self._before, velocity
        if not alone:
            self._count = 0
            return None
        self._steps[self._count % self._rows] = step
        self._count += 1
        if self._count < self._rows or self._count % (self._rows // 4):
            return None
        return self._chatter(np.roll(self._steps, -(self._count % self._rows), axis=0))

    def _chatter(self, steps: NDArray[np.float64]) -> str | None:
        period_s = self._arm.period_s
        flips = (np.sign(steps[1:]) != np.sign(steps[:-1])).sum(axis=0) / (self._rows * period_s)
        rough = np.median(np.abs(steps), axis=0) / period_s
        bad = (flips >= FLIPS_HZ) & (rough >= ROUGH_RAD_S2)
        if not bad.any():
            return None
        joint = int(np.argmax(np.where(bad, rough, 0.0)))
        return (
            f"joint {joint + 1} oscillates from cycle to cycle ({flips[joint]:.0f} changes of acceleration a second, "
            f"{rough[joint]:.0f} rad/s2)"
        )
