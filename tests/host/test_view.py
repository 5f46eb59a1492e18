"""`--view` and `--rerun`: what is drawn and written, and the message where nothing can be drawn."""

import contextlib
import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from terminal import Terminal

from tauperp import cli
from tauperp.robot import load
from tauperp.sim.moment import Moment, Puppet
from tauperp.view.rerun_log import rerun_log

STANDING = (0.0, -0.4, 0.0, -2.0, 0.0, 1.8, 0.0)
TURNED = (0.6, -0.4, 0.0, -2.0, 0.0, 1.8, 0.0)
SCENARIO = """
robot = "ku_dex"
[[phase]]
name = "wait"
task = "none"
do = [{ wait_s = 0.2 }]
"""

# The environment selects the renderer when a process starts, so each drawing needs a process of its own.
DRAW = """
import json, sys
from tauperp.sim.moment import Moment, Puppet
from tauperp.robot import load
from tauperp.view.scene import render
import numpy as np
stage, zero = Puppet(load("panda")), np.zeros(7)
for path, position, tripped in json.loads(sys.argv[1]):
    stage.pose(np.array(position), 0.0)
    render(path, Moment(0.0, stage.model, stage.data, not tripped, tripped, zero, zero, zero + 1, 0.0))
"""


def drawing(pictures: list[tuple[str, tuple[float, ...], int]], gl: str) -> "subprocess.CompletedProcess[str]":
    environment = os.environ | {"MUJOCO_GL": gl}
    return subprocess.run(
        [sys.executable, "-c", DRAW, json.dumps(pictures)],
        capture_output=True,
        text=True,
        timeout=120,
        env=environment,
    )


def reds(pixels: np.ndarray) -> int:
    """How many pixels are clearly red."""
    red, green, blue = (pixels[..., channel].astype(float) for channel in range(3))
    return int(((red > 0.4) & (red > 3 * green) & (red > 3 * blue)).sum())


@pytest.mark.needs("osmesa")
def test_a_picture_shows_where_the_arm_is_and_which_joint_tripped(tmp_path: Path) -> None:
    names = [str(tmp_path / f"{name}.png") for name in ("standing", "again", "turned", "tripped")]
    poses = [(names[0], STANDING, 0), (names[1], STANDING, 0), (names[2], TURNED, 0), (names[3], STANDING, 3)]
    done = drawing(poses, "osmesa")
    assert (done.returncode, done.stderr) == (0, "")
    standing, again, turned, tripped = (matplotlib.image.imread(name)[..., :3] for name in names)
    assert standing.shape == (480, 640, 3)
    assert np.array_equal(standing, again)
    assert (np.abs(standing - turned).max(axis=2) > 0.1).mean() > 0.01
    assert reds(standing) == reds(turned) == 0
    assert reds(tripped) > 200
    assert standing.std() > 0.05  # something is visible
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(Path(name).name for name in names)


def test_without_a_renderer_the_message_is_one_line(tmp_path: Path) -> None:
    done = drawing([(str(tmp_path / "a.png"), STANDING, 0)], "off")
    assert done.returncode == 1
    assert "tauperp.errors.InputError: cannot draw off screen: " in done.stderr.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def scenario(tmp_path: Path) -> str:
    path = tmp_path / "wait.toml"
    path.write_text(SCENARIO)
    return str(path)


def test_a_narrow_terminal_shows_every_figure_of_the_table(tmp_path: Path) -> None:
    path = tmp_path / "struck.toml"
    strike = "link = 4\ndirection = [0.0, -1.0, 0.0]\nafter_s = 0.1\nstep = 2\n"
    moves = 'do = [{ wait_s = 0.2 }, { move = "A" }]\n'
    phase = f'[point.A]\noffset_m = [0.0, 0.1, 0.0]\n[[phase]]\ntask = "none"\n{moves}[[phase.strike]]\n{strike}'
    path.write_text(f'robot = "ku_dex"\ntime_limit_s = 1.0\n{phase}')
    with Terminal(["-m", "tauperp.cli", "run", str(path)], 40, 50) as terminal:
        terminal.wait(120)
        text = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", terminal.output)
    assert re.search(r"link 4, \w+ +\d+ N +0\.\d{3} s +0\.\d{3} s +\d+\.\d ms +joint \d", text), text


@pytest.mark.parametrize("missing", ["display", "glfw"])
def test_a_window_that_cannot_open_gives_one_line(
    scenario: str, missing: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if missing == "glfw":
        monkeypatch.setitem(sys.modules, "glfw", None)
        expected = "tauperp: --view needs the extra 'view' (pip install 'tauperp[view]')\n"
    else:
        monkeypatch.delenv("DISPLAY", raising=False)
        monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
        expected = "tauperp: --view needs a display: neither DISPLAY nor WAYLAND_DISPLAY is set\n"
    assert cli.main(["run", scenario, "--view"]) == 2
    assert capsys.readouterr() == ("", expected)


def test_without_its_extra_rerun_gives_one_line_before_the_run(
    scenario: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert cli.main(["run", scenario, "--rerun", str(tmp_path / "x.rrd")]) == 2
    expected = "tauperp: --rerun needs the extra 'rerun' (pip install 'tauperp[rerun]')\n"
    assert capsys.readouterr() == ("", expected)
    assert not (tmp_path / "x.rrd").exists()


needs_rerun = pytest.mark.skipif(
    importlib.util.find_spec("rerun") is None, reason="optional: rerun-sdk (the extra 'rerun') is not installed"
)


@needs_rerun
def test_rerun_gets_every_cycle_of_a_run(scenario: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "deep" / "run.rrd"
    assert cli.main(["run", scenario, "--rerun", str(path)]) == 0
    capsys.readouterr()
    content = path.read_bytes()
    assert content[:3] == b"RRF"
    assert len(content) > 10_000
    for name in (b"joint1/r_nm", b"joint7/threshold_nm", b"permission", b"contact_n", b"robot/links", b"sim_time"):
        assert name in content
    assert [one.name for one in path.parent.iterdir()] == ["run.rrd"]


@needs_rerun
def test_a_run_that_fails_leaves_no_recording(tmp_path: Path) -> None:
    stage, zero = Puppet(load("panda")), np.zeros(7)
    moment = Moment(0.0, stage.model, stage.data, True, 0, zero, zero, zero, 0.0)
    with contextlib.suppress(RuntimeError), rerun_log(tmp_path / "x.rrd") as watch:
        watch(moment)
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []
