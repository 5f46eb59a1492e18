"""`replay --view` and `--rerun` of a bus log show what the log contains."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from bus_logs import WIRE, frames_of, replayed

from tauperp.cli import main
from tauperp.config import load_configuration
from tauperp.firmware import Guard
from tauperp.recording import Recording
from tauperp.replay.showing import LogShow
from tauperp.sim.moment import Moment
from tauperp.view.replay_figure import LogTimeline, beyond_wire
from tauperp.wire import Sender


def test_a_watcher_gets_every_cycle_of_a_log_with_its_pose_and_the_tripped_joint(logs: Path) -> None:
    seen: list[tuple[float, np.ndarray, bool, int]] = []

    def watch(moment: Moment) -> None:
        seen.append((moment.time_s, moment.data.qpos[:7].copy(), moment.permitted, moment.tripped_joint))
        assert len(moment.residual) == len(moment.index) == len(moment.threshold) == 7
        assert (moment.threshold == (2.0 if moment.time_s > 0.05 else moment.threshold[0])).all()  # no task before

    replay = replayed(logs / "fd.log", logs, watch=watch)
    assert len(seen) == replay.comparison.cycles
    times = np.array([time_s for time_s, *_ in seen])
    assert np.allclose(np.diff(times), 0.001)
    poses = {joint: [] for joint in range(7)}
    for frame in frames_of(logs / "fd.log"):
        message = WIRE.by_id[frame.arbitration_id]
        if message.joint:
            poses[message.joint - 1].append(message.decode(frame.data)["Position"])
    for joint, positions in poses.items():
        # The first frame only sets the counter; from the second on each frame gives the joint's position.
        assert np.allclose([pose[joint] for _, pose, *_ in seen][1:], positions[1 : len(seen)])
    (trip,) = replay.comparison.trips
    assert [joint for *_, joint in seen[trip.cycle : trip.cycle + 5]] == [trip.joint] * 5
    assert not any(joint for *_, joint in seen[: trip.cycle])
    assert seen[trip.cycle - 1][2]
    assert not seen[trip.cycle][2]


def test_the_figure_of_a_log_marks_missing_bad_and_frozen_readings() -> None:
    """Joint 3 reports a sensor fault, joint 5 sends nothing, joint 6 sends a wrong CRC, and joint 7 freezes."""
    configuration = load_configuration("paper", robot="ku_dex")
    sender, guard, drawn = Sender(WIRE, fd=True), Guard(configuration.block()), LogTimeline()
    show = LogShow(configuration, drawn.watch)
    torque = np.random.default_rng(2).normal(size=(90, 7))
    torque[30:, 6] = torque[30, 6]
    for cycle in range(90):
        for joint in range(7):
            signals = {"Position": 0.1, "Velocity": 0.0, "Torque": torque[cycle, joint]}
            bad = joint == 2 and cycle == 10
            frame = sender.frame(f"JointState{joint + 1}", {"SensorStatus": 3 if bad else 0, **signals}, cycle=cycle)
            if joint == 5 and cycle == 21:
                frame.data[0] ^= 0xFF
            if not (joint == 4 and cycle == 20):
                show.hear(frame)
        show.show(guard.tick(cycle * 1000), cycle * 1e-3)
    marked = np.argwhere(drawn.unusable[:30]).tolist()
    assert marked == [[10, 2], [20, 4], [21, 5]]
    assert drawn.unusable[32:, 6].all()
    assert not drawn.unusable[30:, :6].any()


def test_a_reading_beyond_the_wire_is_marked_in_a_score() -> None:
    configuration = load_configuration("paper", robot="ku_dex")
    values = np.zeros((5, 7))
    recording = Recording("r", Path("r.csv"), np.arange(5) * 1e-3, values, values.copy(), values.copy(), None)
    recording.q[3, 1] = -5.0
    recording.tau[4, 6] = 1000.0
    assert np.argwhere(beyond_wire(recording, configuration)).tolist() == [[3, 1], [4, 6]]


@pytest.mark.parametrize("kind", ["log", "csv"])
def test_a_replay_has_a_window_or_gives_the_reason(
    logs: Path, tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    log = ["replay", str(logs / "fd.log"), "--scenario", str(logs / "fd.toml")]
    table = tmp_path / "x.csv"
    names = ["time", *(f"{name}{i}" for name in ("q", "dq", "tau_J") for i in range(7))]
    table.write_text("\n".join([",".join(names), *(",".join([str(row), *["0"] * 21]) for row in range(3))]) + "\n")
    csv = ["replay", "--robot", "panda", "--csv", str(table), "--out", str(tmp_path / "out")]
    assert main([*(log if kind == "log" else csv), "--view"]) == 2
    expected = "tauperp: --view needs a display: neither DISPLAY nor WAYLAND_DISPLAY is set\n"
    assert capsys.readouterr() == ("", expected)
    assert not (tmp_path / "out").exists()


def test_only_one_recording_can_be_watched(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", "--robot", "panda", "--csv", "a.csv", "b.csv", "--rerun", str(tmp_path / "x.rrd")]) == 2
    assert "show one recording" in capsys.readouterr().err


@pytest.mark.skipif(
    importlib.util.find_spec("rerun") is None, reason="optional: rerun-sdk (the extra 'rerun') is not installed"
)
def test_rerun_gets_every_cycle_of_a_log(logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "log.rrd"
    assert main(["replay", str(logs / "fd.log"), "--scenario", str(logs / "fd.toml"), "--rerun", str(path)]) == 0
    assert "equal" in capsys.readouterr().out
    content = path.read_bytes()
    assert content[:3] == b"RRF"
    for name in (b"joint1/r_nm", b"joint7/threshold_nm", b"permission", b"robot/links", b"sim_time"):
        assert name in content
