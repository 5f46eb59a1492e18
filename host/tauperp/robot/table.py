"""The firmware's table of a robot (firmware/core/robot.h): minimal frames, minimal inertial parameters.

Frames: z is on the joint axis. The origin is the point of the axis that is nearest to the previous axis, so axes that
intersect share one origin and need no translation. x is chosen so that a rotation about x alone leads to the next axis.
Between nearly parallel axes the nearest points are far away: there the origin stays at its place in the file. The
rotation between two z-aligned frames is Rz(a) Rx(twist) Rz(b): a rotates the parent's frame, b becomes this joint's
`zero`.

Inertial parameters: from the tip to the base, a part of every link moves to its parent (Gautier and Khalil 1990): a rod
on the joint axis with mass m, first moment m z and inertia diag(l, l, 0) about the frame's origin, with l the link's
inertia yy. Such a rod has the same effect whether or not it rotates with the joint. Seven numbers per link remain.
"""

from dataclasses import dataclass

import numpy as np

from tauperp.robot.model import Robot
from tauperp.robot.spatial import Array, Body, rotation_onto, rotation_x, rotation_z

# Only rounding errors of a right angle or a zero are removed. A twist with ten digits in the file is not changed,
# because the table must agree with other readers of the same file to 1e-9.
SNAP = 1e-12
NAME_LENGTH = 16  # ROBOT_NAME_LENGTH
# Smallest sine of the angle between two axes for which an origin moves to the nearest point, and its largest shift, m.
SKEW = 0.01
REACH = 2.0


@dataclass(frozen=True, eq=False)
class TableJoint:
    """robot_joint_t, field by field."""

    offset: Array  # (3,)
    cos_twist: float
    sin_twist: float
    zero_rad: float
    moment_x: float
    moment_y: float
    inertia_xx: float
    inertia_xy: float
    inertia_xz: float
    inertia_yz: float
    inertia_zz: float
    position_min_rad: float
    position_max_rad: float
    velocity_max_rad_s: float
    torque_max_nm: float


@dataclass(frozen=True, eq=False)
class RobotTable:
    """robot_t, field by field; only the joints that are there."""

    name: str
    joint_count: int
    base: Array  # (3, 3)
    gravity: Array  # (3,)
    tip: Array  # (3,)
    tool: Array  # (3, 3) of the tip link in the last joint's frame; not in robot_t
    middle: Array  # (n, 3) of each link's capsule; in lever_config_t
    half_m: Array  # (n,) its half length, as a standard deviation of a point on it from the middle; in lever_config_t
    joint: tuple[TableJoint, ...]


def make_table(robot: Robot) -> RobotTable:
    n = robot.n
    # Frames with z on the axis: frame i is the joint's frame turned by align[i].
    align = [rotation_onto(joint.axis) for joint in robot.joints]
    before = [np.eye(3), *align[:-1]]
    rotation = [before[i].T @ robot.joints[i].origin_rotation @ align[i] for i in range(n)]
    offset = [before[i].T @ robot.joints[i].origin_position for i in range(n)]
    slide = _slides(rotation, offset)
    z = np.array([0.0, 0.0, 1.0])
    offset = [offset[i] + slide[i] * rotation[i][:, 2] - (slide[i - 1] * z if i > 0 else np.zeros(3)) for i in range(n)]

    # Frame i of the table is that frame rotated about its z by turn[i], so that the next twist is about x. The loop
    # starts at the tip, because the base's rotation can take up any remainder.
    turn, twist, zero = [0.0] * n, [0.0] * n, [0.0] * n
    for i in reversed(range(1, n)):
        turn[i - 1], twist[i], zero[i] = _turn_twist_zero(rotation[i], turn[i])
    base = _clean(rotation[0] @ rotation_z(turn[0]))
    offset = [np.zeros(3)] + [_clean(rotation_z(-turn[i - 1]) @ offset[i]) for i in range(1, n)]
    to_table = [(align[i] @ rotation_z(turn[i])).T for i in range(n)]  # from the robot's joint frames

    moment, inertia = _minimal_parameters(robot, to_table, slide, twist, offset)
    joints = tuple(
        TableJoint(
            offset=offset[i],
            cos_twist=_snapped(np.cos(twist[i])),
            sin_twist=_snapped(np.sin(twist[i])),
            zero_rad=zero[i],
            moment_x=float(moment[i][0]),
            moment_y=float(moment[i][1]),
            inertia_xx=float(inertia[i][0, 0]),
            inertia_xy=float(inertia[i][0, 1]),
            inertia_xz=float(inertia[i][0, 2]),
            inertia_yz=float(inertia[i][1, 2]),
            inertia_zz=float(inertia[i][2, 2]),
            position_min_rad=robot.joints[i].position_min,
            position_max_rad=robot.joints[i].position_max,
            velocity_max_rad_s=robot.joints[i].velocity_max,
            torque_max_nm=robot.joints[i].torque_max,
        )
        for i in range(n)
    )
    return RobotTable(
        name=robot.name[:NAME_LENGTH],
        joint_count=n,
        base=base,
        gravity=_clean(robot.gravity),
        tip=_clean(to_table[-1] @ robot.tip - slide[-1] * z),
        tool=_clean(to_table[-1] @ robot.tip_rotation),
        middle=np.array([_clean(to_table[i] @ _middle(robot, i) - slide[i] * z) for i in range(n)]),
        half_m=np.array([_spread(robot, i) for i in range(n)]),
        joint=joints,
    )


def _middle(robot: Robot, link: int) -> Array:
    shape = robot.capsules[link]
    middle: Array = (shape.p0 + shape.p1) / 2
    return middle


def _spread(robot: Robot, link: int) -> float:
    """Of points on a link's surface about its middle, m: evenly spread along the axis, and one radius off it."""
    shape = robot.capsules[link]
    along = shape.p1 - shape.p0
    return float(np.sqrt(along @ along / 12 + shape.radius**2 / 2))


def _slides(rotation: list[Array], offset: list[Array]) -> list[float]:
    """Shift of each origin along its own axis, m, to the point that is nearest to the previous axis."""
    slide = [0.0] * len(offset)
    for i in range(1, len(offset)):
        across, axis = offset[i][:2], rotation[i][:2, 2]
        square = float(axis @ axis)
        if square > SKEW**2 and abs(across @ axis) < REACH * square:
            slide[i] = -float(across @ axis) / square
    if len(offset) > 1 and np.hypot(*rotation[1][:2, 2]) > SKEW:
        # The first axis has no previous one: its origin gets the height of the second one's.
        height = float(offset[1][2] + slide[1] * rotation[1][2, 2])
        slide[0] = height if abs(height) < REACH else 0.0
    return slide


def _minimal_parameters(
    robot: Robot, to_table: list[Array], slide: list[float], twist: list[float], offset: list[Array]
) -> tuple[list[Array], list[Array]]:
    """First moments (3,) and inertias (3, 3) about the frames' origins, without the rods moved to the parents."""
    n = robot.n
    mass = [joint.mass for joint in robot.joints]
    moment = [to_table[i] @ (joint.mass * (joint.com - slide[i] * joint.axis)) for i, joint in enumerate(robot.joints)]
    inertia = [
        to_table[i] @ Body(joint.mass, joint.com, joint.inertia).inertia_about(slide[i] * joint.axis) @ to_table[i].T
        for i, joint in enumerate(robot.joints)
    ]
    for i in reversed(range(n)):
        rod_moment, rod_inertia = moment[i][2], inertia[i][1, 1]
        moment[i] = _clean(moment[i] * (1.0, 1.0, 0.0))
        inertia[i] = _clean(inertia[i] - np.diag([rod_inertia, rod_inertia, 0.0]))
        if i == 0:
            break  # the base does not move, so its part has no effect
        turn, p, m = rotation_x(twist[i]), offset[i], mass[i]
        h = turn @ (0.0, 0.0, rod_moment)
        shift = (2.0 * h @ p + m * p @ p) * np.eye(3) - np.outer(h, p) - np.outer(p, h) - m * np.outer(p, p)
        mass[i - 1] += m
        moment[i - 1] = moment[i - 1] + h + m * p
        inertia[i - 1] = inertia[i - 1] + turn @ np.diag([rod_inertia, rod_inertia, 0.0]) @ turn.T + shift
    return moment, inertia


def _turn_twist_zero(rotation: Array, turn: float) -> tuple[float, float, float]:
    """The parent's rotation a, the twist and this joint's zero, with Rz(a) Rx(twist) Rz(zero) = rotation Rz(turn).

    There are two solutions. For a right angle this is the one with a positive twist, which the firmware applies without
    a product. For any other twist it is the one with the zero within a quarter turn, so that adding the zero to a
    reading costs few bits. Parallel axes do not determine the zero: it is 0.
    """
    rotation = rotation @ rotation_z(turn)
    sine = float(np.hypot(rotation[0, 2], rotation[1, 2]))
    if sine < SNAP:
        return _wrapped(np.arctan2(rotation[1, 0], rotation[0, 0])), 0.0 if rotation[2, 2] > 0.0 else np.pi, 0.0
    # Third column: (sin a sin t, -cos a sin t, cos t); third row: (sin t sin zero, sin t cos zero, cos t).
    twist = float(np.arctan2(sine, rotation[2, 2]))
    a = float(np.arctan2(rotation[0, 2], -rotation[1, 2]))
    zero = float(np.arctan2(rotation[2, 0], rotation[2, 1]))
    # (a + pi, -twist, zero + pi) is the same rotation. The margin keeps rounding at a quarter turn from deciding.
    right_angle = _snapped(np.cos(twist)) == 0.0
    if not right_angle and not -np.pi / 2 + 1e-6 < zero <= np.pi / 2 + 1e-6:
        a, twist, zero = a + np.pi, -twist, zero + np.pi
    return _wrapped(a), twist, _wrapped(zero)


def _wrapped(angle: float) -> float:
    """The same angle in (-pi, pi]; rounding at the ends is removed."""
    angle = float(np.arctan2(np.sin(angle), np.cos(angle)))
    return float(np.pi) if angle < -np.pi + SNAP else _snapped(angle)


def _snapped(value: float) -> float:
    """Removes rounding where the exact value is clearly 0 or +-1."""
    nearest = round(float(value))
    return float(nearest) if nearest in (-1, 0, 1) and abs(value - nearest) < SNAP else float(value)


def _clean(values: Array) -> Array:
    """Replaces the rounding residue of a zero by zero."""
    return np.where(np.abs(values) < SNAP, 0.0, values)
