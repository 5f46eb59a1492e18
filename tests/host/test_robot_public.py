"""Robots as their makers publish them (PyPI's example-robot-data): read, merged, and equal to Pinocchio's reading."""

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

from tauperp.errors import InputError
from tauperp.robot import load
from tauperp.robot.check import check


@pytest.fixture(scope="module")
def models() -> Path:
    try:
        package = distribution("example-robot-data")
    except PackageNotFoundError:
        pytest.skip("the Python package example-robot-data is not installed")
    return Path(str(package.locate_file("cmeel.prefix/share/example-robot-data/robots")))


PANDA = "panda_description/urdf/panda.urdf"
BAXTER = "baxter_description/urdf/baxter.urdf"
TIAGO = "tiago_description/robots/tiago_dual.urdf"
KINOVA = "kinova_description/robots/kinova.urdf"

# file, options, joints, mass kg of all that moves
ARMS = {
    "ur5": ("ur_description/urdf/ur5_robot.urdf", {}, 6, 16.99),
    "ur3": ("ur_description/urdf/ur3_robot.urdf", {}, 6, 8.63),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", {}, 7, 10.43),
    "panda with its fingers": (PANDA, {"tip": "panda_hand_tcp"}, 7, 16.82),
    "panda on a wall": (PANDA, {"tip": "panda_link8", "base_rpy": [0.0, 1.5708, 0.2], "tool": [0, 0, 0.1]}, 7, 16.82),
    "baxter's right arm": (BAXTER, {"tip": "right_gripper"}, 7, 20.07),
    "baxter's left forearm": (BAXTER, {"base": "left_upper_elbow", "tip": "left_gripper"}, 4, None),
    "tiago's left arm": (TIAGO, {"base": "torso_lift_link", "tip": "arm_left_tool_link"}, 7, 10.09),
    "kinova j2s6s200": (KINOVA, {"tip": "j2s6s200_end_effector"}, 6, None),
}


@pytest.mark.parametrize("name", ARMS)
def test_a_published_arm_is_read_as_pinocchio_reads_it(models: Path, name: str) -> None:
    file, options, n, mass = ARMS[name]
    robot = load(models / file, **options)
    assert robot.n == n
    if mass is not None:
        assert robot.mass == pytest.approx(mass, abs=0.01)
    comparisons = check(robot, states=10)
    assert len(comparisons) == 2
    for comparison in comparisons:
        assert comparison.good, f"{comparison.reader}: {comparison.difference}"


@pytest.mark.parametrize(
    ("file", "options", "message"),
    [
        (PANDA, {}, "joint 'panda_finger_joint1' on the chain is prismatic, .* --tip panda_hand ends"),
        (BAXTER, {}, r"branches behind link 'base' \(joint 'head_pan', joint 'right_s0', joint 'left_s0'\)"),
        (TIAGO, {"tip": "arm_left_tool_link"}, "joint 'torso_lift_joint' on the chain is prismatic"),
        (KINOVA, {}, "more than one end behind joint 'j2s6s200_joint_6'"),
    ],
)
def test_a_published_tree_asks_for_the_chain(models: Path, file: str, options: dict[str, str], message: str) -> None:
    with pytest.raises(InputError, match=message.replace("(--", r"\(--").replace(" --tip", r" \(--tip")):
        load(models / file, **options)
