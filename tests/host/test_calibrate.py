"""Calibration: results for arms with known errors, refused recordings, and real recordings."""

import csv
import re
import threading
import time
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest

from tauperp.calibrate import explained, tail
from tauperp.calibrate.calibration import Calibration, calibrate
from tauperp.calibrate.correction import offset_at_rest
from tauperp.calibrate.coverage import coverage
from tauperp.calibrate.joints import check_joints
from tauperp.calibrate.sources import Motion, motion_of_frames, read_motion
from tauperp.cli import main
from tauperp.config import load_configuration
from tauperp.errors import InputError
from tauperp.recording.offsets import weights
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.posture import home
from tauperp.wire import Sender, Wire

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
CASES = Path(__file__).resolve().parents[3] / "shared" / "cases" / "inputs"
ROBOT = load_configuration("default", robot="ku_dex").robot
OFFSET = np.array([0.3, -0.4, 0.1, 0.0, 0.2, -0.1, 0.05])
FRICTION = np.array([0.4, 0.3, 0.2, 0.3, 0.1, 0.2, 0.0])


def wave(seconds: float, seed: int = 1, *, rate_hz: float = 200.0, noise: float = 0.03, scale: float = 0.5) -> Motion:
    """A motion of the arm with known sensor errors."""
    rng = np.random.default_rng(seed)
    dynamics = Dynamics(ROBOT)
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    rates = 2 * np.pi * rng.uniform(0.1, 0.5, (3, 7))
    phases = rng.uniform(0, 2 * np.pi, (3, 7))
    angles = rates[:, None, :] * time_s[None, :, None] + phases[:, None, :]
    amplitude = scale / 3
    q = home(ROBOT, dynamics) + amplitude * np.sin(angles).sum(axis=0)
    qd = amplitude * (rates[:, None, :] * np.cos(angles)).sum(axis=0)
    qdd = -amplitude * (rates[:, None, :] ** 2 * np.sin(angles)).sum(axis=0)
    rotor = np.array([joint.rotor_inertia for joint in ROBOT.joints])
    tau = np.array([dynamics.inverse(*row) for row in zip(q, qd, qdd, strict=True)]) - rotor * qdd
    tau += OFFSET + FRICTION * np.clip(qd / 0.05, -1, 1) + noise * rng.standard_normal(tau.shape)
    velocity = qd + 0.001 * rng.standard_normal(qd.shape)
    return Motion(f"wave{seed}", time_s, q, velocity, tau, False)


def write_table(motion: Motion, path: Path) -> Path:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        names = [f"{name}{joint}" for name in ("q", "dq", "tau_J") for joint in range(7)]
        writer.writerow(["time", *names])
        for row in zip(motion.time_s, motion.q, motion.qd, motion.tau, strict=True):
            writer.writerow([f"{row[0]:.4f}", *(f"{value:.6f}" for part in row[1:] for value in part)])
    return path


@pytest.fixture(scope="module")
def found() -> Calibration:
    return calibrate([wave(60)], load_configuration("default", robot=ROBOT), alarms_per_hour=60, held_out=0.33)


def test_offsets_and_friction_are_found(found: Calibration) -> None:
    assert found.correction.offset_nm == pytest.approx(OFFSET, abs=0.04)
    assert found.correction.friction_nm == pytest.approx(FRICTION, abs=0.05)


def test_the_firmware_subtracts_the_offsets_and_friction_found(found: Calibration) -> None:
    settings = found.configuration.settings.sensor
    assert np.abs(np.array(settings.offset_nm) - OFFSET).max() < 0.04
    largest = found.tasks[0].fitted_maxima.max(axis=0)
    assert (largest < 0.5).all(), "r of a corrected arm is noise"


def test_thresholds_hold_on_motion_of_the_same_kind(found: Calibration) -> None:
    for task in found.tasks:
        assert task.held_alarms <= 1
        assert (task.threshold_nm >= task.fitted_maxima.max(axis=0)).all()


def test_the_promised_alarm_rate_is_no_lower_than_the_held_out_time_supports(found: Calibration) -> None:
    hours = found.tasks[0].held_hours
    assert found.promised_per_hour == pytest.approx(3 / hours)
    assert found.promised_per_hour > found.wanted_per_hour


def test_a_slow_joint_is_named_as_not_covered() -> None:
    motion = wave(30)
    motion.qd[:, 3] *= 0.05
    missing = coverage([motion], ROBOT)["missing"]
    assert any(sentence.startswith("joint 4") and "speed above" in sentence for sentence in missing)


def test_a_joint_whose_torque_has_the_wrong_sign_is_named() -> None:
    motion = wave(20)
    motion.tau[:, 1] *= -1
    with pytest.raises(InputError, match=r"joint 2 .*minus the model's"):
        check_joints([motion], ROBOT)


def test_a_joint_in_another_unit_is_named() -> None:
    motion = wave(20)
    motion.tau[:, 1] *= 1000
    with pytest.raises(InputError, match=r"joint 2 .*another unit"):
        check_joints([motion], ROBOT)


def test_two_swapped_joints_are_named() -> None:
    motion = wave(20)
    for values in (motion.q, motion.qd, motion.tau):
        values[:, [1, 3]] = values[:, [3, 1]]
    with pytest.raises(InputError, match="another order"):
        check_joints([motion], ROBOT)


def test_velocities_in_degrees_are_named() -> None:
    motion = wave(20)
    motion.qd[:] = np.degrees(motion.qd)
    with pytest.raises(InputError, match="degrees a second"):
        check_joints([motion], ROBOT)


@pytest.mark.skipif(not CASES.is_dir(), reason="optional: no cases next to the checkout")
def test_the_cases_of_wrong_sign_and_degrees_are_named() -> None:
    panda = load_configuration("default", robot="panda").robot
    with pytest.raises(InputError, match=r"joint \d .*minus the model's"):
        check_joints(read_motion(CASES / "11-torque-sign-opposite" / "still_sign.csv", 7).untouched_parts(), panda)
    kinova = load_configuration("default", robot="kinova3").robot
    with pytest.raises(InputError, match="in degrees"):
        check_joints([read_motion(CASES / "10-kinova-degrees-0-360" / "kinova_deg360.csv", 7)], kinova)


def test_an_arm_that_moves_gives_no_offsets() -> None:
    motion = wave(5)
    with pytest.raises(InputError, match="at rest"):
        offset_at_rest(motion, motion.tau)


def test_an_arm_that_is_touched_gives_no_offsets() -> None:
    still = wave(5, scale=0.0)
    residual = np.tile(OFFSET, (len(still.q), 1))
    assert offset_at_rest(still, residual) == pytest.approx(OFFSET)
    residual[400:600, 2] += 2.0
    with pytest.raises(InputError, match=r"joint 3 .*touched"):
        offset_at_rest(still, residual)


def test_a_rest_with_a_payload_gives_no_offsets() -> None:
    still = wave(5, scale=0.0)
    loaded = still.corrected(still.tau + 1.2 * weights(Dynamics(ROBOT), still.q[0], ROBOT.gravity)[:, 0])
    with pytest.raises(InputError, match=r"as a payload of \+1\.\d+ kg would"):
        calibrate(
            [wave(20)], load_configuration("default", robot=ROBOT), alarms_per_hour=60, held_out=0.33, rest=loaded
        )


def test_too_short_a_recording_is_refused() -> None:
    with pytest.raises(InputError, match="too little"):
        calibrate([wave(9)], load_configuration("default", robot=ROBOT), alarms_per_hour=1, held_out=0.33)


def test_labelled_touches_are_cut_out() -> None:
    motion = wave(24)
    touched = np.isin(np.arange(len(motion.time_s)), np.arange(2000, 2200))  # from 10 s to 11 s
    torque = motion.tau.copy()
    torque[touched] += 30.0
    pushed = replace(motion, tau=torque, touched=touched)
    before, behind = pushed.untouched_parts()
    assert before.duration_s == pytest.approx(9.7, abs=0.02)
    assert behind.duration_s == pytest.approx(24 - 11.7, abs=0.02)
    found = calibrate(
        [pushed], load_configuration("default", robot=ROBOT), alarms_per_hour=60, held_out=0.33, limits=True
    )
    assert max(float(task.threshold_nm.max()) for task in found.tasks) < 3.0
    assert "22.0 of 24.0 s are clear of touches and used, in 2 parts" in found.notes[0]


def test_proposed_limits_have_a_margin_and_never_exceed_those_in_force(found: Calibration) -> None:
    explains = {one.task: one.explained for one in found.tasks}
    contact, payload = explains["contact"], explains["payload"]
    assert explains["none"] is None
    assert contact is not None
    assert payload is not None
    assert contact.proposed["force_max_n"] == pytest.approx(max(explained.MARGIN * contact.force_n, 5.0), abs=0.06)
    assert payload.proposed["force_slack_n"] <= 25.0
    assert found.configuration.settings.task.contact.limits.force_max_n == 140.0  # not without `limits`
    tight = load_configuration("default", robot=ROBOT, overrides={"task": {"contact": {"limits": {"force_max_n": 2}}}})
    one = explained.explained(np.full((3, 6), 4.0), tight, "contact")
    assert one is not None
    assert one.force_n == pytest.approx(4 * 3**0.5)
    assert one.proposed["force_max_n"] == 2.0
    assert "force_max_n" in one.beyond


def test_the_written_file_keeps_the_installations_own_settings(tmp_path: Path) -> None:
    own = tmp_path / "cell.toml"
    own.write_text(
        'robot = "ku_dex"\n[deadline]\ntick_cycles = 3\n'
        "[[bank.channel]]\nlow_pass_per_s = 30.0\norder = 2\n"
        '[[bank.channel]]\nlow_pass_per_s = 120.0\norder = 2\nhigh_pass_hz = 8.0\nof = "sudden"\n'
        "[task.none]\nthreshold_nm = 1.0\n[task.payload]\nthreshold_nm = 1.0\n"
        '[task.contact]\nthreshold_nm = 1.0\nindex = "d_f"\n'
        'components = ["fx", "fz"]\nfast = ["fx"]\nframe = "tool"\npoint_m = [0.0, 0.0, 0.1]\n'
        "[task.contact.limits]\nforce_max_n = 90.0\n"
    )
    table = write_table(wave(14), tmp_path / "m.csv")
    out = tmp_path / "out"
    assert main(["calibrate", str(table), "--config", str(own), "--out", str(out)]) == 0
    before, after = load_configuration(own), load_configuration(out / "calibration.toml")
    assert after.settings.deadline == before.settings.deadline
    assert after.settings.bank == before.settings.bank
    free = {"threshold_nm": []}
    for task in ("none", "payload", "contact"):
        changed = [one.settings.task[task].model_copy(update=free) for one in (before, after)]
        assert changed[0] == changed[1]
    assert main(["config", str(out / "calibration.toml")]) == 0


def test_a_recording_with_touches_everywhere_gives_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_table(wave(12), tmp_path / "touched.csv")
    lines = path.read_text().splitlines()
    marked = [f"{line},{'label' if k == 0 else int(k % 400 > 300)}" for k, line in enumerate(lines)]
    path.write_text("\n".join(marked) + "\n")
    out = tmp_path / "out"
    assert main(["calibrate", str(path), "--robot", "ku_dex", "--out", str(out)]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert "touched at 1.50 s and 5 more times: no part of 2 s is clear" in errors[-1]
    assert not out.exists()


def test_the_written_file_is_a_configuration(tmp_path: Path) -> None:
    tables = [write_table(wave(25, seed), tmp_path / f"m{seed}.csv") for seed in (1, 2)]
    out = tmp_path / "out"
    assert main(["calibrate", *map(str, tables), "--robot", "ku_dex", "--out", str(out)]) == 0
    assert main(["config", str(out / "calibration.toml")]) == 0
    configuration = load_configuration(out / "calibration.toml")
    assert configuration.settings.wire.rate_hz == pytest.approx(200)
    assert np.array(configuration.settings.sensor.offset_nm) == pytest.approx(OFFSET, abs=0.05)
    assert {path.name for path in out.iterdir()} == {
        "calibration.toml", "calibration.json", "calibration.png", "calibration.html",
    }  # fmt: skip


def test_the_tail_of_known_maxima_is_found() -> None:
    rng = np.random.default_rng(4)
    maxima = rng.gumbel(2.0, 0.3, 4000)
    fitted = tail.fit_tail(maxima)
    assert fitted.quantile(1e-3) == pytest.approx(2.0 - 0.3 * np.log(-np.log(1 - 1e-3)), rel=0.06)
    bounded = tail.fit_tail(rng.uniform(0, 1, 4000))
    assert bounded.quantile(1e-6) < 1.8


def test_the_tail_is_not_extrapolated_beyond_ten_record_lengths() -> None:
    maxima = np.random.default_rng(4).gumbel(2.0, 0.3, (100, 1))
    near, far = (tail.thresholds(maxima, 0.5, rate) for rate in (7.2, 1e-3))
    assert far == pytest.approx(near)


def test_a_term_in_speed_gains_only_where_it_also_holds_in_held_out_data() -> None:
    rng = np.random.default_rng(5)
    speed = rng.uniform(0, 1, (200, 3))
    noise = 0.1 * rng.uniform(0, 1, (200, 3))
    maxima = noise + np.array([1.0, 0.0, 1.0]) * speed
    held = maxima[100:].copy()
    held[:, 2] = 1.0  # as large at low speed: the term found in the first half does not hold here
    gain = tail.speed_gain(maxima[:100], speed[:100], held, speed[100:])
    assert gain[0] == pytest.approx(0.45, abs=0.1)
    assert gain[1] < 0.05
    assert gain[2] == 0.0


def frames_of(motion: Motion) -> list[can.Message]:
    sender = Sender(Wire.read(), fd=False)
    frames = []
    for row in range(len(motion.time_s)):
        at_s = float(motion.time_s[row])
        frames.append(sender.frame("Sync", {"Cycle": row & 0xFFFF}, cycle=row, timestamp=at_s))
        for joint in range(7):
            signals = {
                "SensorStatus": 0,
                "Position": motion.q[row, joint],
                "Velocity": motion.qd[row, joint],
                "Torque": motion.tau[row, joint],
            }
            frames.append(sender.frame(f"JointState{joint + 1}", signals, cycle=row, timestamp=at_s))
    return frames


def test_the_frames_of_a_bus_are_the_same_motion() -> None:
    motion = wave(2)
    frames = frames_of(motion)
    frames[100].data[3] ^= 1  # fails its check: that cycle has no valid reading
    heard = motion_of_frames(frames, 7, "log")
    assert len(heard.time_s) >= len(motion.time_s) - 3
    assert heard.is_mean_torque
    assert heard.q[-1] == pytest.approx(motion.q[-1], abs=1e-4)
    assert heard.tau[-1] == pytest.approx(motion.tau[-1], abs=6e-3)


def test_calibration_works_on_a_live_bus(tmp_path: Path) -> None:
    motion = wave(30)
    done = threading.Event()

    def send() -> None:
        with can.Bus(interface="virtual", channel="calibrate", preserve_timestamps=True) as bus:
            time.sleep(0.5)
            for frame in frames_of(motion):
                bus.send(frame)
            done.set()

    thread = threading.Thread(target=send)
    thread.start()
    arguments = ["--record-for", "8", "--interface", "virtual", "--channel", "calibrate"]
    code = main(["calibrate", *arguments, "--robot", "ku_dex", "--out", str(tmp_path)])
    thread.join()
    assert code == 0
    assert done.is_set()
    assert (tmp_path / "calibration.toml").is_file()


@pytest.mark.skipif(not DATA.is_dir(), reason="optional: no recordings next to the checkout")
@pytest.mark.parametrize(
    ("robot", "files"),
    [
        ("panda_bare", ["panda_free/fast.csv.gz"]),
        (str(DATA / "lwr4_free" / "kuka_lwr4.urdf"), ["lwr4_free/m1.csv.gz", "lwr4_free/m2.csv.gz"]),
    ],
)
def test_real_arms_in_free_motion_stay_below_thresholds_of_the_first_half(robot: str, files: list[str]) -> None:
    motions = [read_motion(DATA / name, 7) for name in files]
    result = calibrate(motions, load_configuration("default", robot=robot), alarms_per_hour=1, held_out=0.5)
    by_task = {task.task: task for task in result.tasks}
    assert by_task["none"].held_alarms == 0
    assert by_task["payload"].held_alarms == 0
    assert result.coverage["missing"]


def test_a_payload_is_named_and_kept_out_of_the_offsets() -> None:
    motion = wave(40)
    dynamics = Dynamics(ROBOT)
    weight = np.array([-dynamics.jacobian(q)[:3].T @ ROBOT.gravity for q in motion.q])
    loaded = motion.corrected(motion.tau + 1.5 * weight)
    result = calibrate([loaded], load_configuration("default", robot=ROBOT), alarms_per_hour=60, held_out=0.33)
    masses = [float(found[1]) for note in result.notes if (found := re.search(r"payload of ([+-][\d.]+) kg", note))]
    assert masses == [pytest.approx(1.5, abs=0.1)]
    assert result.correction.offset_nm == pytest.approx(OFFSET, abs=0.15)
