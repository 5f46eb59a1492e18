"""A campaign: the same bits at any number of threads, resumable, and physics that agree with statics."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tauperp.campaign import draw
from tauperp.campaign.execute import Campaign
from tauperp.campaign.plan import read_plan
from tauperp.campaign.store import Store
from tauperp.campaign.work import shards, thresholds_of
from tauperp.cli import main
from tauperp.config import load_configuration
from tauperp.kernel import layout
from tauperp.kernel.bench import Bench
from tauperp.kernel.detectors import Detector
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.posture import home

SMALL = """
robot = "ku_dex"
collisions = 24
free_moves = 40
tasks = ["none", "payload"]
shard_runs = 8
"""


def write_plan(folder: Path, text: str = SMALL) -> Path:
    path = folder / "plan.toml"
    path.write_text(text)
    return path


def run(plan_path: Path, folder: Path, jobs: int) -> dict[str, bytes]:
    plan = read_plan(plan_path)
    Campaign(plan, Store(folder, plan, {})).run(lambda share, phase: None, jobs=jobs)
    return contents(folder)


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "shards").iterdir())}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, bytes]]:
    """A plan, and the files of a campaign that nothing interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    path = write_plan(folder)
    return path, run(path, folder / "out", 1)


def test_the_results_are_the_same_bits_at_any_number_of_threads(whole: tuple[Path, dict], tmp_path: Path) -> None:
    assert run(whole[0], tmp_path, 3) == whole[1]


def test_a_killed_campaign_resumes_and_ends_with_the_same_files(whole: tuple[Path, dict], tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tauperp.cli", "campaign", str(whole[0]), "--out", str(tmp_path), "--jobs", "1"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 120
    while len(list(tmp_path.glob("shards/*.parquet"))) < 3 and process.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    process.kill()
    process.wait()
    done = len(contents(tmp_path))
    assert done < len(whole[1]), "it ended before it could be killed"
    broken = tmp_path / "shards" / "hit-none-00000000.parquet"
    broken.write_bytes(whole[1][broken.name][:1000])  # as after a power failure
    for half_written in (tmp_path / "shards").glob(".*"):
        half_written.unlink()
    assert run(whole[0], tmp_path, 2) == whole[1]


def test_ctrl_c_ends_a_campaign_at_once_and_leaves_only_complete_files(tmp_path: Path) -> None:
    path = write_plan(tmp_path, SMALL.replace("collisions = 24", "collisions = 4000"))
    command = [sys.executable, "-m", "tauperp.cli", "campaign", str(path), "--out", str(tmp_path / "out")]
    process = subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    end = time.monotonic() + 120
    while len(list(tmp_path.glob("out/shards/hit-*"))) < 2 and process.poll() is None and time.monotonic() < end:
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert all(not path.name.startswith(".") for path in (tmp_path / "out" / "shards").iterdir())


def test_another_plan_in_the_same_folder_is_refused(whole: tuple[Path, dict], tmp_path: Path) -> None:
    out = tmp_path / "out"
    Store(out, read_plan(whole[0]), {}).claim()
    other = write_plan(tmp_path, SMALL + "seed = 2\n")
    assert main(["campaign", str(other), "--out", str(out)]) == 2


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ("[payload]\nmass_kg = -1.0", "payload.mass_kg"),
        ("[payload]\nmass_kg = [3.0, 1.0]", "payload.mass_kg"),
        ("[collision]\nforce_n = [0.0, 20.0]", "collision.force_n"),
        ("[collision]\nlinks = [2, 9]", "collision.links"),
        ("[collision]\nparts = ['tail']", "collision"),
        ("[motion]\nduration_s = 0.6", "motion.duration_s"),
        ("[thresholds]\nfrom = 'nowhere'", "thresholds.from"),
        ("[sensors]\nsmell = 1.0", "sensors"),
        ("colisions = 3", "colisions"),
    ],
)
def test_a_bad_plan_gives_one_line_and_nothing_is_written(
    change: str, place: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = f"{change}\n{SMALL}" if change.startswith("colisions") else f"{SMALL}{change}\n"
    assert main(["campaign", str(write_plan(tmp_path, text)), "--out", str(tmp_path / "out")]) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert place in errors
    assert not (tmp_path / "out").exists()


def test_a_full_disk_gives_one_line_and_leaves_no_incomplete_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    written = 0

    def full(handle: int) -> None:
        nonlocal written
        written += 1
        if written > 2:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("tauperp.files.os.fsync", full)
    assert main(["campaign", str(write_plan(tmp_path)), "--out", str(tmp_path / "out")]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert len(contents(tmp_path / "out")) == 1


def test_a_missing_cluster_gives_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("tauperp.campaign.execute.CONNECT_S", 1)
    plan = write_plan(tmp_path)
    code = main(["campaign", str(plan), "--out", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:9"])
    assert code == 2
    assert "no Dask scheduler answers" in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "out").exists()


def test_a_cluster_that_loses_a_worker_gives_the_same_files(whole: tuple[Path, dict], tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        killed = False

        def kill_one(share: float, phase: str) -> None:
            nonlocal killed
            if share > 0.5 and not killed:
                killed = True
                worker = next(iter(cluster.workers.values()))
                os.kill(worker.pid, signal.SIGKILL)

        plan = read_plan(whole[0])
        Campaign(plan, Store(tmp_path, plan, {})).run(kill_one, scheduler=cluster.scheduler_address)
        assert killed
    assert contents(tmp_path) == whole[1]


def test_a_shard_holds_the_same_runs_alone_and_with_others(whole: tuple[Path, dict]) -> None:
    plan = read_plan(whole[0])
    together = draw.draw(plan, "payload", draw.HIT, 0, 24)
    alone = draw.draw(plan, "payload", draw.HIT, 16, 8)
    assert together[16:].tobytes() == alone.tobytes()


def test_every_run_of_a_plan_is_in_exactly_one_shard(whole: tuple[Path, dict]) -> None:
    plan = read_plan(whole[0])
    for stage, span in (("calibrate", range(20)), ("free", range(20, 40)), ("hit", range(24))):
        numbers = [
            number
            for shard in shards(plan, (stage,))
            if shard.task == "none"
            for number in range(shard.first, shard.first + shard.count)
        ]
        assert numbers == list(span)


def still_run(force_n: float, link: int, direction: np.ndarray) -> np.ndarray:
    """One arm at rest with ideal sensors, and a long push on a link."""
    runs = np.zeros(1, layout.RUN)
    robot = load_configuration("default", robot="ku_dex").robot
    one = runs[0]
    one["start"][:7] = one["goal"][:7] = home(robot, Dynamics(robot))
    one["move_s"], one["duration_s"] = 1.0, 3.0
    one["mass_scale"], one["sensors"]["gain"] = 1.0, 1.0
    one["motion"], one["push"], one["obeys"], one["task"] = layout.REST, layout.PULSE, 0, 1
    one["link"], one["direction"], one["force_n"] = link - 1, direction, force_n
    one["push_s"], one["onset_s"] = 2.0, 0.5
    return runs


def test_the_residual_of_a_slow_push_is_the_force_times_its_lever() -> None:
    configuration = load_configuration("paper", robot="ku_dex")
    unit_thresholds = [Detector(f"joint {joint}", "residual", np.full(7, 1e9)) for joint in range(7)]
    for joint, detector in enumerate(unit_thresholds):
        detector.threshold_nm[joint] = 1.0
    bench = Bench([configuration], unit_thresholds)
    force = 20.0 * np.array([0.6, 0.0, -0.8])
    dynamics = Dynamics(configuration.robot)
    posture = home(configuration.robot, dynamics)
    wrist = np.zeros((3, 7))
    import mujoco

    dynamics.tip(posture)
    body = dynamics._model.body(configuration.robot.joints[5].name).id
    mujoco.mj_jac(dynamics._model, dynamics._data, wrist, None, dynamics._data.xpos[body], body)
    expected = np.abs(wrist.T @ force)
    result = bench.simulate(still_run(20.0, 6, force / 20.0))[0]
    assert result["status"] == layout.DONE
    assert np.allclose(result["during"][:7], expected, rtol=0.03, atol=0.05)


def test_an_arm_without_errors_has_no_residual_in_motion(tmp_path: Path) -> None:
    plan = read_plan(write_plan(tmp_path, SMALL + "model_error = 0.0\n[sensors]\ntorque_noise_nm = 0.01\n"))
    runs = draw.draw(plan, "none", draw.FREE, 0, 10)
    bench = Bench([plan.configuration], [Detector("r", "residual", np.ones(7))])
    results = bench.simulate(runs)
    assert (results["status"] == layout.DONE).all()
    assert results["tip_speed_m_s"].min() == 0.0
    assert results["free_max"][:, 0].max() < 0.15


def test_the_planned_link_is_struck_with_about_the_planned_force(tmp_path: Path) -> None:
    plan = read_plan(write_plan(tmp_path, SMALL + "[collision]\nkinds = ['contact']\nlinks = [3, 6]\n"))
    runs = draw.draw(plan, "none", draw.HIT, 0, 20)
    bench = Bench([plan.configuration], [])
    results = bench.simulate(runs)
    touched = results[np.isfinite(results["onset_s"])]
    assert len(touched) >= 15
    planned = runs["link"][np.isfinite(results["onset_s"])] + 1
    assert (touched["link"] == planned).mean() > 0.7
    assert (touched["peak_force_n"] > 5.0).all()
    assert (touched["peak_force_n"] < 600.0).all()


def test_the_wanted_share_of_moves_exceeds_the_thresholds() -> None:
    maxima = np.abs(np.random.default_rng(3).standard_normal((500, 7))) * np.arange(1, 8)
    for share in (0.01, 0.05):
        threshold = thresholds_of(maxima, share)
        above = (maxima > threshold).any(axis=1).mean()
        assert above <= share
        assert above >= share / 2
