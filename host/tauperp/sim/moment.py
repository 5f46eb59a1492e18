"""One cycle for viewers, simulated or recorded."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from tauperp.robot import Robot
from tauperp.sim.model import build_spec


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The arm's joints are the first n of the model's. Torques Nm, (n,) each.

    Model, data and arrays belong to the producer and change with every cycle.
    """

    time_s: float
    model: mujoco.MjModel
    data: mujoco.MjData
    permitted: bool
    tripped_joint: int  # 1 to n, of the latched trip; 0: none
    residual: NDArray[np.float64]  # r
    index: NDArray[np.float64]  # the index of the active task
    threshold: NDArray[np.float64]
    contact_n: float  # force of all contacts on the arm
    torque: NDArray[np.float64] | None = None  # (n,) as measured, Nm; None: not known
    unusable: NDArray[np.bool_] | None = None  # (n,) readings that are missing, invalid, out of range; None: unknown


Watch = Callable[[Moment], None]


class Puppet:
    """An arm without physics: it stays in the given pose."""

    def __init__(self, robot: Robot) -> None:
        self.model = build_spec(robot, timestep_s=1e-3).compile()
        self.data = mujoco.MjData(self.model)
        self._n = robot.n

    def pose(self, position: NDArray[np.float64], time_s: float) -> None:
        """Joints at `position` (n,) rad."""
        self.data.qpos[: self._n] = position
        self.data.time = time_s
        mujoco.mj_kinematics(self.model, self.data)
