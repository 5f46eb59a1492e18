"""URDF as a tree of links. Meshes, visuals, transmissions and everything else that has no mass is not looked at."""

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from tauperp.errors import InputError
from tauperp.robot.model import DEFAULT_POSITION_RAD, DEFAULT_TORQUE_NM, DEFAULT_VELOCITY_RAD_S, GRAVITY_M_S2, Capsule
from tauperp.robot.spatial import Array, Body, Pose, rotation_rpy
from tauperp.robot.tree import FIXED, REVOLUTE, Tree, TreeJoint, TreeLink

KINDS = {"revolute": REVOLUTE, "continuous": REVOLUTE, "fixed": FIXED}
OTHER_KINDS = ("prismatic", "floating", "planar", "spherical")


def read_urdf(path: Path, root: ElementTree.Element) -> Tree:
    """The tree of a parsed <robot>. Fails on missing or doubled names, loops, several roots, and what is no number."""
    where = path.name
    links: dict[str, ElementTree.Element] = {}
    for element in root.findall("link"):
        name = _name(element, where)
        if name in links:
            raise InputError(f"{where}: link '{name}' is there twice")
        links[name] = element
    if not links:
        raise InputError(f"{where}: a robot without links")

    parents: dict[str, tuple[str, ElementTree.Element]] = {}
    names: set[str] = set()
    for element in root.findall("joint"):
        name = _name(element, where)
        if name in names:
            raise InputError(f"{where}: joint '{name}' is there twice")
        names.add(name)
        parent, child = (_end(element, role, links, where) for role in ("parent", "child"))
        if child in parents:
            other = parents[child][1].get("name")
            raise InputError(f"{where}: joints '{other}' and '{name}' both carry link '{child}': a loop, not a tree")
        parents[child] = (parent, element)
    roots = [name for name in links if name not in parents]
    if len(roots) > 1:
        raise InputError(f"{where}: links '{roots[0]}' and '{roots[1]}' are not connected")
    _refuse_loop(parents, where)

    tree = [_link(name, element, parents.get(name), where) for name, element in links.items()]
    return Tree(root.get("name") or path.stem, tree, np.array([0.0, 0.0, -GRAVITY_M_S2]))


def _name(element: ElementTree.Element, where: str) -> str:
    name = element.get("name")
    if not name:
        raise InputError(f"{where}: a {element.tag} without a name")
    return name


def _end(joint: ElementTree.Element, role: str, links: dict[str, ElementTree.Element], where: str) -> str:
    """The name of the link that a joint names as its parent or child."""
    element = joint.find(role)
    link = None if element is None else element.get("link")
    if not link or link not in links:
        raise InputError(f"{where}: joint '{joint.get('name')}' has no {role} link '{link or ''}'")
    return link


def _refuse_loop(parents: dict[str, tuple[str, ElementTree.Element]], where: str) -> None:
    for start in parents:
        seen, link = {start}, start
        while link in parents:
            parent, joint = parents[link]
            if parent in seen:
                raise InputError(f"{where}: joint '{joint.get('name')}' closes a loop")
            seen.add(parent)
            link = parent


def _link(
    name: str, element: ElementTree.Element, hung: tuple[str, ElementTree.Element] | None, where: str
) -> TreeLink:
    place = f"{where}: link '{name}'"
    body = _body(element.find("inertial"), place)
    capsules = _capsules(element, place)
    if hung is None:
        return TreeLink(name, None, Pose(), TreeJoint(""), body, capsules=capsules)
    parent, joint = hung
    pose = _pose(joint.find("origin"), f"{where}: joint '{joint.get('name')}'")
    return TreeLink(name, parent, pose, _joint(joint, where), body, capsules=capsules)


def _body(inertial: ElementTree.Element | None, place: str) -> Body:
    if inertial is None:
        return Body()
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or inertia is None:
        raise InputError(f"{place}: <inertial> without <{'mass' if mass is None else 'inertia'}>")
    xx, xy, xz, yy, yz, zz = (_number(inertia, f"i{ij}", place) for ij in ("xx", "xy", "xz", "yy", "yz", "zz"))
    about_com = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    pose = _pose(inertial.find("origin"), place)
    return Body(_number(mass, "value", place), pose.position, pose.rotation @ about_com @ pose.rotation.T)


def _joint(element: ElementTree.Element, where: str) -> TreeJoint:
    name = element.get("name", "")
    place = f"{where}: joint '{name}'"
    kind = element.get("type")
    if kind not in KINDS and kind not in OTHER_KINDS:
        raise InputError(f"{place} has no known type ('{kind or ''}')")
    axis = element.find("axis")
    joint_axis = np.array([1.0, 0.0, 0.0]) if axis is None else _vector(axis, "xyz", place)
    limit = element.find("limit")
    bounded = limit is not None and kind == "revolute" and limit.get("upper") is not None
    return TreeJoint(
        name=name,
        kind=KINDS.get(kind, kind),
        axis=joint_axis,
        position_min=_number(limit, "lower", place, 0.0) if bounded else -DEFAULT_POSITION_RAD,
        position_max=_number(limit, "upper", place) if bounded else DEFAULT_POSITION_RAD,
        velocity_max=_number(limit, "velocity", place, DEFAULT_VELOCITY_RAD_S, zero_is_default=True),
        torque_max=_number(limit, "effort", place, DEFAULT_TORQUE_NM, zero_is_default=True),
        mimic=element.find("mimic") is not None,
    )


def _capsules(link: ElementTree.Element, place: str) -> tuple[Capsule, ...]:
    """Collision cylinders (along z) and capsules (an extension of some writers) as capsules as long over all."""
    found = []
    for collision in link.findall("collision"):
        for tag in ("cylinder", "capsule"):
            shape = collision.find(f"geometry/{tag}")
            if shape is None:
                continue
            radius, length = _number(shape, "radius", place), _number(shape, "length", place)
            half = np.array([0.0, 0.0, max(length / 2.0 - (radius if tag == "cylinder" else 0.0), 0.005)])
            pose = _pose(collision.find("origin"), place)
            found.append(Capsule(pose.point(-half), pose.point(half), radius))
    return tuple(found)


def _pose(origin: ElementTree.Element | None, place: str) -> Pose:
    if origin is None:
        return Pose()
    zero = np.zeros(3)
    position = _vector(origin, "xyz", place, zero)
    return Pose(rotation_rpy(*_vector(origin, "rpy", place, zero)), position)


def _vector(element: ElementTree.Element, key: str, place: str, default: Array | None = None) -> Array:
    text = element.get(key)
    if text is None and default is not None:
        return default
    values = [_float(word, f"{place}, {element.tag} {key}") for word in (text or "").split()]
    if len(values) != 3:
        raise InputError(f'{place}: {element.tag} {key}="{text or ""}" is not three numbers')
    return np.array(values)


def _number(
    element: ElementTree.Element | None,
    key: str,
    place: str,
    default: float | None = None,
    *,
    zero_is_default: bool = False,
) -> float:
    text = None if element is None else element.get(key)
    if text is None:
        if default is None:
            raise InputError(f"{place}: {key} is missing" + ("" if element is None else f" in <{element.tag}>"))
        return default
    value = _float(text, f"{place}, {key}")
    return default if zero_is_default and value == 0.0 and default is not None else value


def _float(text: str, place: str) -> float:
    try:
        value = float(text)
    except ValueError:
        hint = " (expand xacro first)" if "$" in text else ""
        raise InputError(f"{place}: '{text}' is not a number{hint}") from None
    if not math.isfinite(value):
        raise InputError(f"{place}: '{text}' is not finite")
    return value
