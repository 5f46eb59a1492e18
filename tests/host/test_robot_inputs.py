"""Robot files as found in practice: encodings, pipes, remains of xacro, limits, grippers, and impossible inertias."""

import os
import threading
from pathlib import Path

import numpy as np
import pytest
from robot_makers import urdf, urdf_joint, urdf_link

from tauperp import cli
from tauperp.calibrate.output import robot_key
from tauperp.config import load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Core
from tauperp.robot import Robot, limits, load
from tauperp.robot.check import check
from tauperp.robot.inertia import excess, possible
from tauperp.wire import Wire

AXIS = '<axis xyz="0 1 0"/>'
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="30"/>'


def arm(*more: str, upper: str = "", inside: str = AXIS + LIMIT, names: tuple[str, str] = ("j1", "j2")) -> str:
    """Links base, upper, fore on joints j1 and j2; `inside` j2, `upper` instead of that link, and more elements."""
    at = '<origin xyz="0 0 0.3"/>'
    return urdf(
        urdf_link("base"),
        upper or urdf_link("upper", 2.0),
        urdf_link("fore", 1.0, np.array([0.1, 0.0, 0.2])),
        urdf_joint(names[0], "revolute", "base", "upper", AXIS + LIMIT),
        urdf_joint(names[1], "revolute", "upper", "fore", at + inside),
        *more,
    )


def read(folder: Path, content: str | bytes, name: str = "arm.urdf", **options: object) -> Robot:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    robot = load(path, **options)  # type: ignore[arg-type]
    for comparison in check(robot, states=3):
        assert comparison.good, f"{comparison.reader}: {comparison.difference}"
    return robot


def refused(folder: Path, content: str | bytes, message: str, name: str = "arm.urdf", **options: object) -> None:
    with pytest.raises(InputError) as error:
        read(folder, content, name, **options)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_link_and_joint_names_are_two_name_spaces(tmp_path: Path) -> None:
    assert [joint.name for joint in read(tmp_path, arm(names=("upper", "fore"))).joints] == ["upper", "fore"]


@pytest.mark.parametrize("encoding", ["gbk", "big5", "shift_jis", "euc-kr", "utf-16", "latin-1", "utf-8-sig"])
def test_a_file_is_read_in_the_encoding_that_it_declares(tmp_path: Path, encoding: str) -> None:
    word = "Ä" if encoding == "latin-1" else "각" if encoding == "euc-kr" else "手"
    text = arm(f"<!-- {word} -->").replace("?>", f' encoding="{encoding.removesuffix("-sig")}"?>', 1)
    assert read(tmp_path, text.encode(encoding)).n == 2


@pytest.mark.parametrize("encoding", ["no-such", "utf-8", "hex", "idna", "undefined"])
def test_an_encoding_that_cannot_be_read_gives_one_line(tmp_path: Path, encoding: str) -> None:
    text = arm("<!-- 手 -->").replace("?>", f' encoding="{encoding}"?>', 1)
    refused(tmp_path, text.encode("gbk"), "save")


@pytest.mark.parametrize(
    "text", [arm(), '<mujoco><worldbody><body><joint/><geom size="0.1"/></body></worldbody></mujoco>']
)
def test_a_pipe_is_read_like_a_file(tmp_path: Path, text: str) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_text, args=(text,))
    writer.start()
    robot = load(pipe)
    writer.join()
    assert all(comparison.good for comparison in check(robot, states=2))


# Input that would make a table wrong without a message

GRIPPER = (
    urdf_link("finger", 0.05),
    urdf_link("thumb", 0.05),
    urdf_joint("grip", "revolute", "fore", "finger", AXIS + LIMIT),
    urdf_joint("follow", "revolute", "fore", "thumb", '<mimic joint="grip"/>' + AXIS + LIMIT),
)


def test_the_driving_joint_of_a_gripper_is_not_a_joint_of_the_arm(tmp_path: Path) -> None:
    refused(tmp_path, arm(*GRIPPER), "joint 'grip' drives joint 'follow' (mimic), as that of a gripper does")
    robot = read(tmp_path, arm(*GRIPPER), tip="fore")
    assert robot.n == 2
    assert robot.mass == pytest.approx(3.1)
    asked_for = read(tmp_path, arm(*GRIPPER), tip="finger")
    assert asked_for.n == 3
    assert asked_for.warnings == ("joint 'grip' drives joint 'follow' (mimic), which is locked at zero",)


def test_a_last_joint_that_is_named_like_a_grippers_is_reported(tmp_path: Path) -> None:
    (warning,) = read(tmp_path, arm(names=("j1", "jointGripper"))).warnings
    assert warning.startswith("joint 'jointGripper' is named like a gripper's")
    assert "--tip upper ends the chain before it" in warning


@pytest.mark.parametrize(
    "leftover",
    ['<xacro:if value="1"><link name="tool"/></xacro:if>', '<x:tool xmlns:x="..."/>', "<include/>", "<macro/>"],
)
def test_remains_of_xacro_are_refused(tmp_path: Path, leftover: str) -> None:
    text = arm(leftover).replace("<robot", '<robot xmlns:x="http://ros.org/wiki/xacro"')
    refused(tmp_path, text, "holds xacro elements")
    refused(tmp_path, arm(names=("j1", "${prefix}j2")), "holds a xacro expression: expand it first")


def test_mass_outside_of_the_robots_links_is_refused(tmp_path: Path) -> None:
    refused(tmp_path, arm(f"<group>{urdf_link('tool', 1.0)}</group>"), "<group> holds an <inertial>")


@pytest.mark.parametrize(
    ("given", "lower", "upper", "defaults"),
    [
        ('lower="-2.8"', -2.8, 0.0, {"velocity", "torque"}),
        ('upper="1.5" effort="30"', 0.0, 1.5, {"velocity"}),
        ('velocity="2" effort="0"', -4.0, 4.0, {"position", "torque"}),
    ],
)
def test_a_missing_half_of_a_limit_follows_the_format_and_a_default_is_marked(
    tmp_path: Path, given: str, lower: float, upper: float, defaults: set[str]
) -> None:
    joint = read(tmp_path, arm(inside=f"{AXIS}<limit {given}/>")).joints[1]
    assert (joint.position_min, joint.position_max) == (lower, upper)
    assert joint.defaults == defaults


def test_the_table_marks_defaults_and_prints_warnings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(arm(inside=AXIS + '<limit lower="-6.3" upper="6.3" velocity="20"/>'))
    assert cli.main(["robot", str(path)]) == 0
    out = capsys.readouterr().out
    assert "320.0*" in out
    assert "* not in the file: a default" in out
    assert out.count("warning: joint 'j2': ") == 2
    assert "position limits -6.3 to 6.3 rad are beyond the +-4.09588 rad that JointState carries" in out
    assert "velocity limit 20 rad/s is beyond the 8.19175 rad/s that JointState carries" in out


def test_limits_are_those_that_the_wire_carries(tmp_path: Path) -> None:
    joint_state = Wire.read().message("JointState1").definition
    carried = {name: float(joint_state.get_signal_by_name(name).maximum or 0) for name in ("Position", "Velocity")}
    assert carried == {"Position": limits.WIRE_POSITION_RAD, "Velocity": limits.WIRE_VELOCITY_RAD_S}
    assert joint_state.get_signal_by_name("Torque").maximum == limits.WIRE_TORQUE_NM
    wide = AXIS + '<limit lower="-6.28" upper="1" velocity="20" effort="400"/>'
    robot = read(tmp_path, arm(inside=wide))
    joint = robot.joints[1]
    assert (joint.position_min, joint.position_max, joint.velocity_max, joint.torque_max) == (-4.0, 4.0, 8.0, 320.0)
    assert len(robot.warnings) == 3
    assert joint.defaults == frozenset()
    assert read(tmp_path, arm(inside=wide.replace("-6.28", "-1e16"))).joints[1].position_max == 4.0


def test_limits_in_degrees_are_refused(tmp_path: Path) -> None:
    inside = AXIS + '<limit lower="-170" upper="170"/>'
    refused(tmp_path, arm(inside=inside), "joint 'j2': position limits -170 to 170 rad are 27 turns")


def test_config_reports_limits_that_the_wire_cannot_carry(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "arm.urdf").write_text(arm(inside=AXIS + '<limit lower="-1" upper="1" velocity="2" effort="400"/>'))
    (tmp_path / "cell.toml").write_text('robot = "arm.urdf"\n')
    assert cli.main(["config", str(tmp_path / "cell.toml")]) == 0
    warning = "joint 'j2': torque limit 400 Nm is beyond the 327.67 Nm that JointState carries: 320 Nm in the table"
    assert capsys.readouterr().err == f"tauperp: warning: {warning}\n"


WEIGHTLESS = ('<option gravity="0 0 0"/>', '<option><flag gravity="disable"/></option>')


@pytest.mark.parametrize("option", WEIGHTLESS)
def test_a_file_that_switches_gravity_off_is_refused(tmp_path: Path, option: str) -> None:
    text = f'<mujoco>{option}<worldbody><body><joint/><geom size="0.1"/></body></worldbody></mujoco>'
    refused(tmp_path, text, "gravity is off", "arm.xml")


# Elements without dynamics

NO_DYNAMICS = {
    "colours": '<material name="red"/><material name="red"><color rgba="1 0 0"/></material>',
    "transmission": '<transmission name="t"><type>x</type><joint name="j1"/></transmission>',
    "gazebo": '<gazebo reference="upper"><selfCollide/><inertial/></gazebo>',
    "ros2_control": '<ros2_control name="r" type="system"><joint name="j1"/></ros2_control>',
    "another format": '<sensor:camera xmlns:sensor="x"/>',
    "a comment": "<!-- table -- arm -->",
}


@pytest.mark.parametrize("kind", NO_DYNAMICS)
def test_elements_without_dynamics_change_nothing(tmp_path: Path, kind: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert read(tmp_path, arm(NO_DYNAMICS[kind])).mass == pytest.approx(3.0)
    assert capfd.readouterr() == ("", "")


def test_a_safety_controller_and_a_default_name_space_change_nothing(tmp_path: Path) -> None:
    text = arm(inside=AXIS + LIMIT + '<safety_controller soft_lower_limit="-1"/><calibration rising="0"/>')
    assert read(tmp_path, text.replace("<robot", '<robot xmlns="http://www.ros.org"')).n == 2


@pytest.mark.parametrize("declared", ["", ' xmlns:drake="http://drake.mit.edu"'])
def test_a_transmission_gives_the_rotor_inertia_of_its_joint(tmp_path: Path, declared: str) -> None:
    rotor = (
        '<transmission><joint name="j2"/><actuator name="m"><drake:rotor_inertia value="2e-5"/>'
        '<drake:gear_ratio value="100"/></actuator></transmission>'
    )
    robot = read(tmp_path, arm(rotor).replace("<robot", f"<robot{declared}", 1))
    assert [joint.rotor_inertia for joint in robot.joints] == pytest.approx([0.0, 0.2])
    refused(tmp_path, arm(rotor.replace("2e-5", "much")), "'much' is not a number")


def test_an_origin_may_be_rotated_by_a_quaternion(tmp_path: Path) -> None:
    half = np.sin(np.pi / 4)
    turned = read(tmp_path, arm(inside=f'<origin xyz="0 0 0.3" quat_xyzw="{half} 0 0 {half}"/>' + AXIS + LIMIT).replace(
        '<origin xyz="0 0 0.3"/><origin', "<origin"))  # fmt: skip
    expected = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    assert turned.joints[1].origin_rotation == pytest.approx(np.array(expected, float), abs=1e-9)
    for wrong in ('quat_xyzw="0 0 0 0"', 'quat_xyzw="0 0 1"', 'rpy="0 0 0" quat_xyzw="0 0 0 1"'):
        text = arm().replace('<origin xyz="0 0 0.3"/>', f"<origin {wrong}/>")
        refused(tmp_path, text, "quat_xyzw")


MJCF = """<mujoco><!-- a -- b --><asset><mesh name="m" file="gone.stl"/><material name="red"/></asset><worldbody>
<body name="one"><joint name="j1" axis="0 1 0"/><inertial mass="2" pos="0 0 0.1" diaginertia="0.1 0.1 {izz}"/>
<geom name="shell" type="mesh" mesh="m" material="red"/><body name="two" pos="0 0 0.4"><joint name="j2" axis="1 0 0"/>
<geom name="rod" type="capsule" fromto="0 0 0 0 0 0.3" size="0.04"/></body></body></worldbody>
<contact><pair geom1="shell" geom2="rod"/></contact><keyframe><key qpos="0 0"/></keyframe></mujoco>"""


def test_references_to_meshes_and_loose_comments_do_not_prevent_reading(tmp_path: Path) -> None:
    assert read(tmp_path, MJCF.format(izz=0.05), "arm.xml").n == 2


def test_a_link_without_mass_is_a_frame_whatever_its_inertia(tmp_path: Path) -> None:
    more = (urdf_link("tcp", 0.0, None, np.eye(3)), urdf_joint("end", "fixed", "fore", "tcp"))
    robot = read(tmp_path, arm(*more))
    assert robot.mass == pytest.approx(3.0)
    assert robot.warnings == ("link 'tcp' has an inertia and no mass: taken as a frame",)


def test_the_inertia_of_a_tiny_link_is_judged_by_the_torque_that_it_changes(tmp_path: Path) -> None:
    screw = (urdf_link("screw", 0.003, None, np.diag([1e-7, 1.4e-6, 4e-6])), urdf_joint("s", "fixed", "fore", "screw"))
    assert read(tmp_path, arm(*screw)).mass == pytest.approx(3.003)
    plate = (urdf_link("plate", 0.3, None, np.diag([1e-3, 1e-3, 4e-3])), urdf_joint("s", "fixed", "fore", "plate"))
    refused(tmp_path, arm(*plate), "link 'plate': inertia breaks the triangle inequality")


def test_makers_inertias_can_be_accepted_and_the_change_is_shown(tmp_path: Path) -> None:
    text = arm(upper=urdf_link("upper", 2.0, None, np.diag([0.1, 0.1, 0.4])))
    refused(tmp_path, text, "--accept-inertia takes the nearest possible one")
    robot = read(tmp_path, text, accept_inertia=True)
    assert excess(robot.joints[0].inertia)[0] == pytest.approx(0.0, abs=1e-12)
    changed = "link 'upper': no body has its inertia; principal moments 0.1, 0.1, 0.4 became 0.2, 0.2, 0.4 kg m^2"
    assert robot.warnings == (changed,)
    robot = read(tmp_path, MJCF.format(izz=0.4), "arm.xml", accept_inertia=True)
    assert "body 'one': no body has its inertia" in robot.warnings[0]
    assert excess(robot.joints[0].inertia)[0] < 1e-9


def test_the_nearest_possible_inertia_of_a_possible_one_is_itself() -> None:
    inertia = np.array([[0.3, 0.01, 0.02], [0.01, 0.2, -0.03], [0.02, -0.03, 0.25]])
    assert possible(inertia) == pytest.approx(inertia, abs=1e-12)


# The part of a file that is the arm

LIFT = urdf(
    urdf_link("floor"),
    *(urdf_link(name, 1.0) for name in ("base", "upper", "fore")),
    urdf_joint("lift", "prismatic", "floor", "base"),
    urdf_joint("j1", "revolute", "base", "upper", AXIS + LIMIT),
    urdf_joint("j2", "revolute", "upper", "fore", AXIS + LIMIT),
)


def test_the_options_that_a_message_names_exist(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "lift.urdf").write_text(LIFT)
    cell = tmp_path / "cell.toml"
    cell.write_text('robot = "lift.urdf"\n')
    assert cli.main(["config", str(cell)]) == 2
    assert "(--base base starts it behind)" in capsys.readouterr().err
    assert cli.main(["config", str(cell), "--base", "base"]) == 0
    assert cli.main(["config", "--robot", str(tmp_path / "lift.urdf"), "--base", "base", "default"]) == 0
    assert load_configuration(cell, chain={"base": "base", "tip": "upper"}).robot.n == 1
    cell.write_text('[robot]\nmodel = "lift.urdf"\nbase = "base"\n')
    assert load_configuration(cell).robot.n == 2


def test_a_calibration_keeps_base_and_tool_of_the_robot(tmp_path: Path) -> None:
    (tmp_path / "lift.urdf").write_text(LIFT)
    line = robot_key("lift.urdf", {"base": "base", "tool": [0.0, 0.0, 0.1], "accept_inertia": True})
    (tmp_path / "cell.toml").write_text(line + "\n")
    robot = load_configuration(tmp_path / "cell.toml").robot
    assert robot.n == 2
    assert robot.tip == pytest.approx([0.0, 0.0, 0.1])
    assert robot_key('a "b" \\ c', {}) == 'robot = "a \\"b\\" \\\\ c"'


def test_a_core_accepts_base_and_tool_for_a_file(tmp_path: Path) -> None:
    (tmp_path / "lift.urdf").write_text(LIFT)
    core = Core(tmp_path / "lift.urdf", base="base", tool=[0.0, 0.0, 0.1])
    assert core.n == 2
    with pytest.raises(InputError, match="not to a Robot object"):
        Core(core.robot, base="base")


@pytest.mark.parametrize(
    "command", ["run", "experiment", "replay", "score", "config", "guard", "robot", "sensitivity", "calibrate"]
)
def test_every_command_with_a_robot_accepts_its_base_and_tip(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([command, "--help"]) == 0
    text = capsys.readouterr().out
    for option in ("--base LINK", "--tip LINK", "--tool X Y Z", "--accept-inertia"):
        assert option in text


@pytest.mark.parametrize("command", ["guard", "run"])
@pytest.mark.parametrize("option", ["--bitrate", "--data-bitrate"])
def test_a_bit_rate_that_socketcan_ignores_is_refused(
    command: str, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    what = ["payload"] if command == "run" else []
    arguments = [command, *what, "--interface", "socketcan", "--channel", "vcan0", option, "500000"]
    assert cli.main(arguments) == 2
    assert capsys.readouterr().err == (
        f"tauperp: {option} has no effect on socketcan: set it with ip link (type can bitrate ...)\n"
    )
