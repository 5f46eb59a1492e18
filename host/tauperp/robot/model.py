"""A serial arm of revolute joints as plain numbers: the result of every reader and the input of every user of a
robot."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tauperp.robot.limits import DEFAULT_POSITION_RAD, DEFAULT_TORQUE_NM, DEFAULT_VELOCITY_RAD_S
from tauperp.robot.spatial import Array

GRAVITY_M_S2 = 9.81
MAX_JOINTS = 8


class Capsule(NamedTuple):
    """Contact geometry of a link: the points within `radius` m of the segment p0 p1 (each (3,) m, joint frame)."""

    p0: Array
    p1: Array
    radius: float


@dataclass(frozen=True, eq=False)
class Joint:
    """A revolute joint and its child link. All values of the link are in the joint frame, which turns with the link."""

    name: str
    origin_rotation: Array  # (3, 3) of the joint frame in the parent joint's frame (first: in the base frame) at q = 0
    origin_position: Array  # (3,) m
    axis: Array  # (3,) unit
    mass: float  # kg
    com: Array  # (3,) m
    inertia: Array  # (3, 3) kg m^2 about the centre of mass
    position_min: float = -DEFAULT_POSITION_RAD
    position_max: float = DEFAULT_POSITION_RAD
    velocity_max: float = DEFAULT_VELOCITY_RAD_S
    torque_max: float = DEFAULT_TORQUE_NM
    rotor_inertia: float = (
        0.0  # kg m^2, reflected to the joint; on the motor side of the torque sensor, so not in the table
    )
    defaults: frozenset[str] = frozenset()  # of "position", "velocity", "torque": limits that the file does not have


@dataclass(frozen=True, eq=False)
class Source:
    """The source file of a robot and the part of it that was read, so that another reader can check it."""

    path: Path
    kind: str  # "urdf" or "mjcf"
    document: bytes  # MJCF: the file's; URDF: its links' inertials and joints, names with a prefix (tauperp.robot.urdf)
    base: str  # link
    tip: str  # link or site
    tool: Array  # (3,) m in the tip's frame
    mounting: Array  # (3, 3), the file's root frame in a world whose z points up
    accept_inertia: bool = False  # inertias that no body has were made possible


@dataclass(frozen=True, eq=False)
class Robot:
    name: str
    joints: tuple[Joint, ...]
    tip: Array  # (3,) m, the end-effector point in the last joint's frame
    gravity: Array  # (3,) m/s^2 in the base frame
    capsules: tuple[Capsule, ...]  # one per joint, in the joint's frame
    tip_rotation: Array = field(default_factory=lambda: np.eye(3))  # of the tip link in the last joint's frame
    source: Source | None = None
    note: str = ""  # source of the numbers
    warnings: tuple[str, ...] = ()  # changes and omissions, one line each

    @property
    def n(self) -> int:
        return len(self.joints)

    @property
    def mass(self) -> float:
        """Mass of everything that moves, kg."""
        return sum(joint.mass for joint in self.joints)

    @property
    def reach(self) -> float:
        """Length m of the chain of joint origins from the second joint to the tip: no point of it is farther."""
        steps = [joint.origin_position for joint in self.joints[2:]] + [self.tip]
        return float(sum(np.linalg.norm(step) for step in steps))
