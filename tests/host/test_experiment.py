"""The paper's two experiments with the compiled firmware meet their requirements and repeat bit for bit."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest

from tauperp.experiment import EXPERIMENTS, load_experiment, run_experiment, run_scenario
from tauperp.run.scenario import Scenario, load_scenario, shipped

COMMAND = [sys.executable, "-m", "tauperp.cli"]
PNG = b"\x89PNG\r\n"
SHORT = """
robot = "ku_dex"
config = "paper"
[guard.wire]
rate_hz = 500
format = "classic"
[point.A]
offset_m = [0.0, 0.2, 0.0]
[[phase]]
task = "none"
do = [{ wait_s = 0.3 }, { move = "A" }]
"""
SENSORS = "[sensors]\ntorque_noise_nm = 0.05\ntorque_offset_nm = 0.05\n"


@pytest.fixture(scope="module")
def demos(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two runs of the demo with the same seeds, side by side."""
    folders = tmp_path_factory.mktemp("first"), tmp_path_factory.mktemp("second")
    runs = [
        subprocess.Popen([*COMMAND, "demo", "--out", str(folder)], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for folder in folders
    ]
    for run in runs:
        output, errors = run.communicate(timeout=600)
        assert run.returncode == 0, (output, errors)
        assert b"on r alone would have stopped the robot" in output
    return folders


def report(folder: Path, name: str) -> dict[str, Any]:
    result: dict[str, Any] = json.loads((folder / f"{name}.json").read_text())
    return result


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_collision_stops_the_robot_and_nothing_else_does(demos: tuple[Path, Path], name: str) -> None:
    result = report(demos[0], name)
    assert result["passed"]
    assert result["finished"]
    assert result["false_stops"] == 0
    assert len(result["collisions"]) == {"payload": 4, "contact": 2}[name]
    for collision in result["collisions"]:
        assert collision["detected"]
        assert collision["latency_ms"] == pytest.approx((collision["stop_s"] - collision["contact_s"]) * 1000, abs=0.01)
        assert 0 < collision["latency_ms"] < 80
        assert 80 < collision["peak_force_n"] < 140
    assert len(result["stops"]) == len(result["collisions"])


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_index_stays_low_where_r_alone_would_have_stopped_the_robot(demos: tuple[Path, Path], name: str) -> None:
    result = report(demos[0], name)
    assert result["peak_index_free_nm"] <= 0.5
    assert result["peak_residual_free_nm"] > 4.0
    assert result["residual_alone"]["false_stops"] >= 1


@pytest.mark.parametrize(("name", "threshold_nm"), [("payload", 2.0), ("contact", 0.5)])
def test_the_published_guard_passes_with_better_sensors(name: str, threshold_nm: float) -> None:
    result = run_experiment(name, load_experiment(name, config="paper", sensors="paper")).report
    assert result["passed"]
    assert result["threshold_nm"] == threshold_nm
    assert result["peak_index_free_nm"] <= 0.5
    assert result["residual_alone"]["first_s"] > 1.0


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_same_seed_gives_the_same_bits(demos: tuple[Path, Path], name: str) -> None:
    first, second = demos
    assert report(first, name)["frames"] > 100_000
    assert (first / f"{name}.json").read_bytes() == (second / f"{name}.json").read_bytes()
    assert (first / f"{name}.png").read_bytes() == (second / f"{name}.png").read_bytes()
    assert (first / f"{name}.png").read_bytes().startswith(PNG)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_result_names_its_versions_and_hashes(demos: tuple[Path, Path], name: str) -> None:
    hashes = report(demos[0], name)["hashes"]
    assert {"firmware", "configuration", "dbc", "mujoco"} <= hashes.keys()
    assert all(hashes.values())
    assert report(demos[0], name)["guard_counters"] == {
        "crc_errors": 0,
        "sequence_errors": 0,
        "lost_frames": 0,
        "range_errors": 0,
        "format_errors": 0,
        "late_frames": 0,
        "resets_refused": 0,
        "trips": len(report(demos[0], name)["collisions"]),
    }


def short(tmp_path: Path, more: str = "") -> Scenario:
    path = tmp_path / "short.toml"
    path.write_text(SHORT + more)
    return load_scenario(path)


def test_another_seed_gives_other_bits(tmp_path: Path) -> None:
    scenario = short(tmp_path, SENSORS)
    frames = [run_scenario(replace(scenario, seed=seed)).report["frames_sha256"] for seed in (1, 2, 1)]
    assert frames[0] == frames[2] != frames[1]


def test_a_strike_too_soft_for_the_threshold_is_reported_as_missed(tmp_path: Path) -> None:
    path = tmp_path / "soft.toml"
    strike = "[[phase.strike]]\nlink = 7\ndirection = [1.0, 0.0, 0.0]\npush_n = 2.0\nspeed_m_s = 0.05\n"
    path.write_text(SHORT.replace("wait_s = 0.3", "wait_s = 3.8") + strike)
    outcome = run_scenario(load_scenario(path))
    (collision,) = outcome.report["collisions"]
    assert collision["contact_s"] is not None
    assert not collision["detected"]
    assert collision["stop_s"] is None
    assert not outcome.passed


def test_a_stop_without_a_collision_is_a_false_stop(tmp_path: Path) -> None:
    """An unknown payload while the task is `none`."""
    lie = '[[phase]]\ntask = "none"\npayload = { mass_kg = 2.0 }\ndo = [{ wait_s = 0.5 }]\n'
    outcome = run_scenario(replace(short(tmp_path, lie), time_limit_s=3.0))
    assert outcome.report["false_stops"] == 1
    assert not outcome.report["finished"]
    assert not outcome.passed


@pytest.mark.parametrize(
    ("kind", "reason"), [("silent", "JOINT_TIMEOUT"), ("status", "SENSOR_STATUS"), ("crc", "JOINT_TIMEOUT")]
)
def test_a_sensor_fault_stops_the_robot_until_the_fault_ends(tmp_path: Path, kind: str, reason: str) -> None:
    fault = f'[[fault]]\njoint = 3\nkind = "{kind}"\nstart_s = 0.8\nend_s = 1.2\nvalue = 2.0\n'
    outcome = run_scenario(short(tmp_path, fault))
    (stop,) = outcome.report["stops"]
    assert (stop["cause"], stop["reason"], stop["joint"]) == ("fault", reason, 3)
    assert stop["time_s"] == pytest.approx(0.8, abs=0.02)
    assert outcome.passed
    assert outcome.report["finished"]
    stood = (outcome.trace.time_s > 1.1) & (outcome.trace.time_s < 1.2)
    assert outcome.trace.tip_speed_m_s[stood].max() < 5e-3


def test_an_event_while_stopped_or_after_the_end_counts_as_not_tested(tmp_path: Path) -> None:
    strike = '[[phase.strike]]\nstep = 1\nafter_s = {}\nlink = {}\npart = "{}"\ndirection = [0.0, 0.6, -0.8]\n'
    fault = '[[fault]]\njoint = 2\nkind = "status"\nvalue = 2.0\nstart_s = {}\nend_s = {}\n'
    more = strike.format(0.2, 4, "forearm") + strike.format(0.35, 3, "hand")
    more += fault.format(0.75, 0.78) + fault.format(60.0, 61.0)
    path = tmp_path / "twice.toml"
    path.write_text(SHORT.replace('wait_s = 0.3 }, { move = "A" }', "wait_s = 1.0 }") + more)
    report = run_scenario(load_scenario(path)).report
    assert [one["verdict"] for one in report["collisions"]] == ["detected", "not tested"]
    assert report["collisions"][1]["why"] == "the arm was stopped already when the hand touched it"
    assert [one["verdict"] for one in report["faults"]] == ["not tested", "not tested"]
    assert report["faults"][1]["why"] == "the run ended before it"
    assert (report["verdict"], report["passed"], report["false_stops"]) == ("incomplete", False, 0)
    assert len(report["why"]) == 3


def test_peaks_are_of_permitted_ticks_without_a_fault_and_permission_is_reported(tmp_path: Path) -> None:
    """An offset of 1.5 Nm stops nothing, and is not a peak of an arm without faults."""
    fault = '[[fault]]\njoint = 3\nkind = "{}"\nstart_s = 0.8\nend_s = 1.0\nvalue = {}\n'
    report = run_scenario(short(tmp_path, fault.format("offset", 1.5))).report
    assert report["peak_residual_free_nm"] < 0.3
    assert report["faults"][0]["verdict"] == "no stop"
    assert len(report["peak_residual_free_by_joint_nm"]) == 7
    assert max(report["peak_residual_free_by_joint_nm"]) == report["peak_residual_free_nm"]
    report = run_scenario(short(tmp_path, fault.format("status", 2.0))).report
    (stop,) = report["stops"]
    spans = report["permission"]
    assert [spans[0]["until_s"], spans[1]["from_s"], spans[1]["until_s"]] == [
        stop["time_s"], stop["permitted_again_s"], None]  # fmt: skip


def test_the_task_switches_without_a_gap_and_without_a_stop(tmp_path: Path) -> None:
    more = '[[phase]]\ntask = "payload"\npayload = { mass_kg = 2.0, com_m = [0.0, 0.0, 0.05] }\n'
    more += 'do = [{ wait_s = 0.5 }]\n[[phase]]\ntask = "contact"\ndo = [{ yield_s = 0.5 }]\n'
    outcome = run_scenario(short(tmp_path, more))
    trace = outcome.trace
    assert outcome.report["stops"] == []
    assert list(dict.fromkeys(trace.task.tolist())) == [1, 2, 3]
    started = int(np.argmax(trace.permitted))
    assert trace.permitted[started:].all()


@pytest.mark.parametrize("suffix", ["log", "asc", "blf"])
def test_a_recording_has_every_frame_at_its_simulated_time(tmp_path: Path, suffix: str) -> None:
    path, record = tmp_path / "short.toml", tmp_path / f"bus.{suffix}"
    path.write_text(SHORT)
    command = [*COMMAND, "run", str(path), "--record", str(record), "--json"]
    run = subprocess.run(command, capture_output=True, timeout=120, check=False)
    assert run.returncode == 0, run.stderr
    frames = list(can.LogReader(record))
    assert len(frames) == json.loads(run.stdout)["frames"]
    syncs = np.array([frame.timestamp for frame in frames if frame.arbitration_id == 0x020])
    assert np.allclose(np.diff(syncs), 0.002, atol=1e-5)
    assert sorted(one.name for one in tmp_path.iterdir()) == sorted(["short.toml", record.name])


def test_a_bus_that_does_not_exist_gives_one_line(tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    command = [*COMMAND, "run", str(path), "--interface", "socketcan", "--channel", "nobus7"]
    run = subprocess.run(command, capture_output=True, timeout=60, check=False, text=True)
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    assert "nobus7" in run.stderr


def test_a_target_out_of_reach_gives_one_line_with_the_step(tmp_path: Path) -> None:
    from tauperp.errors import InputError

    path = tmp_path / "far.toml"
    path.write_text(SHORT.replace("[0.0, 0.2, 0.0]", "[2.0, 0.0, 0.0]"))
    with pytest.raises(InputError, match=r"far\.toml: phase\.0\.do\.1: "):
        run_scenario(load_scenario(path))


@pytest.mark.parametrize(("name", "robot"), [("payload", "panda"), ("contact", "iiwa7")])
def test_other_arms_and_classic_can_pass_too(name: str, robot: str) -> None:
    outcome = run_scenario(load_scenario(shipped(name), robot=robot, rate_hz=500))
    assert outcome.passed
    assert outcome.report["peak_index_free_nm"] <= 0.5
