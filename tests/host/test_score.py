"""A score states its basis: the source of the offsets, gaps, what was tested, and why something was not."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tauperp import cli
from tauperp.config import Configuration, load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Core, Reason
from tauperp.recording import Playback, Recording, Score, find_offsets, play, read_recording, score
from tauperp.recording.offsets import weights
from tauperp.recording.playback import _Bus
from tauperp.recording.score import faults
from tauperp.recording.timeline import timeline
from tauperp.sim.dynamics import Dynamics
from tauperp.wire import Receiver

PERIOD_S = 0.005
POSE = np.array([0.06, 0.69, -0.08, -1.62, 0.03, 2.29, 0.85])
OFFSET = np.array([-0.5, 0.3, -0.2, 0.4, 0.1, 0.1, -0.3])

Change = Callable[[np.ndarray, np.ndarray, np.ndarray], None]


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    return load_configuration("replay_panda")


def still(seconds: float = 4.0, touched: list[tuple[float, float]] | None = None, push_nm: float = 5.0) -> Recording:
    """An arm at rest at POSE; joint 2 is pushed in the labelled times."""
    time = np.arange(0.0, seconds, PERIOD_S)
    q = np.tile(POSE, (len(time), 1))
    tau = np.tile(Core("panda").terms(POSE, np.zeros(7)).gravity + OFFSET, (len(time), 1))
    label = None
    if touched is not None:
        label = np.zeros(len(time), bool)
        for begin, end in touched:
            label |= (time >= begin) & (time < end)
        tau[label, 1] += push_nm
    return Recording("made", Path("made.csv"), time, q, np.zeros_like(q), tau, label)


def moving(seconds: float = 8.0, payload_kg: float = 0.0) -> Recording:
    """A slow motion of every joint through many postures, without a rest."""
    robot = load_configuration("replay_panda").robot
    dynamics = Dynamics(robot)
    time = np.arange(0.0, seconds, PERIOD_S)
    rates = 2 * np.pi * np.array([0.21, 0.23, 0.29, 0.31, 0.37, 0.41, 0.43])
    amplitude = np.array([0.9, 0.5, 0.9, 0.6, 0.9, 0.8, 0.9])
    q = POSE + amplitude * np.sin(np.outer(time, rates))
    qd = amplitude * rates * np.cos(np.outer(time, rates))
    qdd = -amplitude * rates**2 * np.sin(np.outer(time, rates))
    rotor = np.array([joint.rotor_inertia for joint in robot.joints])
    tau = np.array([dynamics.inverse(*row) for row in zip(q, qd, qdd, strict=True)]) - rotor * qdd + OFFSET
    if payload_kg:
        tau += np.stack([weights(dynamics, row, robot.gravity)[:, 0] for row in q]) * payload_kg
    return Recording("moving", Path("moving.csv"), time, q, qd, tau, None)


def scored(recording: Recording, configuration: Configuration, **options: object) -> tuple[Playback, Score]:
    playback = play(recording, configuration, **options)  # type: ignore[arg-type]
    return playback, score(playback)


# --- offsets ------------------------------------------------------------------------------------------------------


def test_offsets_come_from_a_rest_anywhere_in_the_recording(configuration: Configuration) -> None:
    recording = still(5.0)
    recording.qd[:400, 2] = 0.3  # moves for two seconds
    found = find_offsets(recording, configuration)
    assert found.source == "rest"
    assert "2.00 to 3.00 s" in found.told
    np.testing.assert_allclose(found.nm, OFFSET, atol=1e-4)


def test_offsets_do_not_come_from_an_unlabelled_touch(configuration: Configuration) -> None:
    recording = still(5.0)
    recording.tau[100:150, 1] += 5.0
    found = find_offsets(recording, configuration)
    np.testing.assert_allclose(found.nm, OFFSET, atol=1e-4)
    assert float(found.told.rpartition("rest, ")[2].split()[0]) >= 0.74


def test_without_a_rest_there_are_no_offsets_and_the_report_states_it(configuration: Configuration) -> None:
    recording = still(3.0)
    recording.qd[:, 2] = 0.1
    found = find_offsets(recording, configuration)
    assert (found.source, found.nm.tolist()) == ("zero", [0.0] * 7)
    assert "never rests" in found.told
    with pytest.raises(InputError, match="never rests untouched"):
        find_offsets(recording, configuration, "rest")


def test_a_rest_with_a_payload_gives_no_offsets(configuration: Configuration) -> None:
    recording = still()
    recording.tau[:] += 0.8 * weights(Dynamics(configuration.robot), POSE, configuration.robot.gravity)[:, 0]
    for choice in (None, "rest"):
        with pytest.raises(InputError, match=r"payload of \+0\.\d+ kg"):
            find_offsets(recording, configuration, choice)


def test_torques_of_the_wrong_sign_are_not_taken_as_offsets(configuration: Configuration) -> None:
    recording = still()
    recording.tau[:] *= -1
    with pytest.raises(InputError, match="is its sign wrong"):
        find_offsets(recording, configuration)


@pytest.mark.parametrize("payload_kg", [0.0, 1.5])
def test_a_regression_separates_offsets_from_a_payload(configuration: Configuration, payload_kg: float) -> None:
    found = find_offsets(moving(payload_kg=payload_kg), configuration, "regression")
    np.testing.assert_allclose(found.nm, OFFSET, atol=0.1)
    assert f"payload of {payload_kg:+.1f}"[:-1] in found.told or payload_kg == 0.0


def test_a_regression_in_one_posture_is_refused(configuration: Configuration) -> None:
    recording = still(8.0)
    recording.qd[:, 6] = 0.2
    with pytest.raises(InputError, match="too similar"):
        find_offsets(recording, configuration, "regression")


def test_a_calibrated_configuration_has_its_own_offsets(configuration: Configuration, tmp_path: Path) -> None:
    own = configuration.changed(sensor={"offset_nm": OFFSET.tolist(), "friction_nm": [0.0]})
    playback, result = scored(still(3.0, touched=[(2.0, 2.5)]), own)
    assert playback.offsets.source == "calibration"
    assert (playback.offset_nm == 0).all()
    assert not faults([result])
    file = tmp_path / "cell.toml"
    file.write_text(
        f'robot = "panda"\npreset = "replay_panda"\n[sensor]\noffset_nm = {OFFSET.tolist()}\nfriction_nm = [0.0]\n'
    )
    np.testing.assert_allclose(find_offsets(still(), configuration, str(file)).nm, OFFSET)
    with pytest.raises(InputError, match="has no"):
        find_offsets(still(), configuration, "calibration")


# --- gaps ---------------------------------------------------------------------------------------------------------


def without(recording: Recording, first: int, last: int) -> Recording:
    keep = np.ones(len(recording.time_s), bool)
    keep[first:last] = False
    touched = None if recording.touched is None else recording.touched[keep]
    parts = (part[keep] for part in (recording.time_s, recording.q, recording.qd, recording.tau))
    return Recording(recording.name, recording.path, *parts, touched)


def test_a_short_gap_is_bridged_and_reported(configuration: Configuration) -> None:
    playback, result = scored(without(still(), 500, 503), configuration)
    (gap,) = playback.timeline.gaps
    assert (gap.bridged, gap.missing, gap.start_s) == (True, 3, pytest.approx(499 * PERIOD_S))
    assert gap.length_s == pytest.approx(4 * PERIOD_S)
    assert (playback.trips, playback.counters["lost_frames"]) == ((), 0)
    assert not faults([result])


def test_a_long_gap_splits_and_a_new_guard_starts(configuration: Configuration) -> None:
    playback, result = scored(without(still(), 400, 500), configuration)
    assert playback.timeline.starts == (0, 400)
    assert playback.timeline.report()["split"] == 1
    assert playback.permitted[399]
    assert not playback.permitted[400:420].any()
    assert playback.permitted[-1]
    assert result.idle_s < 3.6  # the gap does not count as watched time


def test_every_gap_splits_if_none_may_be_bridged(configuration: Configuration) -> None:
    assert timeline(without(still(), 500, 503), bridge_ms=0.0).starts == (0, 500)


def test_uneven_steps_are_not_gaps() -> None:
    recording = still()
    recording.time_s[:] += np.random.default_rng(3).uniform(-0.45, 0.45, len(recording.time_s)) * PERIOD_S
    assert not [gap for gap in timeline(recording).gaps if not gap.bridged]
    assert (np.diff(timeline(recording).cycle) >= 1).all()


# --- what was tested ----------------------------------------------------------------------------------------------


def test_a_guard_that_never_permits_is_a_bad_verdict(configuration: Configuration) -> None:
    recording = still(3.0)
    recording.tau[::2, 1] += 4.0  # from the first row on
    _, result = scored(recording, configuration, offsets="zero")
    assert (result.permitted_share, result.above_share) == (0.0, pytest.approx(1.0))
    assert "nothing was tested" in faults([result])[0]


def test_a_task_that_is_off_is_a_bad_verdict_and_named(configuration: Configuration) -> None:
    off = configuration.changed(
        task={
            "contact": {
                **configuration.settings.task.contact.model_dump(),
                "index": "off",
                "fast": [],
                "threshold_nm": [],
            }
        }
    )
    _, result = scored(still(2.0), off, task="contact")
    assert result.permitted_s == 0
    assert faults([result]) == [
        "nothing was tested: the guard never permitted motion (TASK_INVALID)",
        *result.faults[1:],
    ]


def test_a_touch_while_the_guard_is_stopped_counts_as_not_tested(configuration: Configuration) -> None:
    recording = still(4.0, touched=[(2.0, 2.3), (2.35, 2.4)])
    _, result = scored(recording, configuration)
    assert (len(result.found), len(result.missed)) == (1, 1)
    (untested,) = result.untested
    assert untested.reason == Reason.COLLISION
    assert untested.since_s == pytest.approx(2.02, abs=0.03)
    assert "1 of the others because the guard was still stopped" in faults([result])[-1]


def test_an_excess_counts_whether_or_not_the_guard_is_stopped(configuration: Configuration) -> None:
    recording = still(4.0)
    recording.tau[400:600, 1] += 5.0  # one second without a label
    playback, result = scored(recording, configuration)
    share = configuration.threshold_nm("none")[1] / 5.0
    (channel,) = configuration.settings.bank.channel
    rise_s, fall_s = -math.log(1 - share) / channel.low_pass_per_s, -math.log(share) / channel.low_pass_per_s
    assert result.above_s == pytest.approx(1.0 - rise_s + fall_s, abs=0.015)
    assert result.largest_share[1] == pytest.approx(1 / share, rel=0.02)
    assert result.largest_index_nm[1] == pytest.approx(5.0, rel=0.02)
    assert len(result.alarms) == 1
    assert result.permitted_share < 0.75
    assert playback.permitted.mean() == pytest.approx(result.permitted_share, abs=0.01)


def test_a_range_stop_names_quantity_value_and_limit(configuration: Configuration) -> None:
    recording = still()
    recording.qd[400, 3] = 2.5
    _, result = scored(recording, configuration)
    assert (
        result.input_stops[0].detail == "joint 4 (panda_joint4): velocity 2.5 rad/s is above its limit of 2.175 rad/s"
    )
    assert "velocity 2.5 rad/s" in result.faults[0]


def test_a_factor_per_joint_and_an_acceleration_are_mapped(tmp_path: Path, configuration: Configuration) -> None:
    recording = still(2.5, touched=[(2.0, 2.3)])
    factor = np.array([10.0, 8.0, 5.0, 4.0, 2.0, 1.0, 0.5])
    currents = Recording("c", Path("c.csv"), recording.time_s, recording.q, recording.qd, recording.tau / factor, None)
    table = write(currents, tmp_path / "c.csv")
    lines = table.read_text().splitlines()
    table.write_text("\n".join([lines[0] + ",ax,ay,az", *(line + ",0.1,0,-0.05" for line in lines[1:])]) + "\n")
    (tmp_path / "map.toml").write_text(
        f"[torque]\nfactor = {factor.tolist()}\n"
        '[acceleration]\ncolumns = ["ax", "ay", "az"]\nunit = "g"\n[label]\ncolumn = "label"\n'
    )
    read = read_recording(table, 7, tmp_path / "map.toml")
    np.testing.assert_allclose(read.tau, recording.tau, atol=1e-5)
    assert read.acceleration is not None
    assert read.acceleration[-1] == pytest.approx([0.980665, 0.0, -0.4903325])
    sent: list[float] = []
    receiver, wire = Receiver(configuration.wire), configuration.wire.message("TaskCommand")
    bus = _Bus(read, configuration, "payload")
    for frame in (one for cycle in (3, 4) for one in bus.frames(3, cycle, np.zeros((7, 3)), None)):
        if frame.arbitration_id == wire.id and (received := receiver.receive(frame)) and received.signals:
            sent = [received.signals[name] for name in ("AccelX", "AccelY", "AccelZ")]
    assert sent == pytest.approx([0.98, 0.0, -0.49], abs=0.02)
    (tmp_path / "map.toml").write_text("[torque]\nfactor = [1.0, 2.0]\n")
    with pytest.raises(InputError, match=r"torque\.factor: 2 factors for 7 joints"):
        read_recording(table, 7, tmp_path / "map.toml")


# --- the command --------------------------------------------------------------------------------------------------


def write(recording: Recording, path: Path) -> Path:
    label = np.zeros(len(recording.time_s)) if recording.touched is None else recording.touched
    columns = ["time", *(f"{kind}{i}" for kind in ("q", "dq", "tau_J") for i in range(7)), "label"]
    values = np.column_stack([recording.time_s, recording.q, recording.qd, recording.tau, label])
    np.savetxt(path, values, "%.7f", ",", header=",".join(columns), comments="")
    return path


@pytest.mark.parametrize("command", [["score"], ["replay", "--csv"]])
def test_one_refused_file_does_not_end_the_batch(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = write(still(3.0, touched=[(2.0, 2.5)]), tmp_path / "good.csv")
    loaded = still(3.0)
    loaded.tau[:, 1] -= 9.0
    bad = write(loaded, tmp_path / "bad.csv")
    out = tmp_path / "out"
    arguments = [*command, bad, good, tmp_path / "none.csv", "--robot", "panda", "--out", out, "--json"]
    assert cli.main([str(argument) for argument in arguments]) == 2
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    assert [row["file"] for row in content["files"]] == ["good"]
    assert [Path(row["file"]).name for row in content["refused"]] == ["bad.csv", "none.csv"]
    assert [line.startswith("tauperp: ") for line in printed.err.splitlines()] == [True, True]
    assert (content["verdict"], content["found"]) == ("good", 1)
    assert content["files"][0]["offsets"]["from"] == "rest"
    assert sorted(path.name for path in out.iterdir()) == ["good.png", "score.json"]


def test_a_score_of_nothing_tested_is_exit_code_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = write(still(3.0), tmp_path / "x.csv")
    arguments = ["score", str(table), "--robot", "panda", "--offsets", "zero", "--out", str(tmp_path / "out")]
    config = tmp_path / "tight.toml"
    config.write_text('robot = "panda"\npreset = "replay_panda"\n[task.none]\nthreshold_nm = 0.2\n')
    assert cli.main([*arguments, "--config", str(config)]) == 1
    assert "verdict: bad; nothing was tested" in capsys.readouterr().out
