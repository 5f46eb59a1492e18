"""The smallest detected force agrees with a campaign and with geometry."""

import contextlib
import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from plain import one_channel, plain

from tauperp.campaign import draw
from tauperp.campaign.plan import read_plan
from tauperp.cli import main
from tauperp.config import TASKS, TaskName
from tauperp.intervals import wilson
from tauperp.kernel import layout
from tauperp.kernel.bench import Bench
from tauperp.sensitivity.analysis import Levers, analyse, directions
from tauperp.sensitivity.response import Prober, smallest_pulse, smallest_static
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.model import geom_name
from tauperp.sim.posture import home
from tauperp.view import sensitivity_window
from tauperp.view.sensitivity_figure import BLIND_RGBA

CONFIGURATION = one_channel("ku_dex")
HOME = home(CONFIGURATION.robot, Dynamics(CONFIGURATION.robot))
RUNS = 150


def test_directions_are_unit_vectors_spread_evenly() -> None:
    ways = directions()
    assert np.linalg.norm(ways, axis=1) == pytest.approx(1)
    assert ways.mean(axis=0) == pytest.approx(0, abs=0.01)
    assert ((ways @ ways.T) - 2 * np.eye(len(ways))).max(axis=1).min() > 0.9


def test_without_a_task_the_smallest_static_force_is_threshold_over_lever() -> None:
    response = Prober(CONFIGURATION).measure(HOME, "none")
    assert response.settled == pytest.approx(np.eye(7), abs=0.02)
    levers = np.array([[0.5, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0.1, 0.2, 0, 0], [0.0] * 7])
    threshold = CONFIGURATION.threshold_nm("none")
    forces = smallest_static(response, levers, threshold)
    assert forces[:2] == pytest.approx([threshold[0] / 0.5, threshold[4] / 0.2], rel=0.02)
    assert forces[2] > 1e3


def test_a_short_push_has_to_be_harder_than_a_static_one() -> None:
    response = Prober(CONFIGURATION).measure(HOME, "none")
    lever = np.full((1, 7), 0.2)
    threshold = CONFIGURATION.threshold_nm("none")
    static = smallest_static(response, lever, threshold)[0]
    once, twice = (smallest_pulse(response, lever, threshold, debounce)[0] for debounce in (1, 20))
    gain = 50.0  # 1/s: peak of a half-sine of 50 ms through a first-order low-pass
    time = np.arange(0, 0.2, 1e-5)
    answer = np.zeros_like(time)
    for k in range(1, len(time)):
        force = np.sin(np.pi * time[k] / 0.05) if time[k] < 0.05 else 0.0
        answer[k] = answer[k - 1] + 1e-5 * gain * (force - answer[k - 1])
    assert once == pytest.approx(static / answer.max(), rel=0.03)
    assert twice > once


ONE_FILTER = """
robot = "ku_dex"
[bank]
channel = []
[task]
none.threshold_nm = 1.0
payload.threshold_nm = 0.8
contact = { threshold_nm = 0.5, fast = [] }
"""
BANK = """
robot = "ku_dex"
[task]
none.threshold_nm = 1.0
payload.threshold_nm = 0.8
contact = { threshold_nm = 0.5, fast = [] }
[[bank.channel]]
low_pass_per_s = 30.0
order = 2
[[bank.channel]]
low_pass_per_s = 120.0
order = 2
high_pass_hz = 3.0
"""


@pytest.mark.parametrize("bank", [ONE_FILTER, BANK], ids=["one filter", "bank"])
@pytest.mark.parametrize("task", list(TASKS))
def test_a_campaign_of_pushes_agrees_with_the_sensitivity(task: TaskName, bank: str, tmp_path: Path) -> None:
    """Pushes of 50 ms on an arm at rest with ideal sensors: the share that is found is the predicted one."""
    plan_file = tmp_path / "plan.toml"
    (tmp_path / "guard.toml").write_text(bank)
    plan_file.write_text(
        'configuration = "guard.toml"\ncollisions = 1\nmodel_error = 0.0\n[thresholds]\nfrom = "configuration"\n'
        "[motion]\nkinds = ['rest']\n[sensors]\ntorque_noise_nm = 0.0\n"
        "[collision]\nkinds = ['pulse']\npush_ms = 50.0\nforce_n = [2.0, 60.0]\n"
        "[payload]\nmass_kg = 0.0\n[guide]\nforce_n = 0.0\nmoment_nm = 0.0\n"
    )
    plan = read_plan(plan_file)
    runs = draw.draw(plan, task, draw.HIT, 0, RUNS)
    results = Bench([plan.configuration], []).simulate(runs)
    assert (results["status"] == layout.DONE).all()
    found = np.isfinite(results["stop_s"])
    prober, levers = Prober(plan.configuration), Levers(plan.configuration.robot)
    threshold, debounce = plan.configuration.thresholds_nm(task), plan.configuration.settings.task[task].debounce_ticks
    needed = np.empty(RUNS)
    for k, run in enumerate(runs):
        posture = run["start"][:7]
        levers.place(posture)
        torque = (run["direction"] @ levers.at(int(run["link"]), run["point"]))[None]
        needed[k] = smallest_pulse(prober.measure(posture, task), torque, threshold, debounce)[0]
    predicted = runs["force_n"] > needed
    low, high = wilson(int(found.sum()), RUNS)
    assert low <= predicted.mean() <= high
    far = np.abs(np.log(runs["force_n"] / needed)) > 0.25
    assert (found[far] == predicted[far]).mean() > 0.97, "each run agrees, except close to the limit"


def test_forces_that_the_contact_task_explains_are_reported_as_blind() -> None:
    forces = analyse(plain("ku_dex"), HOME[None], ["none", "contact"])
    last = [task.links[-1] for task in forces]
    assert last[0].report()["blind_share"] < 0.05
    assert last[1].report()["blind_share"] > 0.9
    assert last[1].report()["regions"]["hand"]["quasi_static"] < 0.05


def test_the_command_writes_page_figure_and_json(tmp_path: Path) -> None:
    pose = ",".join(f"{value:g}" for value in HOME)
    assert main(["sensitivity", "--robot", "ku_dex", "--task", "none", "--pose", pose, "--out", str(tmp_path)]) == 0
    content = json.loads((tmp_path / "sensitivity.json").read_text())
    assert [task["task"] for task in content["tasks"]] == ["none"]
    assert content["limits"]["chest"] == 140
    assert "ISO/TS 15066" in (tmp_path / "sensitivity.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--pose", "0,0"], "2 numbers for 7 joints"),
        (["--pose", "9,0,0,0,0,0,0"], "outside"),
        (["--pose", "a,b"], "not a list of numbers"),
        (["--workspace", "0"], "not in 1 to"),
        (["--trajectory", "nowhere.csv"], "nowhere.csv"),
    ],
)
def test_bad_input_gives_one_line(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sensitivity", "--robot", "ku_dex", "--out", str(tmp_path / "out"), *arguments]) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert message in errors
    assert not (tmp_path / "out").exists()


def test_the_window_has_the_colours_of_the_figure_and_an_arrow_per_link(monkeypatch: pytest.MonkeyPatch) -> None:
    configuration, posture = plain("ku_dex"), HOME
    (contact,) = analyse(configuration, posture[None], ["contact"])
    seen: dict[str, object] = {}

    class Handle:
        cam = mujoco.MjvCamera()

        def __init__(self, model: mujoco.MjModel) -> None:
            self.user_scn = mujoco.MjvScene(model, 100)

        def __enter__(self) -> "Handle":
            return self

        def __exit__(self, *_: object) -> None:
            seen["arrows"] = self.user_scn.ngeom

        def lock(self) -> contextlib.nullcontext[None]:
            return contextlib.nullcontext()

        def is_running(self) -> bool:
            return False

    class Viewer:
        @staticmethod
        def launch_passive(model: mujoco.MjModel, data: mujoco.MjData, **_: object) -> Handle:
            seen["last"] = model.geom(geom_name(6)).rgba.copy()
            seen["posture"] = data.qpos[:7].copy()
            return Handle(model)

    monkeypatch.setattr(sensitivity_window, "viewer", Viewer)
    sensitivity_window.show(configuration.robot, posture, contact)
    assert seen["arrows"] == 7
    assert seen["last"] == pytest.approx(BLIND_RGBA), "the contact task is blind to the last link"
    assert seen["posture"] == pytest.approx(posture)


def test_a_window_without_a_display_is_refused_before_the_work(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert main(["sensitivity", "--robot", "ku_dex", "--view", "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.startswith("tauperp: --view needs ")
    assert not (tmp_path / "out").exists()
