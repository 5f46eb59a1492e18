"""make_table(): the same dynamics as Pinocchio for any chain, with frames close to the robot."""

from dataclasses import fields, replace

import numpy as np
import pytest
from robot_makers import random_joint, random_robot, random_rotation, robot_of

from tauperp.robot import Robot, RobotTable, load, shipped
from tauperp.robot.check import QUANTITIES, check
from tauperp.robot.spatial import Body, Pose, merged, rotation_about, rotation_rpy, rotation_x
from tauperp.robot.table import TableJoint, make_table

SIZES = range(1, 9)


def assert_exact(robot: Robot, states: int = 10) -> None:
    for comparison in check(robot, states=states):
        assert comparison.good, f"{comparison.reader}: {comparison.difference}"


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("n", SIZES)
def test_any_chain_has_the_dynamics_that_pinocchio_computes(n: int, seed: int) -> None:
    print(f"seed {seed}, {n} joints")
    assert_exact(random_robot(100 * n + seed, n))


@pytest.mark.parametrize("seed", range(8))
def test_right_angles_and_parallel_axes_are_exact_in_the_table(seed: int) -> None:
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    units = np.vstack([np.eye(3), -np.eye(3)])
    joints = []
    for i in range(8):
        turns = [rotation_about(random.choice(units), np.pi / 2.0 * random.integers(4)) for _ in range(2)]
        joints.append(random_joint(random, f"joint{i}", turns[0] @ turns[1], random.choice(units)))
    robot = robot_of(joints, random)
    assert_exact(robot)
    for joint in make_table(robot).joint:
        assert {abs(joint.cos_twist), abs(joint.sin_twist)} == {0.0, 1.0}
        assert joint.sin_twist >= 0.0
        assert joint.zero_rad / (np.pi / 2) == pytest.approx(round(joint.zero_rad / (np.pi / 2)))


@pytest.mark.parametrize("base", [0.0, np.pi])
@pytest.mark.parametrize("tilt", [1e-3, 1e-6, 1e-8, 1e-9, 1e-11, 1e-12, 1e-13, 1e-15, 0.0])
def test_nearly_parallel_axes_keep_their_frames_at_the_robot(tilt: float, base: float) -> None:
    random = np.random.default_rng(3)
    z = np.array([0.0, 0.0, 1.0])
    joints = [
        random_joint(random, f"joint{i}", rotation_x(base) @ rotation_about(random.choice(np.eye(3)[:2]), tilt), z)
        for i in range(6)
    ]
    robot = robot_of(joints, random)
    assert_exact(robot)
    for joint, row in zip(robot.joints[1:], make_table(robot).joint[1:], strict=True):
        assert np.linalg.norm(row.offset) == pytest.approx(np.linalg.norm(joint.origin_position), abs=1e-9)


@pytest.mark.parametrize("n", SIZES)
def test_a_zero_is_within_a_quarter_turn_and_the_first_frame_is_the_base(n: int) -> None:
    table = make_table(random_robot(7 + n, n))
    first = table.joint[0]
    assert (first.cos_twist, first.sin_twist, first.zero_rad) == (1.0, 0.0, 0.0)
    assert not first.offset.any()
    assert all(abs(joint.zero_rad) <= np.pi / 2.0 + 1e-5 for joint in table.joint)
    assert all(joint.cos_twist**2 + joint.sin_twist**2 == pytest.approx(1.0, abs=1e-14) for joint in table.joint)
    assert table.base @ table.base.T == pytest.approx(np.eye(3), abs=1e-12)


def test_parallel_axes_have_zero_offsets_of_angle() -> None:
    random = np.random.default_rng(11)
    z = np.array([0.0, 0.0, 1.0])
    joints = [random_joint(random, f"joint{i}", rotation_about(z, i * 0.7), z) for i in range(4)]
    assert [joint.zero_rad for joint in make_table(robot_of(joints, random)).joint] == [0.0] * 4


def test_the_table_keeps_limits_and_gravity_and_omits_rotor_inertia() -> None:
    robot = random_robot(5, 3)
    table = make_table(robot)
    assert table.gravity == pytest.approx(robot.gravity)
    for joint, row in zip(robot.joints, table.joint, strict=True):
        assert (row.position_min_rad, row.position_max_rad) == (joint.position_min, joint.position_max)
        assert (row.velocity_max_rad_s, row.torque_max_nm) == (joint.velocity_max, joint.torque_max)
    heavy = replace(robot, joints=tuple(replace(joint, rotor_inertia=2.0) for joint in robot.joints))
    assert numbers(make_table(heavy)) == numbers(table)


def test_the_check_fails_for_any_number_of_the_table_that_is_wrong() -> None:
    robot = random_robot(21, 4)
    table = make_table(robot)
    names = [field.name for field in fields(TableJoint) if not field.name.endswith(("min_rad", "max_rad", "_s", "_nm"))]
    for name in names:
        wrong = replace(table.joint[2], **{name: getattr(table.joint[2], name) + 1e-6})
        joints = (*table.joint[:2], wrong, *table.joint[3:])
        assert not check(robot, replace(table, joint=joints), states=5)[0].good, name
    for name in ("base", "gravity", "tip"):
        changed = replace(table, **{name: getattr(table, name) + 1e-6})
        assert not check(robot, changed, states=5)[0].good, name
    broken = replace(table, tip=np.full(3, np.nan))
    assert check(robot, broken, states=2)[0].difference["jacobian"] == np.inf


def test_moving_inertia_between_links_within_the_rods_changes_nothing() -> None:
    """The parameters are minimal: robots that no motion can distinguish have the same table."""
    robot = random_robot(33, 2)
    child = robot.joints[1]
    a = child.axis
    # A rod on the child's axis (mass m, inertia l about both normals) taken from the parent, given to the child.
    m, l = 0.2, 0.003
    rod = l * (np.eye(3) - np.outer(a, a))
    given = merged([Body(child.mass, child.com, child.inertia), Body(m, np.zeros(3), rod)])
    parent = robot.joints[0]
    pose = Pose(child.origin_rotation, child.origin_position)
    moved = Body(m, np.zeros(3), rod).moved(pose)
    mass = parent.mass - m
    com = (parent.mass * parent.com - m * moved.com) / mass
    origin = np.zeros(3)
    about_origin = Body(parent.mass, parent.com, parent.inertia).inertia_about(origin) - moved.inertia_about(origin)
    at_com = about_origin - (Body(mass, com, np.zeros((3, 3))).inertia_about(origin))
    other = replace(
        robot,
        joints=(
            replace(parent, mass=mass, com=com, inertia=at_com),
            replace(child, mass=given.mass, com=given.com, inertia=given.inertia),
        ),
    )
    assert numbers(make_table(other)) == pytest.approx(numbers(make_table(robot)), abs=1e-12)


def numbers(table: RobotTable) -> list[float]:
    values = [table.base.ravel(), table.gravity, table.tip]
    for joint in table.joint:
        values += [np.ravel(getattr(joint, field.name)) for field in fields(TableJoint)]
    return [float(x) for x in np.concatenate(values)]


@pytest.mark.parametrize("name", shipped())
def test_a_shipped_robot_agrees_with_every_reader(name: str) -> None:
    robot = load(name)
    assert robot.name == name
    assert_exact(robot)
    assert set(check(robot, states=1)[0].difference) == set(QUANTITIES)


@pytest.mark.parametrize("name", shipped())
def test_a_shipped_robot_can_be_simulated(name: str) -> None:
    robot = load(name)
    assert len(robot.capsules) == robot.n == 7
    for joint, (p0, p1, radius) in zip(robot.joints, robot.capsules, strict=True):
        assert np.linalg.norm(p1 - p0) > 0.01
        assert 0.02 <= radius <= 0.1
        assert 0.05 <= joint.rotor_inertia <= 1.0
        assert joint.velocity_max <= 8.0
        assert joint.torque_max <= 320.0


def test_ku_dex_is_the_arm_of_the_experiments() -> None:
    robot = load("ku_dex")
    assert robot.mass == pytest.approx(16.8)
    assert robot.reach == pytest.approx(0.9)
    assert [tuple(abs(joint.axis).round(9)) for joint in robot.joints] == [
        (0, 0, 1), (0, 1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1),
    ]  # fmt: skip


def test_tool_and_mounting_apply_to_a_description_as_to_a_file() -> None:
    plain, turned = load("panda"), load("panda", tool=[0.03, 0.0, 0.1], base_rpy=[0.5, 0.2, 0.0])
    assert turned.tip - plain.tip == pytest.approx(plain.tip_rotation @ [0.03, 0.0, 0.1])
    assert turned.gravity == pytest.approx(rotation_rpy(0.5, 0.2, 0.0).T @ [0.0, 0.0, -9.81])
    assert_exact(turned)
    hung = load("ku_dex", base_rpy=[np.pi / 2.0, 0.0, 0.0], tool=[0.02, 0.0, 0.1])
    assert hung.gravity == pytest.approx([0.0, -9.81, 0.0])
    assert_exact(hung)


def test_a_random_rotation_of_the_tests_is_a_rotation() -> None:
    rotation = random_rotation(np.random.default_rng(1))
    assert rotation @ rotation.T == pytest.approx(np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1.0)
