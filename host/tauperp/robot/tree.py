"""A tree of links as in a robot file, and its one serial chain that becomes a Robot.

Links joined by fixed joints are merged. Joints off the chain are locked at the file's position (URDF: zero, MJCF:
qpos0). Their links are merged too, so a hand's fingers or a second arm add only their mass.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tauperp.errors import InputError
from tauperp.robot.capsules import automatic_capsule, volume
from tauperp.robot.inertia import INERTIA_MAX_KG_M2, LENGTH_MAX_M, MASS_MAX_KG, excess, moments, possible, slack
from tauperp.robot.limits import Limits, fitted
from tauperp.robot.model import MAX_JOINTS, Capsule, Joint, Robot
from tauperp.robot.spatial import Array, Body, Pose, merged

FIXED, REVOLUTE = "fixed", "revolute"

_GRIPPER = re.compile("grip|finger|jaw|claw|knuckle|thumb", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class TreeJoint:
    """Connection of a link to its parent. A joint that mimics another one can only be locked."""

    name: str
    kind: str = FIXED  # FIXED, REVOLUTE, or the file's word for a kind that cannot be on a chain
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    limits: Limits = field(default_factory=Limits)
    rotor_inertia: float = 0.0
    mimics: str | None = None  # the joint that it follows; empty if the file names none


@dataclass(frozen=True, eq=False)
class TreeLink:
    name: str
    parent: str | None
    pose: Pose  # in the parent link at joint position zero
    joint: TreeJoint
    body: Body = field(default_factory=Body)
    locked_pose: Pose | None = None  # in the parent link, at the position of a locked joint, if not zero
    capsules: tuple[Capsule, ...] = ()
    marker: bool = False  # a frame that is not a body of the file (an MJCF site): a tip only if it is named

    @property
    def locked(self) -> Pose:
        return self.pose if self.locked_pose is None else self.locked_pose


@dataclass(frozen=True, eq=False)
class Chain:
    """A robot, its first and last link, and the bodies of links whose inertia was corrected, in the links' frames."""

    robot: Robot
    base: str
    tip: str
    changed: dict[str, Body]


class Tree:
    """Links by name in the file's order, parents before or after their children; exactly one has no parent."""

    def __init__(
        self, name: str, links: list[TreeLink], gravity: Array, closures: Sequence[tuple[str, str, str]] = ()
    ) -> None:
        self.name = name
        self.closures = closures  # name, and two links that a constraint outside the tree connects
        self.gravity = gravity  # (3,) m/s^2 in the root frame
        self.links = {link.name: link for link in links}
        self.children: dict[str, list[TreeLink]] = {link.name: [] for link in links}
        for link in links:
            if link.parent is not None:
                self.children[link.parent].append(link)
        self.root = next(link for link in links if link.parent is None)
        self._drives = {link.joint.mimics: link.joint.name for link in links if link.joint.mimics}

    def chain(
        self, *, base: str | None, tip: str | None, tool: Array, mounting: Array, accept_inertia: bool = False
    ) -> "Chain":
        """The robot from link `base` (default: the root) to link `tip` (default: the only end).

        tool: offset (3,) m added in the tip's frame. mounting: rotation (3, 3) of the file's root frame in a world
        whose z points up. Gravity in the base's frame follows from it, with the joints before the base locked.
        accept_inertia: an impossible inertia becomes the nearest possible one instead of an error.
        """
        for link in self.links.values():
            _refuse_sizes(link)
        base_link = self.root if base is None else self._link(base, "base")
        tip_link = self._only_tip(base_link) if tip is None else self._link(tip, "tip")
        path = self._path(base_link, tip_link)
        for i, link in enumerate(path):
            _refuse_joint(link, inner=any(x.joint.kind == REVOLUTE for x in path[:i]))
        moving = [link for link in path if link.joint.kind == REVOLUTE]
        if not 1 <= len(moving) <= MAX_JOINTS:
            raise InputError(
                f"robot '{self.name}': {len(moving)} revolute joints from link '{base_link.name}' to link "
                f"'{tip_link.name}'; 1 to {MAX_JOINTS} can be guarded"
            )

        on_path = {link.name for link in path}
        self._refuse_closures(moving, on_path)
        changed: dict[str, Body] = {}
        warnings = [
            f"joint '{link.joint.name}' drives joint '{self._drives[link.joint.name]}' (mimic), which is locked at zero"
            for link in moving
            if link.joint.name in self._drives
        ]
        if tip is None and _GRIPPER.search(moving[-1].joint.name):
            warnings.append(
                f"joint '{moving[-1].joint.name}' is named like a gripper's and counts as the arm's last one "
                f"(--tip {moving[-1].parent} ends the chain before it)"
            )
        beyond: dict[str, list[str]] = {}  # joints by the kind of their limits
        joints: list[Joint] = []
        capsules: list[list[Capsule]] = []
        pose = Pose()  # of the current link in the last moving joint's frame
        for link in path:
            pose = pose @ link.pose
            if link.joint.kind != REVOLUTE:
                continue
            body = self._merged(link, on_path, changed if accept_inertia else None)
            limits = fitted(link.joint.name, link.joint.limits)
            for text in limits.warnings:
                beyond.setdefault(text, []).append(f"'{link.joint.name}'")
            joints.append(
                Joint(
                    name=link.joint.name,
                    origin_rotation=pose.rotation,
                    origin_position=pose.position,
                    axis=link.joint.axis / np.linalg.norm(link.joint.axis),
                    mass=body.mass,
                    com=body.com,
                    inertia=body.inertia,
                    position_min=limits.position_min,
                    position_max=limits.position_max,
                    velocity_max=limits.velocity,
                    torque_max=limits.torque,
                    rotor_inertia=link.joint.rotor_inertia,
                    defaults=limits.defaults,
                )
            )
            capsules.append(self._capsules(link, on_path))
            pose = Pose()
        tip_point = pose.point(tool)
        ends = [joint.origin_position for joint in joints[1:]] + [tip_point]
        robot = Robot(
            name=self.name,
            joints=tuple(joints),
            tip=tip_point,
            tip_rotation=pose.rotation,
            gravity=self._locked_pose(base_link).rotation.T @ mounting.T @ self.gravity,
            capsules=tuple(
                max(shapes, key=volume) if shapes else automatic_capsule(joint.mass, joint.com, end)
                for joint, shapes, end in zip(joints, capsules, ends, strict=True)
            ),
        )
        warnings += [f"joint {', '.join(names)}: {text}" for text, names in beyond.items()]
        warnings += [self._change(name, body) for name, body in changed.items()]
        return Chain(replace(robot, warnings=tuple(warnings)), base_link.name, tip_link.name, changed)

    def _change(self, name: str, body: Body) -> str:
        before, after = (", ".join(f"{m:.4g}" for m in moments(x.inertia)) for x in (self.links[name].body, body))
        return f"link '{name}': no body has its inertia; principal moments {before} became {after} kg m^2"

    def _link(self, name: str, role: str) -> TreeLink:
        if name not in self.links:
            known = _few([f"'{link.name}'" for link in self.links.values() if not link.marker], 12)
            raise InputError(f"robot '{self.name}' has no link '{name}' to be the {role}; it has {known}")
        return self.links[name]

    def _ancestry(self, link: TreeLink) -> Iterator[TreeLink]:
        """The link, its parent, and so on to the root."""
        while True:
            yield link
            if link.parent is None:
                return
            link = self.links[link.parent]

    def _locked_pose(self, link: TreeLink) -> Pose:
        """Pose of a link in the root frame with every joint locked."""
        pose = Pose()
        for ancestor in self._ancestry(link):
            if ancestor.parent is not None:
                pose = ancestor.locked @ pose
        return pose

    def _path(self, base: TreeLink, tip: TreeLink) -> list[TreeLink]:
        """Links after `base` up to and including `tip`."""
        path: list[TreeLink] = []
        for link in self._ancestry(tip):
            if link.name == base.name:
                return path[::-1]
            path.append(link)
        raise InputError(f"robot '{self.name}': link '{tip.name}' is not a descendant of base '{base.name}'")

    def _only_tip(self, base: TreeLink) -> TreeLink:
        """The end of the chain if it is not named: the only free end after the last moving joint."""
        link = base
        while True:
            movers = self._movers(link)
            if not movers:
                break
            if len(movers) > 1:
                names = _few([f"joint '{mover.joint.name}'" for mover in movers])
                raise InputError(
                    f"robot '{self.name}' branches behind link '{link.name}' ({names}): choose one with --tip LINK"
                )
            link = movers[0]
        if link is base:
            raise InputError(f"robot '{self.name}': no joint moves after link '{base.name}'")
        if link.joint.kind == REVOLUTE and link.joint.name in self._drives:
            raise InputError(
                f"robot '{self.name}': joint '{link.joint.name}' drives joint '{self._drives[link.joint.name]}' "
                f"(mimic), as that of a gripper does: choose the end with --tip LINK (--tip {link.parent} ends the "
                "chain before it)"
            )
        ends = [(x, pose) for x, pose in self._rigid(link) if not x.marker and not self._rigid_children(x)]
        if any(np.linalg.norm(pose.position - ends[0][1].position) > 1e-6 for _, pose in ends):
            names = _few([f"'{end.name}'" for end, _ in ends])
            raise InputError(
                f"robot '{self.name}' has more than one end behind joint '{link.joint.name}' ({names}): "
                "choose one with --tip LINK"
            )
        return ends[0][0]

    def _rigid_children(self, link: TreeLink) -> list[TreeLink]:
        return [x for x in self.children[link.name] if x.joint.kind == FIXED and not x.marker]

    def _rigid(self, link: TreeLink) -> Iterator[tuple[TreeLink, Pose]]:
        """The links that fixed joints connect to `link`, and their poses in it."""
        pending = [(link, Pose())]
        while pending:
            link, pose = pending.pop()
            yield link, pose
            pending.extend((x, pose @ x.pose) for x in reversed(self.children[link.name]) if x.joint.kind == FIXED)

    def _movers(self, link: TreeLink) -> list[TreeLink]:
        """The links that move relative to `link` and to the links fixed to it."""
        return [
            child
            for rigid, _ in self._rigid(link)
            for child in self.children[rigid.name]
            if child.joint.kind != FIXED and child.joint.mimics is None
        ]

    def _moves_with(self, link: TreeLink, on_path: set[str]) -> Iterator[tuple[TreeLink, Pose]]:
        """The links that move with a link of the chain, through fixed and locked joints, and their poses in it."""
        pending = [(link, Pose())]
        while pending:
            part, pose = pending.pop()
            yield part, pose
            for child in reversed(self.children[part.name]):
                if child.name not in on_path:
                    pending.append((child, pose @ child.locked))
                elif child.joint.kind == FIXED:
                    pending.append((child, pose @ child.pose))

    def _merged(self, link: TreeLink, on_path: set[str], changed: dict[str, Body] | None) -> Body:
        """The body that moves with a link, in its frame. changed: collects impossible bodies; None refuses them.

        The allowed error of an inertia is relative to everything that the joint moves. The inertia of a screw, which
        changes no torque by a step of the wire, is no reason to refuse an arm.
        """
        parts = list(self._moves_with(link, on_path))
        for part, _ in parts:
            if part.body.mass < 0.0:
                raise InputError(f"link '{part.name}': mass {part.body.mass:g} kg is not positive")
        body = merged([part.body.moved(pose) for part, pose in parts])
        allowed = slack(body.inertia)
        impossible = [part for part, _ in parts if excess(part.body.inertia)[0] > allowed]
        if impossible and changed is None:
            raise InputError(_impossible(impossible[0]))
        if impossible and changed is not None:
            changed.update({x.name: replace(x.body, inertia=possible(x.body.inertia)) for x in impossible})
            body = merged([changed.get(part.name, part.body).moved(pose) for part, pose in parts])
        if body.mass <= 0.0 and link.marker:
            raise InputError(
                f"joint '{link.joint.name}' shares its body with another joint: give each a body with mass"
            )
        if body.mass <= 0.0:
            raise InputError(f"joint '{link.joint.name}' moves link '{link.name}', which has no mass and inertia")
        if np.linalg.eigvalsh(body.inertia)[0] <= 0.0:
            raise InputError(f"joint '{link.joint.name}' moves '{link.name}', whose inertia is not positive definite")
        return body

    def _capsules(self, link: TreeLink, on_path: set[str]) -> list[Capsule]:
        return [
            Capsule(pose.point(capsule.p0), pose.point(capsule.p1), capsule.radius)
            for part, pose in self._moves_with(link, on_path)
            for capsule in part.capsules
        ]

    def _refuse_closures(self, moving: list[TreeLink], on_path: set[str]) -> None:
        """A constraint between parts that move relative to each other makes the chain a loop."""
        owner = {part.name: link.name for link in moving for part, _ in self._moves_with(link, on_path)}
        for name, one, other in self.closures:
            if owner.get(one) != owner.get(other):
                raise InputError(f"equality constraint '{name}' closes a loop between links '{one}' and '{other}'")


def _few(names: list[str], most: int = 6) -> str:
    return ", ".join(names[:most]) + (", ..." if len(names) > most else "")


def _refuse_joint(link: TreeLink, *, inner: bool) -> None:
    """Raises InputError for a joint that cannot be on a chain of revolute joints. inner: it follows a revolute one."""
    joint = link.joint
    if joint.kind == FIXED:
        return
    way_out = f"--tip {link.parent} ends the chain before it" if inner else f"--base {link.name} starts it behind"
    if joint.kind != REVOLUTE:
        raise InputError(
            f"joint '{joint.name}' on the chain is {joint.kind}, and only revolute ones can be guarded ({way_out})"
        )
    if joint.mimics is not None:
        raise InputError(f"joint '{joint.name}' on the chain mimics another joint ({way_out})")
    if np.linalg.norm(joint.axis) < 1e-6:
        raise InputError(f"joint '{joint.name}' has a zero axis")


def _refuse_sizes(link: TreeLink) -> None:
    """Numbers that are impossible for an arm, and whose products overflow float64."""
    body = link.body
    for what, values, most in (
        ("mass in kg", np.array([body.mass]), MASS_MAX_KG),
        ("position in m", np.concatenate([link.pose.position, link.locked.position, body.com]), LENGTH_MAX_M),
        ("rotation", np.concatenate([link.pose.rotation, link.locked.rotation]), 2.0),
        ("axis", link.joint.axis, LENGTH_MAX_M),
        ("inertia in kg m^2", body.inertia, INERTIA_MAX_KG_M2),
    ):
        if not np.all(np.abs(values) <= most):
            raise InputError(f"link '{link.name}': {what} is beyond {most:g}")


def _impossible(link: TreeLink) -> str:
    named = ", ".join(f"{moment:.3g}" for moment in moments(link.body.inertia))
    return (
        f"link '{link.name}': inertia {excess(link.body.inertia)[1]} (principal moments {named} kg m^2); "
        "--accept-inertia takes the nearest possible one"
    )
