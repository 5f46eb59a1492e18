"""URDF as a tree of links. Meshes, colours and everything else without mass are ignored.

Link and joint names are two name spaces. An origin is rotated by rpy or by quat_xyzw. A link whose mass is zero is a
frame.
"""

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from tauperp.errors import InputError
from tauperp.robot.limits import Limits
from tauperp.robot.model import GRAVITY_M_S2, Capsule
from tauperp.robot.spatial import Array, Body, Pose, rotation_quaternion, rotation_rpy
from tauperp.robot.tree import FIXED, REVOLUTE, Tree, TreeJoint, TreeLink

KINDS = {"revolute": REVOLUTE, "continuous": REVOLUTE, "fixed": FIXED}
OTHER_KINDS = ("prismatic", "floating", "planar", "spherical")

_MACROS = ("include", "macro", "property", "insert_block", "if", "unless")  # old xacro, without a prefix
_OTHERS_WITH_LINKS = ("gazebo", "transmission", "ros2_control")  # they may hold inertials or joints of another format


def read_urdf(path: Path, root: ElementTree.Element) -> Tree:
    """The tree of a parsed <robot>. Fails on missing or repeated names, loops, several roots, and values that are not
    numbers."""
    where = path.name
    _refuse_macros(root, where)
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

    rotors = _rotors(root, where)
    tree = [_link(name, element, parents.get(name), rotors, where) for name, element in links.items()]
    return Tree(root.get("name") or path.stem, tree, np.array([0.0, 0.0, -GRAVITY_M_S2]))


def _refuse_macros(root: ElementTree.Element, where: str) -> None:
    """Elements that no URDF reader accepts, and that may contain mass, are an error."""
    prefixes = {"xacro:"} | {
        f"{key.removeprefix('xmlns:')}:"
        for key, value in root.attrib.items()
        if key.startswith("xmlns:") and "xacro" in value
    }
    for element in root.iter():
        if element.tag.startswith(tuple(prefixes)):
            raise InputError(f"{where}: holds xacro elements (<{element.tag}>): expand it first")
    for child in root:
        if child.tag in _MACROS:
            raise InputError(f"{where}: holds xacro elements (<{child.tag}>): expand it first")
        if child.tag != "link" and child.tag not in _OTHERS_WITH_LINKS and child.find(".//inertial") is not None:
            raise InputError(f"{where}: <{child.tag}> holds an <inertial> that is not in a link of the robot")


def _name(element: ElementTree.Element, where: str) -> str:
    name = element.get("name")
    if not name:
        raise InputError(f"{where}: a {element.tag} without a name")
    if "${" in name or "$(" in name:
        raise InputError(f"{where}: {element.tag} '{name}' holds a xacro expression: expand it first")
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


def _rotors(root: ElementTree.Element, where: str) -> dict[str, float]:
    """Rotor inertia reflected to each joint, kg m2, from the transmissions that contain it.

    URDF itself has no element for it; these are Drake's: drake:rotor_inertia and drake:gear_ratio of an actuator.
    """
    rotors: dict[str, float] = {}
    for transmission in root.findall("transmission"):
        values = {"rotor_inertia": 0.0, "gear_ratio": 1.0}
        for element in transmission.findall("actuator/*"):
            key = element.tag.removeprefix("drake:").removeprefix("{http://drake.mit.edu}")
            if key in values and key != element.tag:
                values[key] = _number(element, "value", f"{where}: transmission of an actuator")
        joint = transmission.find("joint")
        if joint is not None and values["rotor_inertia"] > 0.0:
            rotors[joint.get("name", "")] = values["rotor_inertia"] * values["gear_ratio"] ** 2
    return rotors


def _link(
    name: str,
    element: ElementTree.Element,
    hung: tuple[str, ElementTree.Element] | None,
    rotors: dict[str, float],
    where: str,
) -> TreeLink:
    place = f"{where}: link '{name}'"
    body = _body(element.find("inertial"), place)
    capsules = _capsules(element, place)
    if hung is None:
        return TreeLink(name, None, Pose(), TreeJoint(""), body, capsules=capsules)
    parent, joint = hung
    pose = _pose(joint.find("origin"), f"{where}: joint '{joint.get('name')}'")
    return TreeLink(name, parent, pose, _joint(joint, rotors, where), body, capsules=capsules)


def _body(inertial: ElementTree.Element | None, place: str) -> Body:
    if inertial is None:
        return Body()
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    if mass is None or inertia is None:
        raise InputError(f"{place}: <inertial> without <{'mass' if mass is None else 'inertia'}>")
    xx, xy, xz, yy, yz, zz = (_number(inertia, f"i{ij}", place) for ij in ("xx", "xy", "xz", "yy", "yz", "zz"))
    about_com = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    pose = _pose(inertial.find("origin"), place)
    kg = _number(mass, "value", place)
    return Body() if kg == 0.0 else Body(kg, pose.position, pose.rotation @ about_com @ pose.rotation.T)


def _is_frame(inertial: ElementTree.Element | None) -> bool:
    """A mass of zero."""
    mass = None if inertial is None else inertial.find("mass")
    return mass is not None and float(mass.get("value", "1")) == 0.0


def frame_warnings(root: ElementTree.Element) -> tuple[str, ...]:
    """The links that have an inertia and no mass: their inertia is ignored. For a file that read_urdf accepts."""
    return tuple(
        f"link '{link.get('name')}' has an inertia and no mass: taken as a frame"
        for link in root.findall("link")
        if _is_frame(link.find("inertial"))
        and any(float(value) != 0.0 for value in link.find("inertial/inertia").attrib.values())  # type: ignore[union-attr]
    )


def _joint(element: ElementTree.Element, rotors: dict[str, float], where: str) -> TreeJoint:
    name = element.get("name", "")
    place = f"{where}: joint '{name}'"
    kind = element.get("type")
    if kind not in KINDS and kind not in OTHER_KINDS:
        raise InputError(f"{place} has no known type ('{kind or ''}')")
    axis = element.find("axis")
    joint_axis = np.array([1.0, 0.0, 0.0]) if axis is None else _vector(axis, "xyz", place)
    limit = element.find("limit")
    mimic = element.find("mimic")
    return TreeJoint(
        name=name,
        kind=KINDS.get(kind, kind),
        axis=joint_axis,
        limits=Limits() if limit is None else _limits(limit, kind, place),
        mimics=None if mimic is None else mimic.get("joint", ""),
        rotor_inertia=rotors.get(name, 0.0),
    )


def _limits(limit: ElementTree.Element, kind: str, place: str) -> Limits:
    """By the format, a missing lower or upper limit is 0. A velocity or effort of 0 means no limit."""
    bounded = kind == "revolute" and not limit.attrib.keys().isdisjoint(("lower", "upper"))
    return Limits(
        lower=_number(limit, "lower", place, 0.0) if bounded else None,
        upper=_number(limit, "upper", place, 0.0) if bounded else None,
        velocity=_number(limit, "velocity", place, 0.0) or None,
        torque=_number(limit, "effort", place, 0.0) or None,
    )


def _capsules(link: ElementTree.Element, place: str) -> tuple[Capsule, ...]:
    """Collision cylinders (along z) and capsules (an extension of some writers) as capsules of equal total length."""
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
    if origin.get("quat_xyzw") is None:
        return Pose(rotation_rpy(*_vector(origin, "rpy", place, zero)), position)
    if origin.get("rpy") is not None:
        raise InputError(f"{place}: origin has both rpy and quat_xyzw")
    x, y, z, w = _vector(origin, "quat_xyzw", place, count="four")
    if not 0.9 < x * x + y * y + z * z + w * w < 1.1:
        raise InputError(f'{place}: origin quat_xyzw="{origin.get("quat_xyzw")}" is not a unit quaternion')
    return Pose(rotation_quaternion(np.array([w, x, y, z])), position)


def _vector(
    element: ElementTree.Element, key: str, place: str, default: Array | None = None, *, count: str = "three"
) -> Array:
    text = element.get(key)
    if text is None and default is not None:
        return default
    values = [_float(word, f"{place}, {element.tag} {key}") for word in (text or "").split()]
    if len(values) != {"three": 3, "four": 4}[count]:
        raise InputError(f'{place}: {element.tag} {key}="{text or ""}" is not {count} numbers')
    return np.array(values)


def _number(element: ElementTree.Element, key: str, place: str, default: float | None = None) -> float:
    text = element.get(key)
    if text is None:
        if default is None:
            raise InputError(f"{place}: {key} is missing in <{element.tag}>")
        return default
    return _float(text, f"{place}, {key}")


def _float(text: str, place: str) -> float:
    try:
        if "_" in text or not text.isascii():  # accepted by Python's float() only
            raise ValueError
        value = float(text)
    except ValueError:
        hint = " (expand xacro first)" if "$" in text else ""
        raise InputError(f"{place}: '{text}' is not a number{hint}") from None
    if not math.isfinite(value):
        raise InputError(f"{place}: '{text}' is not finite")
    return value


# For another reader


LINK, JOINT = "link ", "joint "  # prefixes, since a reader may have one name space for both
_READABLE_KINDS = {"spherical": "floating"}  # a locked joint needs only a known type


def essence(root: ElementTree.Element, changed: dict[str, Body]) -> bytes:
    """What of a robot that read_urdf takes has to do with dynamics, as URDF: for a reader that may refuse the rest.

    Attributes are copied as they are written. changed: bodies that take the place of the file's. Limits that
    a reader may require are not part of it.
    """
    robot = ElementTree.Element("robot", name="robot", version="1.2")  # the first in which quat_xyzw is read
    for link in root.findall("link"):
        name = link.get("name", "")
        made = ElementTree.SubElement(robot, "link", name=LINK + name)
        inertial = link.find("inertial")
        if name in changed:
            _add_body(made, changed[name])
        elif inertial is not None and not _is_frame(inertial):
            _copy(inertial, ElementTree.SubElement(made, "inertial"), ("origin", "mass", "inertia"))
    for joint in root.findall("joint"):
        kind = joint.get("type", "")
        made = ElementTree.SubElement(
            robot, "joint", name=JOINT + joint.get("name", ""), type=_READABLE_KINDS.get(kind, kind)
        )
        _copy(joint, made, ("origin", "axis"))
        for role in ("parent", "child"):
            end = joint.find(role)
            ElementTree.SubElement(made, role, link=LINK + ("" if end is None else end.get("link", "")))
        ElementTree.SubElement(made, "limit", lower="-1", upper="1", effort="1", velocity="1")
    return ElementTree.tostring(robot, encoding="utf-8")


def _copy(element: ElementTree.Element, into: ElementTree.Element, tags: tuple[str, ...]) -> None:
    for tag in tags:
        found = element.find(tag)
        if found is not None:
            ElementTree.SubElement(into, tag, found.attrib)


def _add_body(link: ElementTree.Element, body: Body) -> None:
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=" ".join(repr(float(x)) for x in body.com))
    ElementTree.SubElement(inertial, "mass", value=repr(body.mass))
    pairs = ((i, j) for i in range(3) for j in range(i, 3))
    ElementTree.SubElement(
        inertial, "inertia", {f"i{'xyz'[i]}{'xyz'[j]}": repr(float(body.inertia[i, j])) for i, j in pairs}
    )
