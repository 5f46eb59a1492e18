"""Bus logs through the firmware, compared frame by frame: what is equal, different, missing or masked."""

import json
import random
from pathlib import Path

import can
import pytest
from bus_logs import INDEX, RESET, STATUS, STOP, WIRE, counts, frames_of, replayed, written

from tauperp.cli import main
from tauperp.config import load_configuration
from tauperp.firmware import Guard, Reason
from tauperp.replay.buslog import BusLog
from tauperp.replay.log_report import lines, replay_log
from tauperp.replay.origin import look_ahead
from tauperp.wire import COUNTER_MASK


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log"])
@pytest.mark.parametrize("form", ["fd", "classic"])
def test_a_lockstep_log_is_repeated_bit_for_bit_with_nothing_masked(
    logs: Path, tmp_path: Path, form: str, suffix: str
) -> None:
    frames = frames_of(logs / f"{form}.log")
    replay = replayed(written(tmp_path / f"x{suffix}", frames), logs, form)
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


def test_one_bit_anywhere_in_the_guards_frames_is_detected(logs: Path, tmp_path: Path, seed: int) -> None:
    print(f"seed {seed}")
    rng = random.Random(seed)
    frames = frames_of(logs / "fd.log")
    for message in (STOP, STATUS, INDEX):
        at = rng.choice([i for i, frame in enumerate(frames) if frame.arbitration_id == message and i > 400])
        bit = rng.randrange(64)
        data = bytearray(frames[at].data)
        data[bit // 8] ^= 1 << bit % 8
        changed = can.Message(
            timestamp=frames[at].timestamp, arbitration_id=message, is_extended_id=False, is_fd=True, data=data
        )
        path = written(tmp_path / f"{message}.log", [*frames[:at], changed, *frames[at + 1 :]])
        replay = replayed(path, logs)
        first = replay.comparison.first
        print(message, at, bit, first)
        assert counts(replay)[1:] == (1, 0)
        assert first is not None
        assert first.message == WIRE.by_id[message].name
        assert first.time_s == pytest.approx(frames[at].timestamp)
        assert first.our_data == frames[at].data.hex()
        assert first.logged_data == data.hex()
        assert first.logged.keys() == first.ours.keys()


def test_an_input_missing_in_the_log_is_detected(logs: Path, tmp_path: Path) -> None:
    """The guard received a frame that the log lacks, so its answers do not follow from the log."""
    frames = frames_of(logs / "fd.log")
    joint = WIRE.message("JointState2").id
    at = next(i for i, frame in enumerate(frames) if frame.arbitration_id == joint and frame.timestamp > 0.4)
    replay = replayed(written(tmp_path / "x.log", frames[:at] + frames[at + 1 :]), logs)
    assert not replay.equal
    first = replay.comparison.first
    assert first is not None
    assert first.time_s >= frames[at].timestamp


def test_a_frame_of_the_guard_that_the_log_lacks_is_missing(logs: Path, tmp_path: Path) -> None:
    frames = frames_of(logs / "fd.log")
    at = next(i for i, frame in enumerate(frames) if frame.arbitration_id == INDEX and frame.timestamp > 0.2)
    replay = replayed(written(tmp_path / "x.log", frames[:at] + frames[at + 1 :]), logs)
    assert counts(replay)[1:] == (0, 1)
    assert not replay.equal


def test_an_invented_frame_of_the_guard_is_a_difference(logs: Path, tmp_path: Path) -> None:
    frames = frames_of(logs / "fd.log")
    at = next(i for i, frame in enumerate(frames) if frame.arbitration_id == INDEX and frame.timestamp > 0.2)
    replay = replayed(written(tmp_path / "x.log", [*frames[: at + 1], frames[at], *frames[at + 1 :]]), logs)
    assert counts(replay)[1:] == (1, 0)
    assert replay.comparison.first is not None
    assert replay.comparison.first.our_data == ""


def test_two_guards_in_one_log_are_reported(logs: Path, tmp_path: Path) -> None:
    frames = frames_of(logs / "fd.log")[:2000]
    doubled = [copy for frame in frames for copy in [frame] * (2 if frame.arbitration_id == STOP else 1)]
    replay = replayed(written(tmp_path / "two.log", doubled), logs)
    stops = sum(frame.arbitration_id == STOP for frame in frames)
    assert not replay.equal
    assert (replay.comparison.out_of_sequence, replay.comparison.lost_ticks) == (stops, 0)
    assert f"StopCommands out of sequence: {stops}; two guards, or two logs in one file" in lines(replay)


def test_frames_of_others_are_counted_and_change_nothing(logs: Path, tmp_path: Path) -> None:
    frames = frames_of(logs / "fd.log")
    other = can.Message(timestamp=0.1, arbitration_id=0x123, is_extended_id=False, data=bytes(8))
    error = can.Message(timestamp=0.1, is_error_frame=True)
    replay = replayed(written(tmp_path / "x.log", [*frames[:999], other, error, *frames[999:]]), logs)
    assert replay.equal
    assert replay.comparison.foreign_frames >= 1


def test_a_log_that_begins_during_a_run_is_compared_once_both_guards_agree(
    logs: Path, tmp_path: Path, seed: int
) -> None:
    print(f"seed {seed}")
    rng = random.Random(seed)
    frames = frames_of(logs / "fd.log")
    for cut in rng.sample(range(200, 2000), 3):
        replay = replayed(written(tmp_path / f"{cut}.log", frames[cut:]), logs)
        one = replay.comparison
        print(cut, one.cycles, one.compared_cycles, one.first)
        assert one.origin.joined
        assert one.cycles - 600 < one.compared_cycles < one.cycles - 400  # 20 / K is 0.44 s
        assert {"TripNumber", "CrcErrors"} <= one.masked.keys()
        assert "Counter" not in one.masked
        assert replay.equal
        assert [trip.reason for trip in one.trips] == [Reason.COLLISION]


def test_a_log_that_begins_after_a_trip_has_its_resets_renumbered(logs: Path, tmp_path: Path) -> None:
    """Two runs, the second of a guard that continues to count: trip 2 is trip 1 of a guard that joins."""
    configuration = replayed(logs / "fd.log", logs).comparison.configuration
    inputs = [frame for frame in frames_of(logs / "fd.log") if frame.arbitration_id not in (STOP, STATUS, INDEX)]
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
    replay = replayed(written(tmp_path / "x.log", frames[permitted:]), logs)
    print(replay.comparison.first, counts(replay), replay.comparison.trips)
    assert Reason.COLLISION in [trip.reason for trip in replay.comparison.trips]
    assert replay.equal
    assert replay.comparison.compared_cycles > 2000


def test_a_guard_that_waited_before_the_log_begins_needs_no_mask(logs: Path, tmp_path: Path) -> None:
    """Its counters and pages are those of a guard after the same number of ticks without a robot."""
    configuration = replayed(logs / "fd.log", logs).comparison.configuration
    inputs = [f for f in frames_of(logs / "fd.log")[:8000] if f.arbitration_id not in (STOP, STATUS, INDEX)]
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
    replay = replayed(written(tmp_path / "x.log", frames), logs)
    assert replay.comparison.origin.ticks_before == 1237 % 2464
    assert not replay.comparison.origin.joined
    assert replay.comparison.masked == {}
    assert replay.equal


def test_only_values_measured_by_a_real_clock_are_masked(logs: Path, tmp_path: Path, seed: int) -> None:
    """The same guard ticked with measured tick times, and its frames at times that jitter."""
    print(f"seed {seed}")
    rng = random.Random(seed)
    configuration = replayed(logs / "fd.log", logs).comparison.configuration
    inputs = [f for f in frames_of(logs / "fd.log")[:7000] if f.arbitration_id not in (STOP, STATUS, INDEX)]
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
    replay = replayed(written(tmp_path / "x.log", frames), logs)
    assert set(replay.comparison.masked) == {"TickTime", "WorstTickTime", "DeadlineMargin"}
    assert not replay.comparison.origin.lockstep
    print(replay.comparison.first)
    assert replay.equal


def test_a_fault_known_only_to_the_board_is_taken_from_the_log(logs: Path, tmp_path: Path) -> None:
    configuration = replayed(logs / "fd.log", logs).comparison.configuration
    inputs = [f for f in frames_of(logs / "fd.log")[:8000] if f.arbitration_id not in (STOP, STATUS, INDEX)]
    guard, frames, cycle = Guard(configuration.block()), [], 0
    for number, frame in enumerate(inputs):
        if frame.arbitration_id == WIRE.message("Sync").id and number:
            if cycle == 400:
                guard.trip(Reason.BUS_OFF)
            frames += guard.tick(cycle * 1000).frames
            cycle += 1
        guard.receive(frame, cycle * 1000)
        frames.append(frame)
    replay = replayed(written(tmp_path / "x.log", frames), logs)
    assert [trip.reason for trip in replay.comparison.trips] == [Reason.BUS_OFF]
    assert replay.equal


def test_another_build_of_the_firmware_masks_its_number_and_is_reported(logs: Path, tmp_path: Path) -> None:
    frames = frames_of(logs / "fd.log")
    message = WIRE.message("GuardStatus")
    for frame in frames:
        if frame.arbitration_id == STATUS and frame.data[1] >> 4 == 4:
            frame.data[6] ^= 0xFF
            message.seal(frame.data, frame.data[1] & COUNTER_MASK)
    replay = replayed(written(tmp_path / "x.log", frames), logs)
    assert replay.comparison.masked == dict.fromkeys(("FirmwareVersion", "BuildId"), "another build of the firmware")
    assert replay.equal


# --- the configuration --------------------------------------------------------------------------------------------


def test_another_configuration_gives_one_line_that_names_both(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    origin = look_ahead(BusLog(logs / "fd.log"), WIRE, logs)[1]
    other = load_configuration("paper", robot="panda")
    assert main(["replay", str(logs / "fd.log"), "--config", "paper", "--robot", "panda"]) == 2
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


def test_a_configuration_that_is_not_shipped_must_be_named(logs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(logs / "fd.log")]) == 2
    error = capsys.readouterr().err
    assert "which belongs to no shipped preset: name the file with --config" in error
    assert error.count("\n") == 1


# --- the command --------------------------------------------------------------------------------------------------


def test_the_command_prints_what_was_compared_and_its_verdict_is_the_exit_code(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = ["--scenario", str(logs / "fd.toml")]
    assert main(["replay", str(logs / "fd.log"), *name]) == 0
    table = capsys.readouterr().out
    assert "collision" in table
    assert "\nequal\n" in table
    frames = frames_of(logs / "fd.log")
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
        (["x.log", "--map", "m.toml"], "--map is only for recordings"),
        (["--csv", "x.csv", "--scenario", "payload"], "--scenario is only for bus logs"),
        (["x.log", "--scenario", "payload", "--config", "paper"], "either --config or --scenario"),
        (["none.log"], "none.log: No such file or directory"),
        (["x.csv.png"], "python-can reads no '.png'"),
    ],
)
def test_bad_arguments_give_one_line(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", *arguments]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert message in output.err
