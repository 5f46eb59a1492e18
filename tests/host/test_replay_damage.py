"""Bus logs that are truncated, corrupt or foreign: the part before the damage is reported, and its place."""

import gzip
import json
import random
import re
from collections.abc import Callable
from pathlib import Path

import can
import pytest
from bus_logs import STOP, frames_of, written

from tauperp.cli import main
from tauperp.errors import InputError
from tauperp.replay.buslog import BusLog

DAMAGED = 2000  # the line of a text log, of which the first is 0


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
    lines[DAMAGED] = lines[DAMAGED][:30] + "??"
    path.write_text("\n".join(lines) + "\n")


def foreign_line(path: Path) -> None:
    lines = path.read_text().splitlines()
    lines[DAMAGED] = "a remark without a comment sign"
    path.write_text("\n".join(lines) + "\n")


def short_data(path: Path) -> None:
    """A data byte is cut in two."""
    lines = path.read_text().splitlines()
    lines[DAMAGED] = lines[DAMAGED].split("##")[0] + "##10"
    path.write_text("\n".join(lines) + "\n")


def cut_between_bytes(path: Path) -> None:
    """The last line is still a valid frame, with fewer bytes."""
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:DAMAGED]) + "\n" + lines[DAMAGED][: lines[DAMAGED].index("##") + 7])


def cut_at_a_line(path: Path) -> None:
    path.write_text("\n".join(path.read_text().splitlines()[:DAMAGED]) + "\n")


@pytest.fixture(scope="module")
def frames(logs: Path) -> list[can.Message]:
    """What comes before the damage, and some more."""
    return frames_of(logs / "fd.log")[:4000]


@pytest.mark.parametrize(
    ("suffix", "damage", "place"),
    [
        (".blf", cut_blf, "byte "),
        (".blf", corrupt_blf, "byte "),
        (".asc", garbage_line, "line 2001, after 1995 frames"),
        (".log", garbage_line, "line 2001, after 2000 frames"),
        (".log", foreign_line, "line 2001, after 2000 frames"),
        (".log", short_data, "line 2001, after 2000 frames"),
        (".log", cut_between_bytes, "line 2001, after 2000 frames: the file ends in the middle of this line"),
        (".asc", cut_at_a_line, "line 2000, after 1995 frames: the file ends here, without the end of its"),
    ],
)
def test_a_damaged_log_is_reported_up_to_its_damage(
    logs: Path,
    frames: list[can.Message],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    suffix: str,
    damage: Callable[[Path], object],
    place: str,
) -> None:
    path = written(tmp_path / f"x{suffix}", frames)
    damage(path)
    assert main(["replay", str(path), "--scenario", str(logs / "fd.toml"), "--json"]) == 2
    output = capsys.readouterr()
    report = json.loads(output.out)
    assert output.err.count("\n") == 1
    assert f"{path}: {place}" in output.err
    assert report["damage"] is not None
    assert report["equal"] is False
    assert report["cycles"] > 90
    assert report["first_difference"] is None
    assert report["messages"]["StopCommand"]["equal"] == report["cycles"]
    assert main(["replay", str(path), "--scenario", str(logs / "fd.toml")]) == 2
    assert "StopCommand" in capsys.readouterr().out


def test_a_line_that_cannot_be_read_is_shown(frames: list[can.Message], tmp_path: Path) -> None:
    path = written(tmp_path / "x.log", frames)
    foreign_line(path)
    log = BusLog(path)
    assert len(list(log)) == DAMAGED
    assert str(log.damage).endswith("'a remark without a comment sign' is not a frame")


def test_a_log_of_candump_without_its_option_says_which(tmp_path: Path) -> None:
    for stamp in ("", "(1436509052.249713) "):
        path = tmp_path / "x.log"
        path.write_text(f" {stamp} vcan0  020   [4]  B7 00 00 00\n")
        with pytest.raises(InputError, match=r"candump -L writes it: .*vcan0 +020 +\[4\] +B7.* is not a frame"):
            list(BusLog(path))


def test_line_ends_and_a_byte_order_mark_of_windows_are_not_damage(frames: list[can.Message], tmp_path: Path) -> None:
    for suffix in (".log", ".asc"):
        path = written(tmp_path / f"x{suffix}", frames[:100])
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n").rstrip())
        if suffix == ".log":
            path.write_bytes(path.read_bytes() + b"\r\n")
        assert len(frames_of(path)) == 100


def test_a_cut_blf_is_read_up_to_the_cut_and_its_byte_is_reported(frames: list[can.Message], tmp_path: Path) -> None:
    path = written(tmp_path / "x.blf", frames)
    at = cut_blf(path)
    log = BusLog(path)
    whole_containers = 2 * 128 * 1024 // 112  # bytes of a CAN FD frame's object: upper bound of one object and a part
    read = list(log)
    assert log.damage is not None
    assert f"byte {at}, after {len(read)} frames: the file ends in the middle of an object" in str(log.damage)
    assert 1500 < len(read) <= whole_containers
    assert [frame.data for frame in read] == [frame.data for frame in frames[: len(read)]]


def test_a_blf_that_ends_between_two_containers_is_reported_as_cut(frames: list[can.Message], tmp_path: Path) -> None:
    path = written(tmp_path / "x.blf", frames)
    data = path.read_bytes()
    path.write_bytes(data[: data.index(b"LOBJ", data.index(b"LOBJ") + 100)])
    log = BusLog(path)
    assert len(list(log)) > 1000
    assert "the file ends here, its header announces" in str(log.damage)


def test_the_reading_of_a_blf_ends_at_an_object_of_size_zero(frames: list[can.Message], tmp_path: Path) -> None:
    path = tmp_path / "x.blf"
    with can.BLFWriter(path, compression_level=0) as writer:
        for frame in frames[:100]:
            writer(frame)
    data = bytearray(path.read_bytes())
    at = data.index(b"LOBJ", data.index(b"LOBJ") + 4 + 2000)
    data[at + 8 : at + 12] = bytes(4)
    path.write_bytes(data)
    log = BusLog(path)
    list(log)
    assert re.search("ends where it begins|an object of 0 bytes", str(log.damage))


def test_a_cut_gzipped_log_is_reported_as_cut(logs: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.log.gz"
    path.write_bytes(gzip.compress((logs / "fd.log").read_bytes())[:20_000])
    log = BusLog(path)
    assert len(list(log)) > 100
    assert "line" in str(log.damage)


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log", ".trc", ".csv", ".db"])
@pytest.mark.parametrize("content", ["empty", "png", "text"])
def test_a_file_that_is_not_a_log_gives_one_line(
    logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str, content: str
) -> None:
    path = tmp_path / f"x{suffix}"
    picture = bytes.fromhex("89504e470d0a1a0a0000000d49484452") + bytes(range(256)) * 20
    path.write_bytes({"empty": b"", "png": picture, "text": b"Some notes,\nnot a table\n"}[content])
    assert main(["replay", str(path), "--scenario", str(logs / "fd.toml")]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert str(path) in output.err


def test_a_log_without_a_guard_gives_one_line(
    frames: list[can.Message], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    others = [frame for frame in frames if frame.arbitration_id != STOP]
    assert main(["replay", str(written(tmp_path / "x.log", others[:3000]))]) == 2
    assert "no StopCommand in its first 3000 frames" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log"])
def test_no_broken_log_hangs_or_has_a_traceback(
    frames: list[can.Message], tmp_path: Path, suffix: str, seed: int
) -> None:
    print(f"seed {seed}")
    rng = random.Random(seed)
    whole = written(tmp_path / f"whole{suffix}", frames[:600]).read_bytes()
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
