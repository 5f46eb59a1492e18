"""The picture and the page of a run show what happened, and need no other file."""

import base64
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tauperp.experiment import Outcome, run_scenario
from tauperp.run.scenario import load_scenario
from tauperp.view.experiment_figure import timeline_of
from tauperp.view.replay_figure import frozen
from tauperp.view.run_page import run_page
from tauperp.view.timeline import Mark, Timeline, draw

LIE = """
robot = "ku_dex"
config = "paper"
time_limit_s = 1.5
[guard.wire]
rate_hz = 500
format = "classic"
[[phase]]
name = "nothing"
task = "none"
do = [{ wait_s = 0.4 }]
[[phase]]
name = "an unannounced payload"
task = "none"
payload = { mass_kg = 2.0 }
do = [{ wait_s = 0.4 }]
[[fault]]
joint = 5
kind = "stuck"
start_s = 0.3
end_s = 0.35
"""


@pytest.fixture(scope="module")
def failed(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    path = tmp_path_factory.mktemp("lie") / "lie.toml"
    path.write_text(LIE)
    return run_scenario(load_scenario(path))


def test_a_failed_run_shows_the_stop_the_joint_and_why(failed: Outcome) -> None:
    (stop,) = failed.report["stops"]
    drawn = timeline_of(failed)
    assert drawn.verdict == "failed"
    assert drawn.coloured == (stop["joint"],)
    assert drawn.stops[0].text.startswith("FALSE STOP: collision")
    assert any("time limit of 1.5 s came before the end: no permission since" in line for line in drawn.why)
    assert drawn.unusable is not None
    marked = drawn.time_s[drawn.unusable[:, 4]]
    assert (marked.min(), marked.max()) == (pytest.approx(0.3), pytest.approx(0.348))
    assert draw(drawn).startswith(b"\x89PNG")


def test_the_page_is_one_file_with_everything_in_it(failed: Outcome) -> None:
    page = run_page(failed)
    assert "FAILED" in page
    assert 'src="data:image/png;base64,' in page
    assert "an unannounced payload" in page
    assert failed.report["hashes"]["firmware"] in page
    assert re.findall(r"(?:src|href)=\"(?!data:)", page) == []


def timeline(index: np.ndarray, stops: tuple[Mark, ...] = (), limit: float = 1.0) -> Timeline:
    rows = len(index)
    return Timeline(
        title="bench", time_s=np.arange(rows) * 1e-3, residual_nm=index, index_nm=index,
        threshold_nm=np.full(index.shape, limit), permitted=np.arange(rows) > 3, stops=stops)  # fmt: skip


def test_the_coloured_joints_are_those_that_stopped_else_the_nearest_to_its_threshold() -> None:
    index = np.zeros((50, 7))
    index[10, 2] = 0.9
    assert timeline(index).coloured == (3,)
    stops = (Mark(0.02, "stop", 6), Mark(0.03, "input", 0), Mark(0.04, "stop", 1))
    assert timeline(index, stops).coloured == (6, 1)


@pytest.mark.parametrize("limit", [0.0, np.inf])
def test_a_time_without_a_task_has_no_threshold_and_can_be_drawn(limit: float) -> None:
    assert draw(timeline(np.zeros((50, 7)), limit=limit)).startswith(b"\x89PNG")


def test_a_channel_that_repeats_while_others_change_is_frozen() -> None:
    torque = np.random.default_rng(5).normal(size=(300, 4))
    torque[100:200, 1] = torque[100, 1]
    found = frozen(torque)
    assert found[:, 1].sum() == pytest.approx(100, abs=1)
    assert not found[:, [0, 2, 3]].any()
    assert not frozen(np.zeros((300, 4))).any()  # an arm at rest with coarse sensors


@pytest.mark.needs("osmesa")
def test_a_report_has_a_film_of_the_stop_without_a_display(tmp_path: Path) -> None:
    scenario = tmp_path / "lie.toml"
    scenario.write_text(LIE)
    drivers = ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL")
    bare = {name: value for name, value in os.environ.items() if name not in drivers}
    command = [sys.executable, "-m", "tauperp.cli", "run", str(scenario), "--report", "--out", str(tmp_path)]
    done = subprocess.run(command, env=bare, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 1, done.stderr
    page = (tmp_path / "lie.html").read_text()
    film = re.search(r'src="data:image/webp;base64,([^"]+)"', page)
    assert film is not None, "There is no film" in page
    with Image.open(io.BytesIO(base64.b64decode(film.group(1)))) as frames:
        assert getattr(frames, "n_frames", 1) > 30
