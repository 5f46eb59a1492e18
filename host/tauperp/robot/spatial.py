"""Rigid placements and rigid-body inertia, in float64 numpy."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Z_AXIS: Array = np.array([0.0, 0.0, 1.0])


def skew(v: Array) -> Array:
    """The (3, 3) matrix S with S @ x = v x x."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def rotation_x(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_about(axis: Array, angle: float) -> Array:
    """Rotation by `angle` rad about the unit vector `axis` (Rodrigues)."""
    s = skew(axis)
    return np.eye(3) + np.sin(angle) * s + (1.0 - np.cos(angle)) * (s @ s)


def rotation_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll), rad: the convention of URDF."""
    c, s = np.cos(pitch), np.sin(pitch)
    about_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return rotation_z(yaw) @ about_y @ rotation_x(roll)


def rotation_quaternion(quaternion: Array) -> Array:
    """Rotation of the quaternion (w, x, y, z) of any length but zero."""
    w, v = quaternion[0], np.asarray(quaternion[1:], dtype=float)
    s = skew(v)
    return np.eye(3) + 2.0 * (w * s + s @ s) / float(np.dot(quaternion, quaternion))


def rotation_onto(axis: Array) -> Array:
    """A rotation whose third column is the unit vector `axis`: the identity for z, the shortest turn else."""
    if axis[2] < -1.0 + 1e-12:
        return rotation_x(np.pi)
    v = np.cross(Z_AXIS, axis)
    s = skew(v)
    return np.eye(3) + s + (s @ s) / (1.0 + axis[2])


@dataclass(frozen=True)
class Pose:
    """A frame in its parent frame: x_parent = rotation @ x + position."""

    rotation: Array = field(default_factory=lambda: np.eye(3))
    position: Array = field(default_factory=lambda: np.zeros(3))

    def __matmul__(self, other: "Pose") -> "Pose":
        return Pose(self.rotation @ other.rotation, self.rotation @ other.position + self.position)

    def point(self, p: Array) -> Array:
        return self.rotation @ p + self.position


@dataclass(frozen=True)
class Body:
    """Mass kg, centre of mass (3,) m, inertia (3, 3) kg m^2 about the centre of mass in the axes of the frame."""

    mass: float = 0.0
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def moved(self, pose: Pose) -> "Body":
        """The same body in the parent frame of `pose`."""
        return Body(self.mass, pose.point(self.com), pose.rotation @ self.inertia @ pose.rotation.T)

    def inertia_about(self, point: Array) -> Array:
        """Inertia (3, 3) about another point of the frame (Steiner)."""
        s = skew(self.com - point)
        return self.inertia - self.mass * (s @ s)


def merged(bodies: Iterable[Body]) -> Body:
    """Several bodies of one frame as one."""
    parts = [body for body in bodies if body.mass > 0.0]
    mass = sum(body.mass for body in parts)
    if not parts:
        return Body()
    if len(parts) == 1:
        return parts[0]
    com = np.sum([body.mass * body.com for body in parts], axis=0) / mass
    return Body(mass, com, np.sum([body.inertia_about(com) for body in parts], axis=0))
