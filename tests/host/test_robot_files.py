"""Reading URDF and MJCF: the values of a file, merged links, locked joints, and the messages of refused files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from robot_makers import (
    TREE,
    random_robot,
    random_rotation,
    urdf,
    urdf_joint,
    urdf_link,
    urdf_of,
    urdf_origin,
)

from tauperp.robot import Joint, Robot, load
from tauperp.robot.check import check
from tauperp.robot.model import DEFAULT_POSITION_RAD, DEFAULT_TORQUE_NM, DEFAULT_VELOCITY_RAD_S
from tauperp.robot.spatial import rotation_about, rotation_rpy, rotation_z

Writer = Callable[[str], Path]


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


def test_fixed_joints_are_merged_before_between_and_after_the_moving_ones(write: Writer) -> None:
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


def test_one_arm_of_a_tree_is_read_with_its_fingers_locked_and_merged(write: Writer) -> None:
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


def test_several_ends_at_one_point_are_one_tip(write: Writer) -> None:
    parts = [urdf_link(name, 1.0) for name in "ab"] + [urdf_link("tool0"), urdf_link("ee")]
    joints = [urdf_joint("j", "revolute", "a", "b")]
    at = np.array([0.0, 0.0, 0.1])
    joints += [urdf_joint(f"to_{x}", "fixed", "b", x, urdf_origin(rotation_z(0.1), at)) for x in ("tool0", "ee")]
    assert load(write(urdf(*parts, *joints))).tip == pytest.approx(at)


@pytest.mark.parametrize("excess", [-1e-7, 0.9e-3])
def test_inertias_rounded_in_the_file_are_accepted(write: Writer, excess: float) -> None:
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
def test_an_mjcf_is_read_as_mujoco_reads_it(write: Writer, base: str | None, tip: str) -> None:
    robot = load(write(MJCF), base=base, tip=tip, tool=[0.01, -0.02, 0.05], base_rpy=[0.1, 0.2, 0.3])
    assert robot.name == "Arm"
    assert [joint.name for joint in robot.joints] == ["shoulder", "twist", "elbow"][base == "shoulder" :]
    assert_exact(robot)


def test_limits_rotors_and_capsules_of_an_mjcf_are_read(write: Writer) -> None:
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


def test_gravity_of_an_mjcf_is_read_from_the_file(write: Writer) -> None:
    text = MJCF.replace("<default>", '<option gravity="0 0 -1.62"/><default>', 1)
    assert load(write(text), tip="fore").gravity == pytest.approx([0.0, 0.0, -1.62])


def test_rotation_about_an_axis_agrees_with_rpy() -> None:
    assert rotation_about(np.array([0.0, 0.0, 1.0]), 0.3) == pytest.approx(rotation_rpy(0.0, 0.0, 0.3))
    assert rotation_about(np.array([1.0, 0.0, 0.0]), 0.3) == pytest.approx(rotation_rpy(0.3, 0.0, 0.0))
    assert rotation_about(np.array([0.0, 1.0, 0.0]), 0.3) == pytest.approx(rotation_rpy(0.0, 0.3, 0.0))
