"""The firmware's pass over a robot table in float64: what the table means, to be compared with other readers.

The same steps as firmware/core/motion.c and in the same frames; every vector of link i is in frame i of the table.
"""

from dataclasses import dataclass

import numpy as np

from tauperp.robot.spatial import Z_AXIS, Array, rotation_z
from tauperp.robot.table import RobotTable


@dataclass(frozen=True, eq=False)
class Terms:
    """momentum M qd, coriolis C^T qd, gravity torque: (n,); jacobian (6, n) of the tip, rows [linear; angular], in
    the base frame."""

    momentum: Array
    coriolis: Array
    gravity: Array
    jacobian: Array


def walk(table: RobotTable, q: Array, qd: Array) -> Terms:
    """Terms of a table at q, qd, both (n,), rad and rad/s."""
    n = table.joint_count
    turn = [_turn(table, i, q[i]) for i in range(n)]

    w, v = np.zeros(3), np.zeros(3)
    angular, linear, down = [], [], []
    gravity = table.gravity
    orientation, origin = np.eye(3), np.zeros(3)
    axes, origins = [], []
    for i, joint in enumerate(table.joint):
        v = turn[i].T @ (v + np.cross(w, joint.offset))
        w = turn[i].T @ w + qd[i] * Z_AXIS
        gravity = turn[i].T @ gravity
        angular.append(w)
        linear.append(v)
        down.append(gravity)
        origin = origin + orientation @ joint.offset
        orientation = orientation @ turn[i]
        origins.append(origin)
        axes.append(orientation[:, 2])
    tip = origin + orientation @ table.tip
    jacobian = np.array([np.concatenate([np.cross(z, tip - o), z]) for z, o in zip(axes, origins, strict=True)]).T

    momentum, coriolis, torque = np.zeros(n), np.zeros(n), np.zeros(n)
    p, l, s = np.zeros(3), np.zeros(3), np.zeros(3)  # composite momenta and first moment about o_i of what has no mass
    for i in reversed(range(n)):
        joint = table.joint[i]
        h = np.array([joint.moment_x, joint.moment_y, 0.0])
        inertia = np.array(
            [
                [joint.inertia_xx, joint.inertia_xy, joint.inertia_xz],
                [joint.inertia_xy, 0.0, joint.inertia_yz],
                [joint.inertia_xz, joint.inertia_yz, joint.inertia_zz],
            ]
        )
        p = p + np.cross(angular[i], h)
        l = l + inertia @ angular[i] + np.cross(h, linear[i])
        s = s + h
        momentum[i] = l[2]
        coriolis[i] = l @ np.cross(angular[i], Z_AXIS) + p @ np.cross(linear[i], Z_AXIS)
        torque[i] = -np.cross(Z_AXIS, s) @ down[i]
        p, l, s = turn[i] @ p, turn[i] @ l, turn[i] @ s
        l = l + np.cross(joint.offset, p)
    return Terms(momentum, coriolis, torque, jacobian)


def _turn(table: RobotTable, i: int, q: float) -> Array:
    """Rotation of frame i in frame i-1, of frame 0 in the base frame."""
    joint = table.joint[i]
    c, s = joint.cos_twist, joint.sin_twist
    twist = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    fixed = table.base if i == 0 else twist
    return fixed @ rotation_z(q + joint.zero_rad)
