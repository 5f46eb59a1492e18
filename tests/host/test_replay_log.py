"""Bus logs: recorded by a run, read with their damage found, and compared with the firmware frame by frame."""

import gzip
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import can
import pytest

from tauperp.cli import main
from tauperp.config import load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Guard, Reason
from tauperp.replay.buslog import BusLog
from tauperp.replay.log_report import LogReplay, replay_log
from tauperp.replay.origin import look_ahead
from tauperp.replay.recorder import bus_recorder
from tauperp.wire import COUNTER_MASK, Wire

SCENARIO = """
robot = "ku_dex"
config = "paper"
guard = { observer = { gain_per_s = 45.0 }, wire = { rate_hz = RATE, format = "FORMAT" } }
[point.A]
offset_m = [0.0, 0.1, 0.0]
[[phase]]
task = "payload"
do = [{ wait_s = 0.3 }, { move = "A" }]
[[phase.strike]]
step = 2
link = 4
direction = [0.0, 1.0, 0.0]
"""
WIRE = Wire.read()
STOP, STATUS, INDEX = (WIRE.message(name).id for name in ("StopCommand", "GuardStatus", "GuardIndex"))
RESET = WIRE.message("GuardReset").id


def scenario(folder: Path, form: str) -> Path:
    path = folder / f"{form}.toml"
    rate = {"fd": "1000", "classic": "500"}[form]
    path.write_text(SCENARIO.replace("RATE", rate).replace("FORMAT", form))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scenario with one collision, run once in either frame format and recorded as candump does."""
    folder = tmp_path_factory.mktemp("logs")
    for form in ("fd", "classic"):
        assert main(["run", str(scenario(folder, form)), "--record", str(folder / f"{form}.log"), "--json"]) == 0
    return folder


def frames_of(path: Path) -> list[can.Message]:
    log = BusLog(path)
    frames = list(log)
    assert log.damage is None
    return frames


def written(path: Path, frames: Iterable[can.Message]) -> Path:
    with can.Logger(path) as logger:
        for frame in frames:
            logger(frame)
    return path


def replayed(path: Path, folder: Path, form: str = "fd") -> LogReplay:
    return replay_log(path, scenario=str(folder / f"{form}.toml"))


def counts(replay: LogReplay) -> tuple[int, int, int]:
    """Equal, different and missing frames."""
    counts = replay.comparison.counts.values()
    return sum(one.equal for one in counts), sum(one.different for one in counts), sum(one.missing for one in counts)


# --- recording ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log", ".asc.gz", ".log.gz"])
@pytest.mark.parametrize("form", ["fd", "classic"])
def test_a_recording_holds_every_frame_of_both_directions_in_simulated_time(
    folder: Path, tmp_path: Path, form: str, suffix: str
) -> None:
    expected = frames_of(folder / f"{form}.log")
    path = tmp_path / f"again{suffix}"
    with bus_recorder(path, fd=form == "fd") as listener:
        assert listener is not None
        for frame in expected:
            listener(frame)
    got = frames_of(path)
    assert len(got) == len(expected)
    for one, other in zip(got, expected, strict=True):
        assert (one.arbitration_id, one.data, one.is_fd) == (other.arbitration_id, other.data, other.is_fd)
        assert one.timestamp == pytest.approx(other.timestamp, abs=1.1e-6)
    assert {STOP, STATUS, INDEX, WIRE.message("Sync").id, WIRE.message("JointState7").id} <= {
        frame.arbitration_id for frame in got
    }
    period = {"fd": 0.001, "classic": 0.002}[form]
    syncs = [frame.timestamp for frame in got if frame.arbitration_id == WIRE.message("Sync").id]
    assert syncs == pytest.approx([k * period for k in range(len(syncs))], abs=1.1e-6)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("there.log", "there.log: is there already"),
        ("x.trc", ".trc holds no CAN FD frames; use .asc, .blf, .log"),
        ("x.db", ".db holds no CAN FD frames"),
        ("x.png", "python-can writes no '.png'"),
        ("x", "python-can writes no ''"),
        ("x.blf.gz", "python-can does not pack .blf"),
        ("there.log/x.log", "there.log/x.log: "),
    ],
)
def test_a_recording_that_cannot_be_is_one_line_before_the_run(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, message: str
) -> None:
    (tmp_path / "there.log").write_text("precious")
    begin = time.monotonic()
    assert main(["run", str(folder / "fd.toml"), "--record", str(tmp_path / name)]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert message in output.err
    assert [one.name for one in tmp_path.iterdir()] == ["there.log"]
    assert (tmp_path / "there.log").read_text() == "precious"
    assert time.monotonic() - begin < 20


def test_a_run_that_fails_leaves_no_recording(tmp_path: Path) -> None:
    def fail() -> None:
        with bus_recorder(tmp_path / "x.blf", fd=True) as listener:
            assert listener is not None
            listener(can.Message(arbitration_id=STOP))
            raise InputError("in the middle")

    with pytest.raises(InputError, match="in the middle"):
        fail()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log"])
def test_ctrl_c_keeps_a_readable_file_of_what_was_before(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"x{suffix}"
    frame = can.Message(arbitration_id=STOP, is_extended_id=False, data=bytes(8), is_fd=True)

    def interrupted() -> None:
        with bus_recorder(path, fd=True) as listener:
            assert listener is not None
            for number in range(1000):
                if number == 500:
                    os.kill(os.getpid(), signal.SIGINT)
                listener(frame)

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert len(frames_of(path)) == 500
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


def test_ctrl_c_of_the_command_keeps_its_recording(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    command = [sys.executable, "-m", "tauperp.cli", "run", str(folder / "fd.toml"), "--record", str(path)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    try:
        while not (parts := [one for one in tmp_path.iterdir() if one.stat().st_size > 0]):
            assert process.poll() is None, process.stderr.read().decode() if process.stderr else ""
            time.sleep(0.02)
        assert parts != [path]
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130, error.decode()
    assert b"Traceback" not in error
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    assert replayed(path, folder).equal


# --- comparing ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log"])
@pytest.mark.parametrize("form", ["fd", "classic"])
def test_a_lockstep_log_is_repeated_bit_for_bit_with_nothing_masked(
    folder: Path, tmp_path: Path, form: str, suffix: str
) -> None:
    frames = frames_of(folder / f"{form}.log")
    replay = replayed(written(tmp_path / f"x{suffix}", frames), folder, form)
    ours = sum(frame.arbitration_id in (STOP, STATUS, INDEX) for frame in frames)
    assert counts(replay) == (ours, 0, 0)
    assert replay.equal
    assert replay.comparison.masked == {}
    assert replay.comparison.origin.lockstep
    assert not replay.comparison.origin.joined
    assert replay.comparison.cycles == replay.comparison.compared_cycles == ours // 2
    (trip,) = replay.comparison.trips
    assert trip.reason == Reason.COLLISION
    assert abs(trip.index_nm) > trip.threshold_nm == 2.0


def test_one_bit_anywhere_in_the_guards_frames_is_found(folder: Path, tmp_path: Path) -> None:
    seed = random.randrange(2**32)
    print(f"seed {seed}")
    rng = random.Random(seed)
    frames = frames_of(folder / "fd.log")
    for message in (STOP, STATUS, INDEX):
        at = rng.choice([i for i, frame in enumerate(frames) if frame.arbitration_id == message and i > 400])
        bit = rng.randrange(64)
        data = bytearray(frames[at].data)
        data[bit // 8] ^= 1 << bit % 8
        changed = can.Message(
            timestamp=frames[at].timestamp, arbitration_id=message, is_extended_id=False, is_fd=True, data=data
        )
        path = written(tmp_path / f"{message}.log", [*frames[:at], changed, *frames[at + 1 :]])
        replay = replayed(path, folder)
        first = replay.comparison.first
        print(message, at, bit, first)
        assert counts(replay)[1:] == (1, 0)
        assert first is not None
        assert first.message == WIRE.by_id[message].name
        assert first.time_s == pytest.approx(frames[at].timestamp)
        assert first.our_data == frames[at].data.hex()
        assert first.logged_data == data.hex()
        assert first.logged.keys() == first.ours.keys()


def test_an_input_that_was_another_one_is_found(folder: Path, tmp_path: Path) -> None:
    """The guard in the log got a frame that is not in it: what it did then is not what its log says."""
    frames = frames_of(folder / "fd.log")
    joint = WIRE.message("JointState2").id
    at = next(i for i, frame in enumerate(frames) if frame.arbitration_id == joint and frame.timestamp > 0.4)
    replay = replayed(written(tmp_path / "x.log", frames[:at] + frames[at + 1 :]), folder)
    assert not replay.equal
    first = replay.comparison.first
    assert first is not None
    assert first.time_s >= frames[at].timestamp


def test_a_frame_of_the_guard_that_the_log_lacks_is_missing(folder: Path, tmp_path: Path) -> None:
    frames = frames_of(folder / "fd.log")
    at = next(i for i, frame in enumerate(frames) if frame.arbitration_id == INDEX and frame.timestamp > 0.2)
    replay = replayed(written(tmp_path / "x.log", frames[:at] + frames[at + 1 :]), folder)
    assert counts(replay)[1:] == (0, 1)
    assert not replay.equal


def test_an_invented_frame_of_the_guard_is_a_difference(folder: Path, tmp_path: Path) -> None:
    frames = frames_of(folder / "fd.log")
    at = next(i for i, frame in enumerate(frames) if frame.arbitration_id == INDEX and frame.timestamp > 0.2)
    replay = replayed(written(tmp_path / "x.log", [*frames[: at + 1], frames[at], *frames[at + 1 :]]), folder)
    assert counts(replay)[1:] == (1, 0)
    assert replay.comparison.first is not None
    assert replay.comparison.first.our_data == ""


def test_frames_of_others_are_counted_and_change_nothing(folder: Path, tmp_path: Path) -> None:
    frames = frames_of(folder / "fd.log")
    other = can.Message(timestamp=0.1, arbitration_id=0x123, is_extended_id=False, data=bytes(8))
    error = can.Message(timestamp=0.1, is_error_frame=True)
    replay = replayed(written(tmp_path / "x.log", [*frames[:999], other, error, *frames[999:]]), folder)
    assert replay.equal
    assert replay.comparison.foreign_frames >= 1


def test_a_log_that_begins_in_the_middle_is_compared_from_where_both_guards_are_the_same(
    folder: Path, tmp_path: Path
) -> None:
    seed = random.randrange(2**32)
    print(f"seed {seed}")
    rng = random.Random(seed)
    frames = frames_of(folder / "fd.log")
    for cut in rng.sample(range(200, 2000), 3):
        replay = replayed(written(tmp_path / f"{cut}.log", frames[cut:]), folder)
        one = replay.comparison
        print(cut, one.cycles, one.compared_cycles, one.first)
        assert one.origin.joined
        assert one.cycles - 600 < one.compared_cycles < one.cycles - 400  # 20 / K is 0.44 s
        assert {"TripNumber", "CrcErrors"} <= one.masked.keys()
        assert "Counter" not in one.masked
        assert replay.equal
        assert [trip.reason for trip in one.trips] == [Reason.COLLISION]


def test_a_log_that_begins_after_a_trip_has_its_resets_renumbered(folder: Path, tmp_path: Path) -> None:
    """Two runs, the second of a guard that goes on counting: trip 2 is trip 1 of a guard that joins."""
    configuration = replayed(folder / "fd.log", folder).comparison.configuration
    inputs = [frame for frame in frames_of(folder / "fd.log") if frame.arbitration_id not in (STOP, STATUS, INDEX)]
    sync = WIRE.message("Sync").id
    guard, frames, cycle = Guard(configuration.block()), [], 0
    shift = 0.001 * len([frame for frame in inputs if frame.arbitration_id == sync])
    for round_ in range(2):
        for number, frame in enumerate(inputs):
            if frame.arbitration_id == sync and number:
                frames += guard.tick(cycle * 1000).frames
                cycle += 1
            data = bytearray(frame.data)
            if frame.arbitration_id == RESET and round_:
                data[2] = 2
                WIRE.message("GuardReset").seal(data, data[1] & COUNTER_MASK)
            sent = can.Message(
                timestamp=frame.timestamp + round_ * shift,
                arbitration_id=frame.arbitration_id,
                is_extended_id=False,
                is_fd=True,
                data=data,
            )
            frames.append(sent)
            guard.receive(sent, cycle * 1000)
    stops = [i for i, frame in enumerate(frames) if frame.arbitration_id == STOP and frame.data[5] == 1]
    permitted = next(i for i in stops if frames[i].data[2] == 0xE1)
    replay = replayed(written(tmp_path / "x.log", frames[permitted:]), folder)
    print(replay.comparison.first, counts(replay), replay.comparison.trips)
    assert Reason.COLLISION in [trip.reason for trip in replay.comparison.trips]
    assert replay.equal
    assert replay.comparison.compared_cycles > 2000


def test_a_guard_that_waited_before_the_log_begins_needs_no_mask(folder: Path, tmp_path: Path) -> None:
    """Its counters and pages are those of a guard after so many ticks without a robot."""
    configuration = replayed(folder / "fd.log", folder).comparison.configuration
    inputs = [f for f in frames_of(folder / "fd.log")[:8000] if f.arbitration_id not in (STOP, STATUS, INDEX)]
    guard, frames = Guard(configuration.block()), []
    for tick in range(1237):
        guard.tick(tick * 1000)
    cycle = 1237
    for number, frame in enumerate(inputs):
        if frame.arbitration_id == WIRE.message("Sync").id and number:
            frames += guard.tick(cycle * 1000).frames
            cycle += 1
        guard.receive(frame, cycle * 1000)
        frames.append(frame)
    replay = replayed(written(tmp_path / "x.log", frames), folder)
    assert replay.comparison.origin.ticks_before == 1237 % 224
    assert not replay.comparison.origin.joined
    assert replay.comparison.masked == {}
    assert replay.equal


def test_what_a_real_clock_measured_is_masked_and_nothing_else(folder: Path, tmp_path: Path) -> None:
    """The same guard ticked with measured tick times, and its frames at times that jitter."""
    seed = random.randrange(2**32)
    print(f"seed {seed}")
    rng = random.Random(seed)
    configuration = replayed(folder / "fd.log", folder).comparison.configuration
    inputs = [f for f in frames_of(folder / "fd.log")[:7000] if f.arbitration_id not in (STOP, STATUS, INDEX)]
    guard, frames, period = Guard(configuration.block()), [], 0
    for number, frame in enumerate(inputs):
        now_us = 5_000_000 + period * 1000 + 3 * (number % 12)
        if frame.arbitration_id == WIRE.message("Sync").id and number:
            now_us = 5_000_000 + period * 1000 + rng.randrange(400, 600)
            answers = guard.tick(now_us).frames
            guard.note_tick_time(rng.randrange(4, 200))
            for answer in answers:
                answer.timestamp = (now_us + 1) * 1e-6
            frames += answers
            period += 1
            now_us = 5_000_000 + period * 1000
        frame.timestamp = now_us * 1e-6
        guard.receive(frame, now_us)
        frames.append(frame)
    replay = replayed(written(tmp_path / "x.log", frames), folder)
    assert set(replay.comparison.masked) == {"TickTime", "WorstTickTime", "DeadlineMargin"}
    assert not replay.comparison.origin.lockstep
    print(replay.comparison.first)
    assert replay.equal


def test_what_only_the_board_saw_is_taken_from_the_log(folder: Path, tmp_path: Path) -> None:
    configuration = replayed(folder / "fd.log", folder).comparison.configuration
    inputs = [f for f in frames_of(folder / "fd.log")[:8000] if f.arbitration_id not in (STOP, STATUS, INDEX)]
    guard, frames, cycle = Guard(configuration.block()), [], 0
    for number, frame in enumerate(inputs):
        if frame.arbitration_id == WIRE.message("Sync").id and number:
            if cycle == 400:
                guard.trip(Reason.BUS_OFF)
            frames += guard.tick(cycle * 1000).frames
            cycle += 1
        guard.receive(frame, cycle * 1000)
        frames.append(frame)
    replay = replayed(written(tmp_path / "x.log", frames), folder)
    assert [trip.reason for trip in replay.comparison.trips] == [Reason.BUS_OFF]
    assert replay.equal


def test_another_build_of_the_firmware_masks_its_number_and_says_so(folder: Path, tmp_path: Path) -> None:
    frames = frames_of(folder / "fd.log")
    message = WIRE.message("GuardStatus")
    for frame in frames:
        if frame.arbitration_id == STATUS and frame.data[1] >> 4 == 4:
            frame.data[6] ^= 0xFF
            message.seal(frame.data, frame.data[1] & COUNTER_MASK)
    replay = replayed(written(tmp_path / "x.log", frames), folder)
    assert replay.comparison.masked == dict.fromkeys(("FirmwareVersion", "BuildId"), "another build of the firmware")
    assert replay.equal


# --- the configuration --------------------------------------------------------------------------------------------


def test_another_configuration_is_one_line_that_names_both(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    origin = look_ahead(BusLog(folder / "fd.log"), WIRE, folder)[1]
    other = load_configuration("paper", robot="panda")
    assert main(["replay", str(folder / "fd.log"), "--config", "paper", "--robot", "panda"]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert f"configuration {origin.config_crc:08x}, paper is {other.crc():08x}" in output.err


def test_a_configuration_that_is_shipped_is_found_by_its_crc(tmp_path: Path) -> None:
    configuration = load_configuration(
        "paper", robot="panda", overrides={"wire": {"rate_hz": 500, "format": "classic"}}
    )
    guard = Guard(configuration.block())
    frames = [frame for tick in range(40) for frame in guard.tick(tick * 2000).frames]
    replay = replay_log(written(tmp_path / "x.blf", frames))
    assert replay.comparison.configuration.crc() == configuration.crc()
    assert replay.equal


def test_a_configuration_that_is_not_shipped_has_to_be_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(folder / "fd.log")]) == 2
    error = capsys.readouterr().err
    assert "which is no shipped preset's: name the file with --config" in error
    assert error.count("\n") == 1


# --- the command --------------------------------------------------------------------------------------------------


def test_the_command_prints_what_was_compared_and_its_verdict_is_the_exit_code(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = ["--scenario", str(folder / "fd.toml")]
    assert main(["replay", str(folder / "fd.log"), *name]) == 0
    table = capsys.readouterr().out
    assert "COLLISION" in table
    assert "\nequal\n" in table
    frames = frames_of(folder / "fd.log")
    at = next(i for i, frame in enumerate(frames) if frame.arbitration_id == STOP and frame.timestamp > 0.2)
    frames[at].data[4] = Reason.COLLISION
    bad = written(tmp_path / "bad.log", frames)
    assert main(["replay", str(bad), *name]) == 1
    table = capsys.readouterr().out
    assert "first difference at 0.201000 s, cycle 201, StopCommand" in table
    assert main(["replay", str(bad), *name, "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["messages"]["StopCommand"]["different"] == 1
    assert report["first_difference"]["logged"] == {"Reason": "Collision"}
    assert report["first_difference"]["ours"]["Reason"] != "Collision"
    assert report["equal"] is False


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "either one bus log or"),
        (["x.log", "--csv", "x.csv"], "either one bus log or"),
        (["x.log", "--map", "m.toml"], "--map goes with recordings"),
        (["--csv", "x.csv", "--scenario", "payload"], "--scenario goes with bus logs"),
        (["x.log", "--scenario", "payload", "--config", "paper"], "either --config or --scenario"),
        (["none.log"], "none.log: No such file or directory"),
        (["x.csv.png"], "python-can reads no '.png'"),
    ],
)
def test_bad_arguments_are_one_line(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", *arguments]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert message in output.err


# --- damage -------------------------------------------------------------------------------------------------------


def cut_blf(path: Path) -> int:
    """In the middle of the second container, which is compressed."""
    data = path.read_bytes()
    at = data.index(b"LOBJ", data.index(b"LOBJ") + 100) + 5000
    path.write_bytes(data[:at])
    return at


def corrupt_blf(path: Path) -> None:
    data = bytearray(path.read_bytes())
    at = data.index(b"LOBJ", data.index(b"LOBJ") + 100) + 5000
    data[at : at + 50] = bytes(50)
    path.write_bytes(data)


def garbage_line(path: Path) -> None:
    lines = path.read_text().splitlines()
    lines[5000] = lines[5000][:30] + "??"
    path.write_text("\n".join(lines) + "\n")


def foreign_line(path: Path) -> None:
    lines = path.read_text().splitlines()
    lines[5000] = "the dog ate the next frames"
    path.write_text("\n".join(lines) + "\n")


def short_data(path: Path) -> None:
    """A data byte is cut in two."""
    lines = path.read_text().splitlines()
    lines[5000] = lines[5000].split("##")[0] + "##10"
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    ("suffix", "damage", "place"),
    [
        (".blf", cut_blf, "byte "),
        (".blf", corrupt_blf, "byte "),
        (".asc", garbage_line, "line 5001, after 4995 frames"),
        (".asc", foreign_line, "line 5001, after 4995 frames"),
        (".log", garbage_line, "line 5001, after 5000 frames"),
        (".log", foreign_line, "line 5001, after 5000 frames"),
        (".log", short_data, "line 5001, after 5000 frames"),
    ],
)
def test_a_damaged_log_is_reported_up_to_its_damage(
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    suffix: str,
    damage: Callable[[Path], object],
    place: str,
) -> None:
    path = written(tmp_path / f"x{suffix}", frames_of(folder / "fd.log"))
    damage(path)
    assert main(["replay", str(path), "--scenario", str(folder / "fd.toml"), "--json"]) == 2
    output = capsys.readouterr()
    report = json.loads(output.out)
    assert output.err.count("\n") == 1
    assert f"{path}: {place}" in output.err
    assert report["damage"] is not None
    assert report["equal"] is False
    assert report["cycles"] > 90
    assert report["first_difference"] is None
    assert report["messages"]["StopCommand"]["equal"] == report["cycles"]
    assert main(["replay", str(path), "--scenario", str(folder / "fd.toml")]) == 2
    assert "StopCommand" in capsys.readouterr().out


def test_the_byte_where_a_cut_blf_ends_is_told_and_its_last_container_is_read_as_far_as_it_goes(
    folder: Path, tmp_path: Path
) -> None:
    path = written(tmp_path / "x.blf", frames_of(folder / "fd.log"))
    at = cut_blf(path)
    log = BusLog(path)
    whole_containers = 2 * 128 * 1024 // 112  # bytes of a CAN FD frame's object: an upper bound of one and a part
    frames = list(log)
    assert log.damage is not None
    assert f"byte {at}, after {len(frames)} frames: the file ends in the middle of an object" in str(log.damage)
    assert 1500 < len(frames) <= whole_containers
    assert [frame.data for frame in frames] == [frame.data for frame in frames_of(folder / "fd.log")[: len(frames)]]


def test_a_blf_that_ends_between_two_containers_is_cut_too(folder: Path, tmp_path: Path) -> None:
    path = written(tmp_path / "x.blf", frames_of(folder / "fd.log"))
    data = path.read_bytes()
    path.write_bytes(data[: data.index(b"LOBJ", data.index(b"LOBJ") + 100)])
    log = BusLog(path)
    assert len(list(log)) > 1000
    assert "the file ends here, its header announces" in str(log.damage)


def test_a_blf_with_an_object_of_no_size_ends(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.blf"
    with can.BLFWriter(path, compression_level=0) as writer:
        for frame in frames_of(folder / "fd.log")[:100]:
            writer(frame)
    data = bytearray(path.read_bytes())
    at = data.index(b"LOBJ", data.index(b"LOBJ") + 4 + 2000)
    data[at + 8 : at + 12] = bytes(4)
    path.write_bytes(data)
    log = BusLog(path)
    list(log)
    assert "ends where it begins" in str(log.damage)


def test_a_gzipped_log_that_is_cut_says_so(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.log.gz"
    path.write_bytes(gzip.compress((folder / "fd.log").read_bytes())[:20_000])
    log = BusLog(path)
    assert len(list(log)) > 100
    assert "line" in str(log.damage)


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log", ".trc", ".csv", ".db"])
@pytest.mark.parametrize("content", ["empty", "png", "text"])
def test_a_file_that_is_no_log_is_one_line(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str, content: str
) -> None:
    path = tmp_path / f"x{suffix}"
    picture = bytes.fromhex("89504e470d0a1a0a0000000d49484452") + bytes(range(256)) * 20
    path.write_bytes({"empty": b"", "png": picture, "text": b"Dear diary,\ntoday we\n"}[content])
    assert main(["replay", str(path), "--scenario", str(folder / "fd.toml")]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert str(path) in output.err


def test_a_log_without_a_guard_is_one_line(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frames = [frame for frame in frames_of(folder / "fd.log") if frame.arbitration_id != STOP]
    assert main(["replay", str(written(tmp_path / "x.log", frames[:3000]))]) == 2
    assert "no StopCommand in its first 3000 frames" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log"])
def test_no_broken_log_hangs_or_has_a_traceback(folder: Path, tmp_path: Path, suffix: str) -> None:
    seed = random.randrange(2**32)
    print(f"seed {seed}")
    rng = random.Random(seed)
    whole = written(tmp_path / f"whole{suffix}", frames_of(folder / "fd.log")[:600]).read_bytes()
    path = tmp_path / f"x{suffix}"
    for _ in range(60):
        data = bytearray(whole)
        for _ in range(rng.choice([1, 3, 30])):
            data[rng.randrange(len(data))] = rng.randrange(256)
        path.write_bytes(data[: rng.choice([len(data), rng.randrange(len(data))])])
        log, count, refusal = BusLog(path), 0, str(path)
        try:
            count = sum(1 for _ in log)
        except InputError as error:
            refusal = str(error)
        assert count <= 700
        assert refusal.startswith(str(path))


@pytest.mark.skipif(shutil.which("log2asc") is None, reason="no can-utils")
def test_can_utils_read_what_was_recorded(folder: Path) -> None:
    done = subprocess.run(
        ["log2asc", "-I", str(folder / "fd.log"), "vcan0"], capture_output=True, text=True, check=True
    )
    assert done.stdout.count("CANFD") == len(frames_of(folder / "fd.log"))
