"""The intended force of a person who guides the end-effector: an applied wrench, smooth in time."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from tauperp.sim.arm import Arm


@dataclass(frozen=True)
class GuidingForce:
    """Force N and moment Nm on the robot at the end-effector point, base frame, (3,) each.

    It starts at `start_s`, rises over `rise_s`, stays for `hold_s` and falls over `rise_s`, as half cosines.
    """

    force_n: tuple[float, float, float]
    moment_nm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_s: float = 0.0
    rise_s: float = 0.5
    hold_s: float = 1.0

    def share(self, time_s: float) -> float:
        """Factor of the force, 0 to 1, `time_s` after the reference time of `start_s`."""
        since = time_s - self.start_s
        left = 2 * self.rise_s + self.hold_s - since
        if since <= 0 or left <= 0:
            return 0.0
        return 0.5 - 0.5 * math.cos(math.pi * min(since / self.rise_s, left / self.rise_s, 1.0))

    def over(self, time_s: float) -> bool:
        """Whether it has ended permanently."""
        return time_s >= self.start_s + 2 * self.rise_s + self.hold_s


class Guidance:
    """Applies guiding forces, any number at a time. `force_n` (3,) is the current force."""

    def __init__(self) -> None:
        self._forces: tuple[tuple[float, GuidingForce], ...] = ()
        self.force_n = np.zeros(3)

    def start(self, forces: tuple[GuidingForce, ...], time_s: float) -> None:
        """Add `forces`, with times relative to `time_s`. Removes forces that are over."""
        running = [one for one in self._forces if not one[1].over(time_s - one[0])]
        self._forces = (*running, *((time_s, force) for force in forces))

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Nothing to add, because a force needs no body."""

    def before_step(self, arm: Arm, time_s: float) -> None:
        """Set the wrench for this step."""
        if not self._forces:
            return
        force, moment = np.zeros(3), np.zeros(3)
        for start_s, one in self._forces:
            share = one.share(time_s - start_s)
            force += share * np.array(one.force_n)
            moment += share * np.array(one.moment_nm)
        self.force_n = force
        arm.push_tip(force, moment)

    def after_step(self, arm: Arm, time_s: float) -> None:
        """Nothing to read."""
