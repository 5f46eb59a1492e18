"""Bus logs as other tools write them: foreign lines, languages, relative times, several channels, other objects."""

import struct
from collections.abc import Iterable
from pathlib import Path

import can
import pytest

from tauperp import cli
from tauperp.config import load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Guard
from tauperp.replay.buslog import BusLog
from tauperp.replay.log_report import LogReplay, lines, replay_log
from tauperp.wire import Sender

CYCLES = 80
PERIOD_S = 0.002
CONFIG = 'robot = "ku_dex"\npreset = "paper"\n[wire]\nrate_hz = 500\nformat = "classic"\n'


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> list[can.Message]:
    """A robot at rest and its guard, in lockstep."""
    configuration = load_configuration(config(tmp_path_factory.mktemp("config")))
    guard, sender = Guard(configuration.block()), Sender(configuration.wire, fd=False)
    joint = {"SensorStatus": 0, "Position": 0.1, "Velocity": 0.0, "Torque": 0.5}
    found: list[can.Message] = []
    for cycle in range(CYCLES):
        sent = [sender.frame("Sync", {"Cycle": cycle}, cycle=cycle)]
        command = {"Task": 1, "AccelX": 0.0, "AccelY": 0.0, "AccelZ": 0.0}
        sent.append(sender.frame("TaskCommand", command, cycle=cycle))
        sent += [sender.frame(f"JointState{i + 1}", joint, cycle=cycle) for i in range(configuration.robot.n)]
        for frame in sent:
            guard.receive(frame, round(cycle * PERIOD_S * 1e6))
        for frame in (*sent, *guard.tick(round(cycle * PERIOD_S * 1e6)).frames):
            frame.timestamp, frame.channel = cycle * PERIOD_S, 0
            found.append(frame)
    return found


def config(folder: Path) -> Path:
    path = folder / "c.toml"
    path.write_text(CONFIG)
    return path


def asc(frames: Iterable[can.Message], *, base: int = 16, relative: bool = False) -> str:
    stamps, before = ("relative" if relative else "absolute"), 0.0
    text = [
        "date Wed Nov 25 02:01:25.371 2026",
        f"base {'hex' if base == 16 else 'dec'}  timestamps {stamps}",
        "internal events logged",
        "Begin Triggerblock Thu Jan 01 00:00:00.0 1970",
        " 0.000000 Start of measurement",
    ]
    number = (lambda x: f"{x:X}") if base == 16 else str
    for frame in frames:
        time_s = frame.timestamp - before if relative else frame.timestamp
        before = frame.timestamp
        data = " ".join(number(byte) for byte in frame.data)
        text.append(f" {time_s:.6f} 1  {number(frame.arbitration_id):<15} Rx   d {len(frame.data)} {data}")
    return "\n".join([*text, "End TriggerBlock"]) + "\n"


def replayed(folder: Path, name: str, content: str | bytes, channel: str | None = None) -> LogReplay:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return replay_log(path, config=config(folder), channel=channel)


FOREIGN = {
    "Vector's later header": (lambda text: text.replace("Start of measurement", "CANFD   Start of measurement"), 1),
    "German": (lambda text: text.replace("Start of measurement", "Start der Messung"), 1),
    "German header": (lambda text: text.replace("date Wed Nov 25", "date Mit Nov 25"), 1),
    "LIN": (lambda text: after(text, " 0.05 L1 3C Rx 8 01 02 03 04 05 06 07 08 checksum = 1b"), 2),
    "overload": (lambda text: after(text, " 0.050 1  OverloadFrame"), 2),
    "a request to send": (lambda text: after(text, " 0.050 1  7DF   TxRq d 8 02 01 0C 00 00 00 00 00"), 2),
    "statistics": (lambda text: after(text, " 0.050 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%"), 2),
    "a sentence": (lambda text: after(text, "a remark without a comment sign"), 2),
    "a tail": (lambda text: text.replace(" Rx   d 4 B7 00 00 00\n", " Rx   d 4 B7 00 00 00  Length = 1 ID = 32\n"), 1),
}


def after(text: str, line: str, number: int = 300) -> str:
    rows = text.splitlines()
    return "\n".join([*rows[:number], line, *rows[number:]]) + "\n"


@pytest.mark.parametrize("kind", FOREIGN)
def test_lines_that_are_not_frames_are_skipped_and_counted(
    tmp_path: Path, frames: list[can.Message], kind: str
) -> None:
    change, passed_over = FOREIGN[kind]
    replay = replayed(tmp_path, "x.asc", change(asc(frames)))
    assert (replay.equal, replay.damage, replay.passed_over) == (True, None, passed_over)
    assert f"in the log that are not frames: {passed_over} lines or objects" in lines(replay)
    assert replay.comparison.frames == len(frames)


def test_comments_in_windows_characters_are_text(tmp_path: Path, frames: list[can.Message]) -> None:
    content = after(asc(frames), "// Prüfstand °", 4).encode("cp1252")
    assert replayed(tmp_path, "x.asc", content).equal
    late = after(asc(frames), "// Pr\0\1").encode()
    cut = replayed(tmp_path, "x.asc", late)
    assert str(cut.damage).endswith("not text")


@pytest.mark.parametrize("base", [16, 10])
@pytest.mark.parametrize("relative", [False, True])
def test_number_bases_and_relative_times_give_the_same_log(
    tmp_path: Path, frames: list[can.Message], base: int, relative: bool
) -> None:
    replay = replayed(tmp_path, "x.asc", asc(frames, base=base, relative=relative))
    assert replay.equal
    assert replay.comparison.end_s == pytest.approx((CYCLES - 1) * PERIOD_S)


def test_the_first_frame_of_a_file_without_a_trigger_block_is_read(tmp_path: Path, frames: list[can.Message]) -> None:
    text = "\n".join(line for line in asc(frames).splitlines() if line[0] in "bd" or " Rx " in line) + "\n"
    replay = replayed(tmp_path, "x.asc", text.replace("  timestamps absolute", "  no internal events logged"))
    assert replay.equal
    assert replay.comparison.frames == len(frames)


@pytest.mark.parametrize("broken", ["   d 8 F7", "?", "   d 8 F7 0C 00 00 00 00 F6 1FF", "   d 99 00"])
def test_a_malformed_frame_line_is_damage(tmp_path: Path, frames: list[can.Message], broken: str) -> None:
    replay = replayed(tmp_path, "x.asc", after(asc(frames), f" 0.05 1  105   Rx{broken}"))
    assert "x.asc: line 301, after 295 frames: " in str(replay.damage)


# .blf


def blf(folder: Path, frames: Iterable[can.Message], name: str = "x.blf") -> bytearray:
    path = folder / name
    with can.BLFWriter(path, compression_level=0) as writer:
        for frame in frames:
            writer.on_message_received(frame)
    return bytearray(path.read_bytes())


def test_a_frame_of_a_later_object_version_is_read(tmp_path: Path, frames: list[can.Message]) -> None:
    data = blf(tmp_path, frames)
    at = -1
    for _ in range(40):
        at = data.index(b"LOBJ", at + 1)
    struct.pack_into("<H", data, at + 6, 3)
    replay = replayed(tmp_path, "x.blf", bytes(data))
    assert replay.equal
    assert replay.comparison.frames == len(frames)
    struct.pack_into("<H", data, at + 4, 48)
    assert "a frame whose header is 48 bytes long" in str(replayed(tmp_path, "x.blf", bytes(data)).damage)


def test_objects_outside_containers_are_read(tmp_path: Path, frames: list[can.Message]) -> None:
    data = bytes(blf(tmp_path, frames))
    size = struct.unpack_from("<I", data, 4)[0]
    content, at = b"", size
    while at + 32 <= len(data):
        length = struct.unpack_from("<I", data, at + 8)[0]
        content += data[at + 32 : at + length]
        at += length + length % 4
    bare = data[:size] + content
    bare = bare[:16] + struct.pack("<Q", len(bare)) + bare[24:]
    assert replayed(tmp_path, "x.blf", bare).comparison.frames == len(frames)


def test_other_objects_are_counted(tmp_path: Path, frames: list[can.Message]) -> None:
    data = blf(tmp_path, frames)
    at = -1
    for _ in range(40):
        at = data.index(b"LOBJ", at + 1)
    struct.pack_into("<I", data, at + 12, 115)
    replay = replayed(tmp_path, "x.blf", bytes(data))
    assert (replay.passed_over, replay.equal, replay.damage) == (1, False, None)
    assert replay.comparison.frames == len(frames) - 1


def test_a_container_of_unknown_compression_is_damage(tmp_path: Path, frames: list[can.Message]) -> None:
    data = blf(tmp_path, frames)
    struct.pack_into("<H", data, struct.unpack_from("<I", data, 4)[0] + 16, 7)
    with pytest.raises(InputError, match="a container that is packed by method 7"):
        replayed(tmp_path, "x.blf", bytes(data))


# Channels, formats, identifiers


def candump(frames: Iterable[can.Message], *channels: str) -> str:
    return "".join(
        f"({frame.timestamp:.6f}) {channel} {frame.arbitration_id:03X}#{frame.data.hex().upper()} R\n"
        for frame in frames
        for channel in channels
    )


def test_a_log_of_two_guards_asks_for_the_channel(tmp_path: Path, frames: list[can.Message]) -> None:
    text = candump(frames, "can0", "can1")
    with pytest.raises(InputError, match=rf"several channels: can0 \({len(frames)} frames\), can1 .*--log-channel"):
        replayed(tmp_path, "x.log", text)
    replay = replayed(tmp_path, "x.log", text, channel="can1")
    assert replay.equal
    assert replay.other_channels == {"can0": len(frames)}
    with pytest.raises(InputError, match=r"no channel 'can7' \(it has can0, can1\)"):
        replayed(tmp_path, "x.log", text, channel="can7")


def test_frames_of_another_bus_are_omitted_and_reported(tmp_path: Path, frames: list[can.Message]) -> None:
    other = [frame for frame in frames if frame.arbitration_id == frames[0].arbitration_id]
    replay = replayed(tmp_path, "x.log", candump(frames, "can0") + candump(other, "can1"))
    assert replay.equal
    assert f"frames on other channels, omitted: can1 ({len(other)})" in lines(replay)


def test_a_difference_only_in_the_format_is_reported_as_such(tmp_path: Path, frames: list[can.Message]) -> None:
    text = candump(frames, "can0").replace("#", "##1")
    replay = replayed(tmp_path, "x.log", text)
    assert not replay.equal
    assert replay.comparison.first is not None
    assert replay.comparison.first.logged == {"frame format": "CAN FD"}
    assert "only the frame format differs (classic or CAN FD), the bytes are the same" in lines(replay)


def test_frames_with_29_bit_ids_do_not_belong_to_the_wire(tmp_path: Path, frames: list[can.Message]) -> None:
    text = "".join(
        candump([one], "can0") + f"({one.timestamp:.6f}) can0 {one.arbitration_id:08X}#0000000000000000 R\n"
        for one in frames
    )
    replay = replayed(tmp_path, "x.log", text)
    assert replay.equal
    assert replay.comparison.foreign_frames == len(frames)


def test_the_channel_option_is_refused_without_logs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["replay", "--csv", "x.csv", "--robot", "panda", "--log-channel", "1"]) == 2
    assert "--log-channel is only for bus logs" in capsys.readouterr().err
    assert next(iter(BusLog(written(tmp_path)))).arbitration_id == 0x20


def written(folder: Path) -> Path:
    path = folder / "x.log"
    path.write_text("(0.0) can0 020#B7000000 R\n")
    return path


def test_an_object_of_size_zero_is_damage_and_ends_the_reading(tmp_path: Path, frames: list[can.Message]) -> None:
    data = blf(tmp_path, frames)
    at = -1
    for _ in range(40):
        at = data.index(b"LOBJ", at + 1)
    struct.pack_into("<II", data, at + 8, 0, 115)
    replay = replayed(tmp_path, "x.blf", bytes(data))
    assert "an object of 0 bytes" in str(replay.damage)
    assert replay.comparison.frames == 38
