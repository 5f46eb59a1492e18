"""Robots as their makers publish them (PyPI's example-robot-data): read, merged, and equal to Pinocchio's reading."""

import re
import shlex
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

from tauperp.errors import InputError
from tauperp.files import repository_root
from tauperp.robot import load
from tauperp.robot.check import check

FOLDERS = {
    "example-robot-data": "cmeel.prefix/share/example-robot-data/robots",
    "robosuite": "robosuite/models/assets/robots",
}


def folder(package: str) -> Path:
    try:
        return Path(str(distribution(package).locate_file(FOLDERS[package])))
    except PackageNotFoundError:
        pytest.skip(f"optional: the Python package {package} is not installed")


@pytest.fixture(scope="module")
def models() -> Path:
    return folder("example-robot-data")


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


def documented() -> list[tuple[str, str, str, str]]:
    """Package, file, options and outcome of each row of the table in docs/robot-files.md."""
    text = (repository_root() / "docs" / "robot-files.md").read_text()
    rows = [line.split("|")[1:-1] for line in text.splitlines() if line.startswith(tuple(f"| {x} |" for x in FOLDERS))]
    return [
        (package.strip(), file.strip(" `"), options.strip(" `"), out.strip()) for package, file, options, out in rows
    ]


def test_the_page_has_a_table_of_public_arms() -> None:
    assert {package for package, *_ in documented()} == set(FOLDERS)
    assert len(documented()) > 30


@pytest.mark.parametrize(("package", "file", "options", "outcome"), documented())
def test_a_public_file_gives_the_documented_result(package: str, file: str, options: str, outcome: str) -> None:
    words = shlex.split(options)
    chosen = {key.removeprefix("--"): value for key, value in zip(words[::2], words[1::2], strict=True)}
    path = folder(package) / file
    if not path.is_file():
        pytest.skip(f"optional: another version of {package}")
    if outcome.startswith("refused: "):
        message = outcome.removeprefix("refused: ").removesuffix("...").strip()
        with pytest.raises(InputError, match=re.escape(message)):
            load(path, base=chosen.get("base"), tip=chosen.get("tip"))
        return
    robot = load(path, base=chosen.get("base"), tip=chosen.get("tip"))
    for comparison in check(robot, states=3):
        assert comparison.good, f"{comparison.reader}: {comparison.difference}"
    warnings = len(robot.warnings)
    told = f"; {warnings} warning{'s' * (warnings > 1)}" if warnings else ""
    assert f"{robot.n} joints, {robot.mass:.2f} kg{told}" == outcome
