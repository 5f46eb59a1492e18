"""From a TOML file to a checked configuration: what is accepted, what is refused, and the messages."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tauperp import cli, robot
from tauperp.config import TASKS, load_configuration, preset_names
from tauperp.config.block import block_dtype
from tauperp.errors import InputError
from tauperp.firmware import Core, Guard
from tauperp.wire import Wire


def arm(joints: int) -> robot.Robot:
    """The shipped arm, truncated after this many joints."""
    whole = robot.load("ku_dex")
    return dataclasses.replace(whole, joints=whole.joints[:joints], capsules=whole.capsules[:joints])


Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write(text: str, name: str = "cell.toml") -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def refusal(path: Path) -> str:
    """The message of `tauperp` about the file, without the path at the start."""
    with pytest.raises(InputError) as error:
        load_configuration(path)
    message = str(error.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


@pytest.mark.parametrize("name", preset_names())
def test_every_shipped_preset_makes_a_block(name: str) -> None:
    assert len(load_configuration(name, robot="ku_dex").block()) > 0


def test_the_paper_preset_has_the_papers_numbers() -> None:
    paper = load_configuration("paper", robot="ku_dex")
    assert paper.settings.observer.gain_per_s == 50
    assert paper.settings.subspace.order == "filter_first"
    assert [paper.settings.task[task].index for task in TASKS] == ["r", "d_p", "d_e"]
    assert paper.threshold_nm("payload").tolist() == [2.0] * 7


def test_a_file_needs_only_what_differs_from_its_preset(write: Write) -> None:
    path = write('robot = "ku_dex"\npreset = "paper"\n[task.payload]\nthreshold_nm = [1, 2, 3, 4, 5, 6, 7]\n')
    configuration = load_configuration(path)
    assert configuration.threshold_nm("payload").tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert configuration.settings.task.payload.debounce_ticks == 1
    assert configuration.settings.subspace.order == "filter_first"


def test_without_a_preset_the_default_one_applies(write: Write) -> None:
    own = load_configuration(write('robot = "ku_dex"'))
    assert own.block() == load_configuration("default", robot="ku_dex").block()


def test_overrides_take_precedence_over_the_file(write: Write) -> None:
    path = write('robot = "ku_dex"\n[wire]\nrate_hz = 500\nformat = "classic"\n')
    configuration = load_configuration(path, overrides={"wire": {"rate_hz": 250}})
    assert configuration.period_us == 4000
    assert configuration.settings.wire.format == "classic"


def test_a_given_robot_takes_precedence_over_the_file(write: Write) -> None:
    assert load_configuration(write('robot = "nonsense"'), robot=arm(6)).robot.n == 6


def test_a_model_beside_the_file_is_found_from_anywhere(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    source = robot.load("ku_dex").source
    assert source is not None
    path = write('robot = "arm.xml"')
    write(source.path.read_text(), "arm.xml")
    monkeypatch.chdir("/")
    assert load_configuration(path).robot.n == 7


@pytest.mark.parametrize(("joints", "indexes"), [(6, ["r", "d_p", "off"]), (5, ["r", "off", "off"])])
def test_presets_turn_off_tasks_that_detect_nothing_on_a_short_arm(joints: int, indexes: list[str]) -> None:
    configuration = load_configuration("default", robot=arm(joints))
    assert [configuration.settings.task[task].index for task in TASKS] == indexes


@pytest.mark.parametrize(("joints", "task", "index"), [(6, "contact", "d_e"), (5, "payload", "d_p")])
def test_asking_for_an_index_that_would_detect_nothing_is_refused(
    write: Write, joints: int, task: str, index: str
) -> None:
    with pytest.raises(InputError, match=rf"task\.{task}\.index: {index} explains . directions.*detect nothing"):
        load_configuration(write(f'[task.{task}]\nindex = "{index}"'), robot=arm(joints))


def test_deadlines_come_from_the_dbc_unless_the_file_says_otherwise(write: Write) -> None:
    wire = Wire.read()
    configuration = load_configuration(write('robot = "ku_dex"\n[deadline]\nsync_cycles = 2\n'))
    assert configuration.timeout_cycles("sync") == 2
    assert configuration.timeout_cycles("joint") == wire.message("JointState1").timeout_cycles
    assert configuration.timeout_cycles("task") == wire.message("TaskCommand").timeout_cycles


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[task.payload]\ntreshold_nm = 1', "task.payload.treshold_nm: unknown key (did you mean 'threshold_nm'?)"),
        ('speed = 1', "speed: unknown key"),
        ('preset = "papre"', "preset: there is no preset 'papre'"),
        ('[task.none]\nthreshold_nm = -1', "task.none.threshold_nm: -1 Nm is beyond 0 to 1/3 of the torque limit"),
        ('[task.none]\nthreshold_nm = [1, 2]', "task.none.threshold_nm: 2 values for the 7 joints"),
        ('[task.none]\nthreshold_nm = []', "task.none.threshold_nm: 0 values for the 7 joints"),
        ('[task.none]\nthreshold_nm = inf', "task.none.threshold_nm: inf Nm is beyond 0 to 1/3 of the torque limit"),
        ('[task.none]\nthreshold_nm = true', "task.none.threshold_nm: should be a valid list"),
        ('[task.none]\nthreshold_nm = 300', "task.none.threshold_nm: 300 Nm is beyond 0 to 1/3 of the torque limit"),
        ('[task.none]\nindex = "d"', "task.none.index: should be 'off', 'r', 'd_p', 'd_r', 'd_e' or 'd_f'"),
        ('[task.none]\ndebounce_ticks = 0', "task.none.debounce_ticks: should be greater than"),
        ('[observer]\ngain_per_s = "50"', "observer.gain_per_s: should be a valid number, not '50'"),
        ('[observer]\ngain_per_s = 300\n[wire]\nrate_hz = 299', "observer.gain_per_s: gain times period"),
        ('[wire]\nformat = "classic"', "wire.rate_hz: 7 joints would fill the classic bus to 156%"),
        ('[deadline]\nsync_cycles = 0', "deadline.sync_cycles: should be greater than"),
        ('[deadline]\njoint_cycles = 5', "deadline.joint_cycles: should be less than or equal to 4"),
        ('[deadline]\ntick_budget_us = 1001', "deadline.tick_budget_us: longer than the period of 1000 us"),
        ('[reset]\nhealthy_ms = 0.5', "reset.healthy_ms: shorter than the 100 ms"),
        ('[stop]\nfault = 2', "stop.fault: should be 0 or 1, not 2"),
        ('[observer]\ngain_per_s = 0.001', "observer.gain_per_s: should be greater than or equal to 10"),
        ('[deadline]\ntask_cycles = 10000', "deadline.task_cycles: should be less than or equal to 15"),
        ('[task.none]\ndebounce_ticks = 1000', "task.none.debounce_ticks: 1000 ticks are longer than 0.1 s"),
        ('[subspace]\nsoftness_nm_per_n = 0.001', "subspace.softness_nm_per_n: below tolerance_nm_per_n"),
        ('[sensor]\noffset_nm = 60', "sensor.offset_nm: 60 Nm is beyond 1/4 of the torque limit"),
        ('[[bank.channel]]\nlow_pass_per_s = 30\nhigh_pass_hz = 1', "bank.channel: every channel has a high-pass"),
        (
            "[task.contact.limits]\nforce_max_n = 500",
            "task.contact.limits.force_max_n: should be less than or equal to 400",
        ),
        ('[stop]\ncollision = 3', "stop.collision: should be 0, 1 or 2, not 3"),
        ('[task.contact]\nindex = "d_f"', "task.contact.components: d_f needs at least one of fx, fy, fz, mx, my, mz"),
        ('[task.contact]\ncomponents = ["fx"]', "task.contact.index: components, frame and point_m belong to d_f, not"),
        ('[task.contact]\nindex = "d_f"\ncomponents = ["fq"]', "task.contact.components.0: should be 'fx'"),
        ('[task.none]\nfast = ["fx"]', "task.none.fast: names a component that the task does not explain"),
        ('[[bank.channel]]\nlow_pass_per_s = 30\nof = "sudden"', "bank.channel: a channel of 'sudden' needs"),
        ('[subspace]\ntolerance_nm_per_n = 0.002', "subspace.tolerance_nm_per_n: a soft projector needs at"),
        ('task = 3', "task: should be a table"),
        ('[wire', "not TOML"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_place(write: Write, text: str, message: str) -> None:
    assert refusal(write(f'robot = "ku_dex"\n{text}')).startswith(message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "robot: no robot is named"),
        ("robot = { tool = [0, 0, 0.1] }", "robot.model: is missing"),
        ("robot = 7", "robot: should be a table"),
    ],
)
def test_a_mistake_about_the_robot_is_named(write: Write, text: str, message: str) -> None:
    assert refusal(write(text)).startswith(message)


OWN = """robot = "panda"
[[bank.channel]]
low_pass_per_s = 30
[[bank.channel]]
low_pass_per_s = 60
high_pass_hz = 1
of = "sudden"
[task.none]
threshold_nm = 1.0
[task.payload]
threshold_nm = 1.0
[task.contact]
fast = ["fx", "fy", "fz"]
threshold_nm = [[0.5], [2.0]]
[[task.more]]
name = "screw"
index = "d_f"
components = ["mz", "fz"]
frame = "tool"
point_m = [0.0, 0.1, 0.2]
threshold_nm = [[0.5], [1.0]]
debounce_ticks = 2
[task.more.limits]
mass_max_kg = 3.0
arm_max_m = 0.2
force_slack_n = 25.0
moment_slack_nm = 10.0
force_max_n = 140.0
moment_max_nm = 40.0
"""


def test_a_user_defined_task_is_a_row_with_components_axes_and_a_point(write: Write) -> None:
    configuration = load_configuration(write(OWN))
    assert configuration.settings.task.numbers == {**TASKS, "screw": 4}
    row = np.frombuffer(configuration.block(), block_dtype("float32"))[0]["task"][4]
    assert (row["index"]["kind"], row["index"]["components"], row["index"]["frame"]) == (3, 0b100100, 2)
    axes = row["index"]["axis"]
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(row["index"]["point"]), np.hypot(0.1, 0.2), atol=1e-6)
    assert row["detector"]["channels"] == 0b01  # without fast components it does not use `sudden`
    contact = np.frombuffer(configuration.block(), block_dtype("float32"))[0]["task"][3]
    assert (contact["index"]["fast"], contact["detector"]["channels"]) == (0b111, 0b11)
    Guard(configuration.block())  # and the firmware accepts it


@pytest.mark.parametrize("name", ["panda", "ku_dex", "kinova3"])
def test_a_tasks_tool_axes_are_those_of_the_robots_tip(write: Write, name: str) -> None:
    """A force along an axis of the tool at a point, by Pinocchio's frame of the tip, leaves no index."""
    configuration = load_configuration(write(OWN.replace('"mz", "fz"', '"fz"')), robot=name)
    arm_ = configuration.robot
    core = Core(arm_, config=configuration)
    q = np.linspace(0.3, 0.9, arm_.n) * np.resize([1, -1], arm_.n)
    jacobian = core.terms(q, np.zeros(arm_.n)).jacobian
    pose = tip_pose(arm_, q)
    axis, arm_m = pose[:, 2], pose @ np.array([0.0, 0.1, 0.2])
    for force, least, most in ((axis, 0.0, 0.02), (pose[:, 0], 0.1, 100.0)):
        tau = jacobian.T @ np.concatenate([force, np.cross(arm_m, force)]) * 20.0
        core.reset()
        gravity = core.terms(q, np.zeros(arm_.n)).gravity
        core.step(q, np.zeros(arm_.n), gravity, "screw")
        for _ in range(200):
            step = core.step(q, np.zeros(arm_.n), gravity + tau, "screw")
        assert least <= np.abs(step.index).max() <= most


def tip_pose(arm_: robot.Robot, q: np.ndarray) -> np.ndarray:
    """The tip link's rotation in the base frame, from the description alone."""
    rotation = np.eye(3)
    for joint, angle in zip(arm_.joints, q, strict=True):
        skew = np.cross(np.eye(3), joint.axis)
        rotation = rotation @ joint.origin_rotation
        rotation = rotation @ (np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew)
    return rotation @ arm_.tip_rotation


def test_two_tasks_of_one_name_are_refused(write: Write) -> None:
    assert refusal(write(OWN.replace('"screw"', '"contact"'))).startswith("task.more: two tasks have the same name")


def test_a_contact_of_three_forces_serves_an_arm_with_six_joints(write: Write) -> None:
    path = write('[task.contact]\nindex = "d_f"\ncomponents = ["fx", "fy", "fz"]\n')
    configuration = load_configuration(path, robot=arm(6))
    assert [configuration.settings.task[task].index for task in TASKS] == ["r", "d_p", "d_f"]
    Guard(configuration.block())


def test_a_missing_or_binary_file_is_named(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.toml") == "No such file or directory"
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe")
    assert refusal(binary) == "not a text file in UTF-8"


def test_the_command_writes_the_block_and_prints_its_crc(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "guard.bin"
    arguments = ["config", "paper", "--robot", "ku_dex", "-o", str(out), "--json"]
    configuration = load_configuration("paper", robot="ku_dex")
    assert cli.main([*arguments, "--numeric", "float32"]) == 0
    assert (json.loads(capsys.readouterr().out)["channels"], out.read_bytes()) == (1, configuration.block())
    assert cli.main(arguments) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["channels"] == 2
    assert out.read_bytes() == configuration.block() + configuration.block("q9.22")
    assert summary["crc"] == f"{configuration.crc():08x}"
    assert summary["tasks"]["payload"]["threshold_nm"] == [2.0] * 7


def test_the_table_of_the_command_shows_each_task(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["config", "default", "--robot", "ku_dex"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[2:5]] == list(TASKS)


def test_a_refused_file_leaves_no_block(write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["config", str(write("robot = 1")), "-o", str(tmp_path / "out.bin")]) == 2
    assert not (tmp_path / "out.bin").exists()
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_returned_thresholds_cannot_change_the_configuration() -> None:
    configuration = load_configuration("default", robot="ku_dex")
    before = configuration.block()
    configuration.threshold_nm("none")[:] = 0
    assert configuration.threshold_nm("none").min() > 0
    assert load_configuration("default", robot="ku_dex").block() == before
    assert np.all(configuration.threshold_nm("none") == 1.2)
