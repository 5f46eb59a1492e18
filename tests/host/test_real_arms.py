"""Recordings of real arms through the commands of users; skipped where there are no recordings.

Their folder is next to the checkout, or TAUPERP_RECORDINGS names it. Touches of a Panda: test_replay_panda.
"""

import json
import os
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import pytest

from tauperp import cli
from tauperp.files import repository_root

DATA = Path(os.environ.get("TAUPERP_RECORDINGS", repository_root().parent / "shared" / "data"))

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"optional: no recordings in {DATA}")


def calibrated(recording: str, robot: str, out: Path) -> str:
    """The configuration that `tauperp calibrate` makes of one recording."""
    assert cli.main(["calibrate", str(DATA / recording), "--robot", robot, "--out", str(out)]) == 0
    return str(out / "calibration.toml")


def scored(recordings: list[str], config: str, out: Path, *options: str) -> list[dict[str, Any]]:
    """The results of `tauperp score` for each recording."""
    paths = [str(DATA / name) for name in recordings]
    assert cli.main(["score", *paths, "--config", config, "--out", str(out), *options]) in (0, 1)
    files: list[dict[str, Any]] = json.loads((out / "score.json").read_text())["files"]
    return files


def test_strikes_on_a_moving_ur10_are_found_with_thresholds_from_another_file(tmp_path: Path) -> None:
    """Seven strikes by hand, visible in the recording as steps of r of joints 1 to 3; torques from motor currents."""
    try:
        package = distribution("example-robot-data")
    except PackageNotFoundError:
        pytest.skip("the Python package example-robot-data is not installed")
    robot = package.locate_file("cmeel.prefix/share/example-robot-data/robots/ur_description/urdf/ur10_robot.urdf")
    config = calibrated("ur10_collisions/ur10_free.csv.gz", str(robot), tmp_path / "c")
    names = ["ur10_collisions/ur10_free.csv.gz", "ur10_collisions/ur10_wrist.csv.gz"]
    free, struck = scored(names, config, tmp_path / "s")
    assert (free["alarms_idle"], free["faults"]) == (0, [])
    strikes = (4.8, 7.6, 11.4, 15.3, 19.4, 23.0, 26.6)
    stops = [alarm["stop_s"] for alarm in struck["alarms"]]
    print(f"{len(stops)} stops at {stops}")
    for strike in strikes:
        assert any(abs(stop - strike) < 0.5 for stop in stops), f"the strike at {strike} s was not found"
    assert all(any(abs(stop - strike) < 0.8 for strike in strikes) for stop in stops), "a stop without a strike"
    assert struck["permitted_share"] > 0.8


def test_an_unknown_load_on_a_ur10e_does_not_move_the_payload_index(tmp_path: Path) -> None:
    """Calibrated without a load. With 2.6 kg in the gripper r is above its thresholds most of the time, d_p never."""
    config = calibrated("ur10e_load/ur10e_20_01_31-unload.csv.gz", str(DATA / "ur10e_load/ur10e.urdf"), tmp_path / "c")
    load = ["ur10e_load/ur10e_20_01_31-load.csv.gz"]
    (none,) = scored(load, config, tmp_path / "none")
    (payload,) = scored(load, config, tmp_path / "payload", "--task", "payload")
    print(f"above: r {none['above_threshold_share']:.1%}, d_p {payload['above_threshold_share']:.1%}")
    assert none["above_threshold_share"] > 0.3
    assert none["permitted_share"] < 0.6
    assert payload["above_threshold_share"] < 0.01
    assert payload["permitted_share"] > 0.9


def test_the_bank_finds_more_pushes_into_free_motion_than_a_single_gain(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Thresholds from the first half, pushes into the second; the observer at K = 50 on the same signals."""
    (tmp_path / "plan.toml").write_text(
        'robot = "panda_bare"\ncollisions = 400\ntasks = ["none"]\n'
        f'[recording]\nfiles = ["{DATA / "panda_free" / "fast.csv.gz"}"]\n'
    )
    assert cli.main(["campaign", str(tmp_path / "plan.toml"), "--out", str(tmp_path / "out")]) == 0
    content = json.loads((tmp_path / "out" / "report.json").read_text())
    (task,) = content["tasks"]
    assert task["contact"] is None
    assert "identified" not in capsys.readouterr().out
    guard, *others = task["detectors"]
    single = next(one for one in others if one["detector"] == "threshold on r, K = 50")
    print(f"guard {guard['rate']:.1%}, {single['detector']} {single['rate']:.1%}")
    assert task["rate"] > 0.9
    assert guard["rate_low"] > single["rate_high"]
    assert task["latency_ms"]["p50"][0] < 50
    assert guard["false_moves"] == 0
