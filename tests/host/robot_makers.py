"""Robots for tests: random chains, and URDF text of any Robot."""

import numpy as np

from tauperp.robot import Joint, Robot
from tauperp.robot.capsules import automatic_capsule
from tauperp.robot.spatial import Array, rotation_rpy


def random_rotation(random: np.random.Generator) -> Array:
    q, r = np.linalg.qr(random.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else -q


def random_inertia(random: np.random.Generator, mass: float) -> Array:
    """Inertia of three point masses and a solid part: physically possible for any numbers."""
    points = random.normal(scale=0.08, size=(4, 3))
    inertia = sum((p @ p) * np.eye(3) - np.outer(p, p) for p in points)
    return mass / 4.0 * inertia + 1e-4 * mass * np.eye(3)


def random_joint(
    random: np.random.Generator, name: str, rotation: Array | None = None, axis: Array | None = None
) -> Joint:
    mass = float(random.uniform(0.3, 6.0))
    direction = random.normal(size=3) if axis is None else axis
    return Joint(
        name=name,
        origin_rotation=random_rotation(random) if rotation is None else rotation,
        origin_position=random.uniform(-0.4, 0.4, 3),
        axis=direction / np.linalg.norm(direction),
        mass=mass,
        com=random.uniform(-0.1, 0.1, 3),
        inertia=random_inertia(random, mass),
        position_min=-float(random.uniform(1.0, 3.0)),
        position_max=float(random.uniform(1.0, 3.0)),
        velocity_max=float(random.uniform(1.0, 3.0)),
        torque_max=float(random.uniform(10.0, 300.0)),
    )


def robot_of(joints: list[Joint], random: np.random.Generator) -> Robot:
    """The joints as a robot with a random tip and a random orientation of the base."""
    return Robot(
        name="made_up",
        joints=tuple(joints),
        tip=random.uniform(-0.2, 0.2, 3),
        gravity=random_rotation(random) @ np.array([0.0, 0.0, -9.81]),
        capsules=tuple(automatic_capsule(joint.mass, joint.com, joint.com) for joint in joints),
    )


def random_robot(seed: int, n: int) -> Robot:
    random = np.random.default_rng(seed)
    return robot_of([random_joint(random, f"joint{i}") for i in range(n)], random)


def rpy(rotation: Array) -> Array:
    """Roll, pitch, yaw of Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
    return np.array([np.arctan2(rotation[2, 1], rotation[2, 2]), pitch, np.arctan2(rotation[1, 0], rotation[0, 0])])


def urdf_link(
    name: str,
    mass: float | None = None,
    com: Array | None = None,
    inertia: Array | None = None,
    axes: Array | None = None,
) -> str:
    """A <link>; without a mass it has no <inertial>. inertia (3, 3) in the link frame is written in `axes`."""
    if mass is None:
        return f'<link name="{name}"/>'
    about = 0.01 * mass * np.eye(3) if inertia is None else inertia
    axes = np.eye(3) if axes is None else axes
    about = axes.T @ about @ axes
    values = {"ixx": about[0, 0], "ixy": about[0, 1], "ixz": about[0, 2]}
    values |= {"iyy": about[1, 1], "iyz": about[1, 2], "izz": about[2, 2]}
    attributes = " ".join(f'{key}="{float(value)!r}"' for key, value in values.items())
    return (
        f'<link name="{name}"><inertial>{urdf_origin(axes, np.zeros(3) if com is None else com)}'
        f'<mass value="{float(mass)!r}"/><inertia {attributes}/></inertial></link>'
    )


def urdf_origin(rotation: Array, position: Array) -> str:
    row = [" ".join(repr(float(x)) for x in values) for values in (position, rpy(rotation))]
    return f'<origin xyz="{row[0]}" rpy="{row[1]}"/>'


def urdf_joint(name: str, kind: str, parent: str, child: str, inside: str = '<axis xyz="0 0 1"/>') -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>'


def urdf(*parts: str, name: str = "made_up") -> str:
    return f'<?xml version="1.0"?>\n<robot name="{name}">\n' + "\n".join(parts) + "\n</robot>\n"


def urdf_of(robot: Robot) -> str:
    """A URDF of the robot: links base, link0, ..., and the massless link `tip`."""
    parts = [urdf_link("base")]
    parent = "base"
    axes = random_rotation(np.random.default_rng(0))
    for i, joint in enumerate(robot.joints):
        parts.append(urdf_link(f"link{i}", joint.mass, joint.com, joint.inertia, axes))
        inside = urdf_origin(joint.origin_rotation, joint.origin_position)
        inside += '<axis xyz="{!r} {!r} {!r}"/>'.format(*map(float, joint.axis))
        inside += (
            f'<limit lower="{joint.position_min!r}" upper="{joint.position_max!r}" '
            f'velocity="{joint.velocity_max!r}" effort="{joint.torque_max!r}"/>'
        )
        parts.append(urdf_joint(joint.name, "revolute", parent, f"link{i}", inside))
        parent = f"link{i}"
    parts += [urdf_link("tip"), urdf_joint("to_tip", "fixed", parent, "tip", urdf_origin(np.eye(3), robot.tip))]
    return urdf(*parts, name=robot.name)


TREE = urdf(
    urdf_link("pillar", 20.0),
    urdf_link("torso", 10.0),
    *(urdf_link(f"{side}{i}", 2.0 - 0.5 * i, np.array([0.0, 0.03, 0.1])) for side in "lr" for i in range(2)),
    urdf_link("finger", 0.1),
    urdf_link("thumb", 0.2),
    urdf_joint("lift", "prismatic", "pillar", "torso", urdf_origin(rotation_rpy(0.3, 0.2, 0.1), np.ones(3))),
    *(
        urdf_joint(f"{s}_shoulder", "revolute", "torso", f"{s}0", urdf_origin(rotation_rpy(1, 2, 3), np.ones(3) * i))
        for i, s in enumerate("lr")
    ),
    *(
        urdf_joint(f"{s}_elbow", "revolute", f"{s}0", f"{s}1", urdf_origin(rotation_rpy(-1, 0.5, 0), np.ones(3) / 3))
        for s in "lr"
    ),
    urdf_joint("grip", "prismatic", "l1", "finger", urdf_origin(rotation_rpy(0, 0, 1), np.array([0.0, 0.0, 0.2]))),
    urdf_joint("follow", "revolute", "l1", "thumb", '<mimic joint="grip"/>' + urdf_origin(np.eye(3), np.ones(3) / 9)),
)
