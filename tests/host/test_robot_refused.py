"""URDF and MJCF that cannot be guarded: each is refused in one line that says why."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from robot_makers import TREE, urdf, urdf_joint, urdf_link

from tauperp.errors import InputError
from tauperp.robot import load

Writer = Callable[[str], Path]


def arm(*changes: str, link: str = "", joint: str = "") -> str:
    """Links base, upper, fore with joints j1, j2; `link` replaces upper, `joint` replaces j2."""
    return urdf(
        urdf_link("base"),
        link or urdf_link("upper", 2.0),
        urdf_link("fore", 1.0),
        urdf_joint("j1", "revolute", "base", "upper"),
        joint or urdf_joint("j2", "revolute", "upper", "fore"),
        *changes,
    )


def inertia(xx: float, yy: float, zz: float, xy: float = 0.0) -> str:
    return urdf_link("upper", 2.0, None, np.array([[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, zz]]))


def mjcf(bodies: str, rest: str = "") -> str:
    return f"<mujoco><worldbody>{bodies}</worldbody>{rest}</mujoco>"


NINE = urdf(
    *(urdf_link(f"l{i}", 1.0) for i in range(10)),
    *(urdf_joint(f"j{i}", "revolute", f"l{i}", f"l{i + 1}") for i in range(9)),
)
BALL = mjcf('<body name="b"><joint name="hip" type="ball"/><geom size="0.1"/></body>')
FREE = mjcf(
    '<body name="b"><freejoint name="float"/><geom size="0.1"/>'
    '<body name="c"><joint name="j"/><geom size="0.1"/></body></body>'
)
LOOP = mjcf(
    '<body name="a"><joint name="j"/><geom size="0.1"/>'
    '<body name="b" pos="1 0 0"><joint name="k"/><geom size="0.1"/></body></body>',
    '<equality><connect name="rod" body1="b" anchor="0 0 0"/></equality>',
)
FOLLOW = LOOP.replace('<connect name="rod" body1="b" anchor="0 0 0"/>', '<joint joint1="k" joint2="j"/>')

REFUSED = {
    "prismatic": (
        arm(joint=urdf_joint("j2", "prismatic", "upper", "fore")),
        {},
        "joint 'j2' on the chain is prismatic, and only revolute ones can be guarded "
        "(--tip upper ends the chain before it)",
    ),
    "prismatic first": (
        TREE,
        {"tip": "l1"},
        "joint 'lift' on the chain is prismatic, and only revolute ones can be guarded (--base torso starts it behind)",
    ),
    "floating": (arm(joint=urdf_joint("j2", "floating", "upper", "fore")), {}, "joint 'j2' on the chain is floating"),
    "planar": (arm(joint=urdf_joint("j2", "planar", "upper", "fore")), {}, "joint 'j2' on the chain is planar"),
    "ball": (BALL, {}, "joint 'hip' on the chain is a ball joint"),
    "free": (FREE, {}, "joint 'float' on the chain is floating"),
    "unknown type": (
        arm(joint=urdf_joint("j2", "hinge", "upper", "fore")),
        {},
        "joint 'j2' has no known type ('hinge')",
    ),
    "mimic": (
        arm(joint=urdf_joint("j2", "revolute", "upper", "fore", '<mimic joint="j1"/>')),
        {"tip": "fore"},
        "joint 'j2' on the chain mimics another joint (--tip upper ends the chain before it)",
    ),
    "two joints in a body": (
        mjcf('<body name="b"><joint name="j"/><joint name="k" axis="1 0 0"/><geom size="0.1"/></body>'),
        {},
        "joint 'j' shares its body with another joint: give each a body with mass",
    ),
    "mimic in MJCF": (FOLLOW, {"tip": "b"}, "joint 'k' on the chain mimics another joint"),
    "branching": (
        arm(urdf_link("other", 1.0), urdf_joint("j3", "revolute", "upper", "other")),
        {},
        "robot 'made_up' branches behind link 'upper' (joint 'j2', joint 'j3'): choose one with --tip LINK",
    ),
    "two ends": (
        arm(
            urdf_link("camera"),
            urdf_joint("c", "fixed", "fore", "camera", '<origin xyz="1 0 0"/>'),
            urdf_link("tool"),
            urdf_joint("t", "fixed", "fore", "tool"),
        ),
        {},
        "robot 'made_up' has more than one end behind joint 'j2' ('camera', 'tool'): choose one with --tip LINK",
    ),
    "no inertia": (
        arm(link=urdf_link("upper")),
        {},
        "joint 'j1' moves link 'upper', which has no mass and inertia",
    ),
    "point mass": (arm(link=inertia(0, 0, 0)), {}, "joint 'j1' moves 'upper', whose inertia is not positive definite"),
    "not positive": (
        arm(link=inertia(0.1, 0.1, 0.1, 0.2)),
        {},
        "link 'upper': inertia is not positive definite (principal moments -0.1, 0.1, 0.3 kg m^2)",
    ),
    "triangle": (
        arm(link=inertia(0.1, 0.1, 0.21)),
        {},
        "link 'upper': inertia breaks the triangle inequality (principal moments 0.1, 0.1, 0.21 kg m^2)",
    ),
    "triangle in MJCF": (
        mjcf('<body name="b"><inertial pos="0 0 0" mass="1" diaginertia="1 1 3"/><joint/></body>'),
        {},
        "robot.xml: Error: inertia must satisfy A + B >= C; use 'balanceinertia' to fix Element name 'b'",
    ),
    "negative mass": (arm(link=urdf_link("upper", -1.0)), {}, "link 'upper': mass -1 kg is not positive"),
    "no mass": (arm(link=urdf_link("upper", 0.0, None, np.eye(3))), {}, "moves link 'upper', which has no mass"),
    "half an inertial": (
        arm(link='<link name="upper"><inertial><mass value="1"/></inertial></link>'),
        {},
        "robot.urdf: link 'upper': <inertial> without <inertia>",
    ),
    "zero axis": (
        arm(joint=urdf_joint("j2", "revolute", "upper", "fore", '<axis xyz="0 0 0"/>')),
        {},
        "joint 'j2' has a zero axis",
    ),
    "limits": (
        arm(joint=urdf_joint("j2", "revolute", "upper", "fore", '<limit lower="1" upper="-1"/>')),
        {},
        "joint 'j2': lower limit 1 rad is not below upper limit -1 rad",
    ),
    "negative limit": (
        arm(joint=urdf_joint("j2", "revolute", "upper", "fore", '<limit effort="-1" velocity="1"/>')),
        {},
        "joint 'j2': effort limit -1 is not positive",
    ),
    "nine joints": (NINE, {}, "robot 'made_up': 9 revolute joints from link 'l0' to link 'l9'; 1 to 8 can be guarded"),
    "no joints": (urdf(urdf_link("a", 1.0)), {}, "robot 'made_up': no joint moves after link 'a'"),
    "tip is base": (arm(), {"tip": "base"}, "robot 'made_up': 0 revolute joints from link 'base' to link 'base'"),
    "unknown tip": (
        arm(),
        {"tip": "hand"},
        "robot 'made_up' has no link 'hand' to be the tip; it has 'base', 'upper', 'fore'",
    ),
    "unknown base": (arm(), {"base": "floor"}, "robot 'made_up' has no link 'floor' to be the base"),
    "tip before base": (arm(), {"base": "fore", "tip": "upper"}, "link 'upper' is not a descendant of base 'fore'"),
    "tool": (arm(), {"tool": [0.0, np.nan, 0.0]}, "tool: three numbers are needed"),
    "mounting": (arm(), {"base_rpy": [0.0, 1.0]}, "base-rpy: three numbers are needed"),
    "two parents": (
        arm(urdf_joint("again", "fixed", "base", "fore")),
        {},
        "robot.urdf: joints 'j2' and 'again' both carry link 'fore': a loop, not a tree",
    ),
    "circle": (
        urdf(
            urdf_link("base"),
            *(urdf_link(x, 1.0) for x in "ab"),
            urdf_joint("j1", "revolute", "a", "b"),
            urdf_joint("j2", "revolute", "b", "a"),
        ),
        {},
        "robot.urdf: joint 'j2' closes a loop",
    ),
    "loop in MJCF": (LOOP, {}, "equality constraint 'rod' closes a loop between links 'b' and 'world'"),
    "two roots": (arm(urdf_link("stray")), {}, "robot.urdf: links 'base' and 'stray' are not connected"),
    "twice": (arm(urdf_link("fore")), {}, "robot.urdf: link 'fore' is there twice"),
    "joint twice": (
        arm(urdf_link("x"), urdf_joint("j2", "fixed", "fore", "x")),
        {},
        "robot.urdf: joint 'j2' is there twice",
    ),
    "missing child": (arm(urdf_joint("j3", "fixed", "fore", "x")), {}, "robot.urdf: joint 'j3' has no child link 'x'"),
    "no name": (arm("<link/>"), {}, "robot.urdf: a link without a name"),
    "empty": (urdf(), {}, "robot.urdf: a robot without links"),
    "word": (
        arm(joint=urdf_joint("j2", "revolute", "upper", "fore", '<axis xyz="0 0 up"/>')),
        {},
        "robot.urdf: joint 'j2', axis xyz: 'up' is not a number",
    ),
    "xacro": (
        arm(joint=urdf_joint("j2", "revolute", "upper", "fore", '<origin xyz="0 0 ${l}"/>')),
        {},
        "robot.urdf: joint 'j2', origin xyz: '${l}' is not a number (expand xacro first)",
    ),
    "two numbers": (
        arm(joint=urdf_joint("j2", "revolute", "upper", "fore", '<axis xyz="0 1"/>')),
        {},
        "robot.urdf: joint 'j2': axis xyz=\"0 1\" is not three numbers",
    ),
    "infinite": (
        arm(link=urdf_link("upper", np.inf, None, np.eye(3))),
        {},
        "robot.urdf: link 'upper', value: 'inf' is not finite",
    ),
    "malformed": ('<robot name="x"><link', {}, "robot.urdf: not well-formed XML (unclosed token"),
    "malformed MJCF": (
        '<mujoco><worldbody><bodi/></worldbody></mujoco>',
        {},
        "robot.xml: XML Error: Schema violation: unrecognized element Element 'bodi'",
    ),
    "neither": ("<sdf/>", {}, "robot.xml: <sdf> is neither URDF (<robot>) nor MJCF (<mujoco>)"),
    "mesh of an inertia": (
        '<mujoco><asset><mesh name="m" file="gone.stl"/></asset><worldbody><body name="b"><joint/>'
        '<geom type="mesh" mesh="m"/></body></worldbody></mujoco>',
        {},
        "gone.stl",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_guarded_is_refused_in_one_line(write: Writer, case: str) -> None:
    text, options, message = REFUSED[case]
    with pytest.raises(InputError) as error:
        load(write(text), **options)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_an_unknown_name_is_refused_with_the_known_names(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no such file, and no shipped robot of that name \(iiwa7, .*ku_dex, panda"):
        load("kuka")
    with pytest.raises(InputError, match="a folder"):
        load(tmp_path)
    with pytest.raises(InputError, match="robot 'panda' is one chain: it has no other base or tip"):
        load("panda", tip="hand")


def test_a_file_with_a_shipped_name_is_read_by_its_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("panda").write_text(arm())
    assert load("panda").n == 7
    assert load("./panda").n == 2
