"""Reading URDF and MJCF: what a file says, what is merged and locked, and what is refused in which words."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from robot_makers import (
    random_robot,
    random_rotation,
    urdf,
    urdf_joint,
    urdf_link,
    urdf_of,
    urdf_origin,
)

from tauperp.errors import InputError
from tauperp.robot import Joint, Robot, load
from tauperp.robot.check import check
from tauperp.robot.model import DEFAULT_POSITION_RAD, DEFAULT_TORQUE_NM, DEFAULT_VELOCITY_RAD_S
from tauperp.robot.spatial import rotation_about, rotation_rpy, rotation_z

Writer = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Writer:
    def writer(text: str) -> Path:
        path = tmp_path / ("robot.urdf" if "<robot" in text else "robot.xml")
        path.write_text(text)
        return path

    return writer


def assert_exact(robot: Robot) -> None:
    comparisons = check(robot, states=5)
    assert len(comparisons) == 2, "the file itself was not read by another reader"
    for comparison in comparisons:
        assert comparison.good, f"{comparison.reader}: {comparison.difference}"


def assert_same(one: Joint, other: Joint) -> None:
    for name in ("origin_rotation", "origin_position", "axis", "mass", "com", "inertia"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-12), name
    for name in ("name", "position_min", "position_max", "velocity_max", "torque_max"):
        assert getattr(one, name) == getattr(other, name)


# URDF


@pytest.mark.parametrize("n", range(1, 9))
def test_a_urdf_reads_back_as_the_robot_that_it_was_written_from(write: Writer, n: int) -> None:
    robot = random_robot(40 + n, n)
    read = load(write(urdf_of(robot)))
    assert read.name == robot.name
    assert read.tip == pytest.approx(robot.tip, abs=1e-12)
    for one, other in zip(read.joints, robot.joints, strict=True):
        assert_same(one, other)
    assert_exact(read)


def test_fixed_joints_are_merged_before_between_and_behind(write: Writer) -> None:
    random = np.random.default_rng(8)
    poses = [urdf_origin(random_rotation(random), random.uniform(-0.3, 0.3, 3)) for _ in range(5)]
    axis = '<axis xyz="0.6 0 0.8"/>'
    masses = {"a": 9.0, "b": 2.0, "c": 1.0, "d": 3.0, "e": 0.5, "f": 0.2}
    robot = load(
        write(
            urdf(
                *(urdf_link(name, mass, np.array([0.02, 0.01, -0.03])) for name, mass in masses.items()),
                urdf_joint("mount", "fixed", "a", "b", poses[0]),
                urdf_joint("j1", "revolute", "b", "c", poses[1] + axis),
                urdf_joint("spacer", "fixed", "c", "d", poses[2]),
                urdf_joint("j2", "continuous", "d", "e", poses[3] + axis),
                urdf_joint("flange", "fixed", "e", "f", poses[4]),
            )
        )
    )  # fmt: skip
    assert [joint.name for joint in robot.joints] == ["j1", "j2"]
    assert [joint.mass for joint in robot.joints] == pytest.approx([4.0, 0.7])
    assert_exact(robot)


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


def test_one_arm_of_a_tree_with_its_fingers_locked_and_merged(write: Writer) -> None:
    robot = load(write(TREE), base="torso", tip="l1")
    assert [joint.name for joint in robot.joints] == ["l_shoulder", "l_elbow"]
    assert [joint.mass for joint in robot.joints] == pytest.approx([2.0, 1.8])
    assert_exact(robot)
    other = load(write(TREE), base="torso", tip="r1", tool=[0.1, 0.2, 0.3], base_rpy=[0.4, -0.3, 0.2])
    assert [joint.mass for joint in other.joints] == pytest.approx([2.0, 1.5])
    assert other.tip == pytest.approx([0.1, 0.2, 0.3])
    assert_exact(other)


def test_gravity_follows_the_mounting_and_the_locked_joints_to_the_base(write: Writer) -> None:
    down = np.array([0.0, 0.0, -9.81])
    torso, mounting = rotation_rpy(0.3, 0.2, 0.1), rotation_rpy(0.4, -0.3, 0.2)
    robot = load(write(TREE), base="torso", tip="l1")
    assert robot.gravity == pytest.approx(torso.T @ down)
    robot = load(write(TREE), base="torso", tip="l1", base_rpy=[0.4, -0.3, 0.2])
    assert robot.gravity == pytest.approx(torso.T @ mounting.T @ down)


def test_a_base_inside_the_chain_locks_what_is_before_it(write: Writer) -> None:
    robot = load(write(TREE), base="l0", tip="l1")
    assert [joint.name for joint in robot.joints] == ["l_elbow"]
    assert_exact(robot)


def test_joints_without_limits_get_what_the_wire_can_carry(write: Writer) -> None:
    parts = [urdf_link("a"), urdf_link("b", 1.0), urdf_link("c", 1.0)]
    zero = '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="0" velocity="0"/>'
    robot = load(
        write(urdf(*parts, urdf_joint("j1", "continuous", "a", "b"), urdf_joint("j2", "revolute", "b", "c", zero)))
    )
    free, bounded = robot.joints
    assert (free.position_min, free.position_max) == (-DEFAULT_POSITION_RAD, DEFAULT_POSITION_RAD)
    assert (bounded.position_min, bounded.position_max) == (-1.0, 1.0)
    assert {joint.velocity_max for joint in robot.joints} == {DEFAULT_VELOCITY_RAD_S}
    assert {joint.torque_max for joint in robot.joints} == {DEFAULT_TORQUE_NM}


def test_ends_at_one_point_are_one_tip(write: Writer) -> None:
    parts = [urdf_link(name, 1.0) for name in "ab"] + [urdf_link("tool0"), urdf_link("ee")]
    joints = [urdf_joint("j", "revolute", "a", "b")]
    at = np.array([0.0, 0.0, 0.1])
    joints += [urdf_joint(f"to_{x}", "fixed", "b", x, urdf_origin(rotation_z(0.1), at)) for x in ("tool0", "ee")]
    assert load(write(urdf(*parts, *joints))).tip == pytest.approx(at)


@pytest.mark.parametrize("excess", [-1e-7, 0.9e-3])
def test_inertias_rounded_by_their_writer_are_taken(write: Writer, excess: float) -> None:
    """A flat plate has xx + yy = zz exactly; a rounded one may have a little more on one side."""
    inertia = np.diag([0.1, 0.1, 0.2 * (1.0 + excess)])
    assert load(write(urdf(urdf_link("a"), urdf_link("b", 1.0, None, inertia), urdf_joint("j", "revolute", "a", "b"))))


# MJCF

MJCF = """<mujoco model="Arm">
  <compiler angle="degree" eulerseq="xyz"/>
  <default>
    <joint axis="0 1 0" armature="0.3"/>
    <default class="wrist"><joint axis="1 0 1" armature="0.1" range="-90 45"/></default>
  </default>
  <asset><mesh name="lost" file="not_there.stl"/><texture name="t" type="2d" file="no.png"/>
    <material name="m" texture="t"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1" material="m"/>
    <body name="pedestal" pos="1 2 3" euler="10 20 30">
      <body name="shoulder" pos="0 0.1 0.2" quat="1 2 3 4">
        <joint name="shoulder" pos="0.02 0.03 0.04" ref="30" range="-100 120"/>
        <inertial mass="2" pos="0.01 0.02 0.1" fullinertia="0.02 0.03 0.02 0.001 0.002 -0.001"/>
        <geom type="mesh" mesh="lost" material="m"/>
        <body name="upper" pos="0 0 0.1">
        <joint name="twist" axis="0 0 1" pos="-0.01 0 0.05"/>
        <inertial mass="1" pos="0.01 0 0.1" diaginertia="0.02 0.03 0.02"/>
        <body name="fore" pos="0.1 0 0.3" axisangle="1 1 0 50">
          <joint name="elbow" class="wrist" ref="-20"/>
          <geom type="capsule" fromto="0 0 0 0.1 0 0.3" size="0.04" density="800"/>
          <body name="slider" pos="0 0.1 0">
            <joint name="slide" type="slide" axis="1 0 0" ref="0.05"/>
            <geom type="box" size="0.02 0.03 0.04" pos="0.01 0 0" mass="0.4"/>
          </body>
          <body name="claw" pos="0 -0.1 0">
            <joint name="claw" ref="40"/>
            <joint name="tilt" axis="1 0 0" pos="0.01 0 0" ref="-10"/>
            <geom type="sphere" size="0.03" pos="0.05 0 0" mass="0.2"/>
          </body>
          <site name="tcp" pos="0.1 0.05 0.35" euler="5 6 7"/>
        </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="shoulder" gear="50" ctrllimited="true" ctrlrange="-2 1"/>
    <motor joint="shoulder" forcerange="-5 5"/>
    <position joint="twist" kp="100" forcerange="-30 20"/>
  </actuator>
  <custom><numeric name="velocity_max:elbow" data="1.5"/></custom>
</mujoco>"""


@pytest.mark.parametrize("tip", ["fore", "tcp"])
@pytest.mark.parametrize("base", [None, "pedestal", "shoulder"])
def test_an_mjcf_means_what_mujoco_makes_of_it(write: Writer, base: str | None, tip: str) -> None:
    robot = load(write(MJCF), base=base, tip=tip, tool=[0.01, -0.02, 0.05], base_rpy=[0.1, 0.2, 0.3])
    assert robot.name == "Arm"
    assert [joint.name for joint in robot.joints] == ["shoulder", "twist", "elbow"][base == "shoulder" :]
    assert_exact(robot)


def test_limits_rotors_and_capsules_of_an_mjcf(write: Writer) -> None:
    path = write(MJCF)
    shoulder, twist, elbow = load(path, tip="tcp").joints
    assert (shoulder.position_min, shoulder.position_max) == pytest.approx(np.deg2rad([-100.0, 120.0]))
    assert (elbow.position_min, elbow.position_max) == pytest.approx(np.deg2rad([-90.0, 45.0]))
    assert (shoulder.torque_max, twist.torque_max, elbow.torque_max) == (105.0, 30.0, DEFAULT_TORQUE_NM)
    assert (shoulder.rotor_inertia, elbow.rotor_inertia) == (0.3, 0.1)
    assert (elbow.velocity_max, twist.velocity_max) == (1.5, DEFAULT_VELOCITY_RAD_S)
    assert elbow.axis == pytest.approx(np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0))
    p0, p1, radius = load(path, tip="tcp").capsules[2]
    assert radius == 0.04
    assert np.linalg.norm(p1 - p0) == pytest.approx(np.hypot(0.1, 0.3))


def test_gravity_of_an_mjcf_is_the_files(write: Writer) -> None:
    text = MJCF.replace("<default>", '<option gravity="0 0 -1.62"/><default>', 1)
    assert load(write(text), tip="fore").gravity == pytest.approx([0.0, 0.0, -1.62])


# Refused


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


def test_a_name_that_is_nothing_is_refused_with_the_names_there_are(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no such file, and no shipped robot of that name \(iiwa7, .*ku_dex, panda"):
        load("kuka")
    with pytest.raises(InputError, match="a folder"):
        load(tmp_path)
    with pytest.raises(InputError, match="robot 'panda' is one chain: it has no other base or tip"):
        load("panda", tip="hand")


def test_a_file_of_a_shipped_name_is_reached_by_its_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("panda").write_text(arm())
    assert load("panda").n == 7
    assert load("./panda").n == 2


def test_rotation_about_an_axis_is_what_rpy_says() -> None:
    assert rotation_about(np.array([0.0, 0.0, 1.0]), 0.3) == pytest.approx(rotation_rpy(0.0, 0.0, 0.3))
    assert rotation_about(np.array([1.0, 0.0, 0.0]), 0.3) == pytest.approx(rotation_rpy(0.3, 0.0, 0.0))
    assert rotation_about(np.array([0.0, 1.0, 0.0]), 0.3) == pytest.approx(rotation_rpy(0.0, 0.3, 0.0))
