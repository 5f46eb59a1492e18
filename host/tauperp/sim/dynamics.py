"""The robot controller's model of its arm: the nominal model, without payload and without the plant's errors."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from tauperp.robot import Robot
from tauperp.sim.model import PAYLOAD, TIP, build_spec

Vector = NDArray[np.float64]


class Dynamics:
    """Rigid-body terms of the nominal arm at a state. Calls do not depend on each other.

    Joint vectors (n,) in rad, rad/s, rad/s2, Nm; positions in the base frame, m. The inertia includes the rotors,
    because the motors must accelerate them, too.
    """

    def __init__(self, robot: Robot) -> None:
        self.n = robot.n
        self._model = build_spec(robot, timestep_s=1e-3).compile()
        self._model.body_mass[self._model.body(PAYLOAD).id] = 0.0
        self._model.body_inertia[self._model.body(PAYLOAD).id] = 0.0
        self._data = mujoco.MjData(self._model)
        self._tip = self._model.site(TIP).id

    def inverse(self, position: Vector, velocity: Vector, acceleration: Vector) -> Vector:
        """Motor torque for this acceleration."""
        data = self._data
        data.qpos[:], data.qvel[:], data.qacc[:] = position, velocity, acceleration
        mujoco.mj_inverse(self._model, data)
        return data.qfrc_inverse.copy()

    def bias(self, position: Vector, velocity: Vector) -> Vector:
        """Coriolis, centrifugal and gravity torque."""
        self._place(position)
        self._data.qvel[:] = velocity
        mujoco.mj_fwdVelocity(self._model, self._data)
        return self._data.qfrc_bias.copy()

    def inertia(self, position: Vector) -> Vector:
        """Joint-space inertia (n, n) kg m2, rotors included."""
        self._place(position)
        inertia = np.empty((self.n, self.n))
        mujoco.mj_fullM(self._model, self._data, inertia)
        return inertia

    def tip(self, position: Vector) -> tuple[Vector, Vector]:
        """End-effector point (3,) and orientation (3, 3), columns its axes."""
        self._place(position)
        return self._data.site_xpos[self._tip].copy(), self._data.site_xmat[self._tip].reshape(3, 3).copy()

    def jacobian(self, position: Vector) -> Vector:
        """Of the end-effector point, (6, n): rows linear m/rad, then angular rad/rad."""
        self._place(position)
        jacobian = np.empty((6, self.n))
        mujoco.mj_jacSite(self._model, self._data, jacobian[:3], jacobian[3:], self._tip)
        return jacobian

    def _place(self, position: Vector) -> None:
        self._data.qpos[:] = position
        mujoco.mj_fwdPosition(self._model, self._data)


def rotation_vector(rotation: Vector) -> Vector:
    """Axis times angle (3,) rad of a rotation matrix (3, 3), angle in [0, pi]."""
    quat, turn = np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(rotation).ravel())
    mujoco.mju_quat2Vel(turn, quat, 1.0)
    return turn
