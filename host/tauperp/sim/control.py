"""Control laws: motor torque from a desired motion and the measured joints, with the nominal model.

Neither law knows the payload. Position control is stiff enough to carry an unknown one.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauperp.sim.dynamics import Dynamics, rotation_vector

Vector = NDArray[np.float64]

BANDWIDTH_RAD_S = 40.0  # of the position controller


class ComputedTorque:
    """Computed torque with a PID on the joint error: three equal poles at `bandwidth_rad_s`.

    The integral carries an unknown payload. While it is frozen the law is a PD about the integral's last value: an arm
    that was stopped by a person then does not push harder and harder.
    """

    def __init__(self, dynamics: Dynamics, period_s: float, bandwidth_rad_s: float = BANDWIDTH_RAD_S) -> None:
        self._dynamics = dynamics
        self._period = period_s
        self._kp, self._kd, self._ki = (3 * bandwidth_rad_s**2, 3 * bandwidth_rad_s, bandwidth_rad_s**3)
        self._integral = np.zeros(dynamics.n)

    def reset(self) -> None:
        """Clear the integral, because another law was active since."""
        self._integral[:] = 0.0

    def torque(
        self, position: Vector, velocity: Vector, reference: tuple[Vector, Vector, Vector], *, learn: bool = True
    ) -> Vector:
        """Motor torque (n,) Nm towards the `reference` position, velocity and acceleration, (n,) each."""
        wanted, wanted_velocity, wanted_acceleration = reference
        error = wanted - position
        if learn:
            self._integral += self._period * error
        pid = self._kp * error + self._kd * (wanted_velocity - velocity) + self._ki * self._integral
        return self._dynamics.inverse(position, velocity, wanted_acceleration + pid)


@dataclass(frozen=True)
class ImpedanceGains:
    """A spring and damper between the end-effector and its goal; soft joints in the remaining directions."""

    stiffness_n_m: float = 500.0
    stiffness_nm_rad: float = 50.0
    damping_ratio: float = 1.0
    posture_nm_rad: float = 20.0


class Impedance:
    """Cartesian impedance without inertia shaping: tau = bias + J^T (K error - D twist) + null-space spring and damper.

    It holds its start pose. `posture` (n,) rad is the rest posture of the null space.
    """

    def __init__(self, dynamics: Dynamics, gains: ImpedanceGains, position: Vector, posture: Vector) -> None:
        self._dynamics = dynamics
        self._gains = gains
        self._posture = posture
        self._stiffness = np.array([gains.stiffness_n_m] * 3 + [gains.stiffness_nm_rad] * 3)
        inertia = dynamics.inertia(position)
        jacobian = dynamics.jacobian(position)
        felt = np.diag(jacobian @ np.linalg.solve(inertia, jacobian.T))
        self._damping = 2 * gains.damping_ratio * np.sqrt(self._stiffness / np.maximum(felt, 1e-3))
        self._posture_damping = 2 * gains.damping_ratio * np.sqrt(gains.posture_nm_rad * np.diag(inertia))
        self.start_m, _ = dynamics.tip(position)

    def torque(self, position: Vector, velocity: Vector, goal_m: Vector, goal_rotation: Vector) -> Vector:
        """Motor torque (n,) Nm towards the pose `goal_m` (3,), `goal_rotation` (3, 3) at rest."""
        tip, rotation = self._dynamics.tip(position)
        jacobian = self._dynamics.jacobian(position)
        error = np.concatenate([goal_m - tip, rotation @ rotation_vector(rotation.T @ goal_rotation)])
        wrench = self._stiffness * error - self._damping * (jacobian @ velocity)
        free = self._gains.posture_nm_rad * (self._posture - position) - self._posture_damping * velocity
        _, sigma, vt = np.linalg.svd(jacobian, full_matrices=False)
        task = vt[sigma > 1e-2 * sigma[0]]
        return self._dynamics.bias(position, velocity) + jacobian.T @ wrench + free - task.T @ (task @ free)


def blend(start: Vector, goal: Vector, phase: float) -> Vector:
    """Smooth interpolation between two vectors: `phase` from 0 to 1, at rest at both ends."""
    u = min(max(phase, 0.0), 1.0)
    return start + (goal - start) * (0.5 - 0.5 * math.cos(math.pi * u))
