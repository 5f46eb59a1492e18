"""Bus logs that a run records, in every format."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import can
import pytest
from bus_logs import INDEX, STATUS, STOP, WIRE, frames_of, replayed

from tauperp.cli import main
from tauperp.errors import InputError
from tauperp.replay.recorder import bus_recorder


@pytest.mark.parametrize("suffix", [".blf", ".asc", ".log", ".asc.gz", ".log.gz"])
@pytest.mark.parametrize("form", ["fd", "classic"])
def test_a_recording_holds_every_frame_of_both_directions_in_simulated_time(
    logs: Path, tmp_path: Path, form: str, suffix: str
) -> None:
    expected = frames_of(logs / f"{form}.log")
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
        ("there.log", "there.log: already exists"),
        ("x.trc", ".trc holds no CAN FD frames; use .asc, .blf, .log"),
        ("x.db", ".db holds no CAN FD frames"),
        ("x.png", "python-can writes no '.png'"),
        ("x", "python-can writes no ''"),
        ("x.blf.gz", "python-can does not pack .blf"),
        ("there.log/x.log", "there.log/x.log: "),
    ],
)
def test_an_impossible_recording_gives_one_line_before_the_run(
    logs: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    message: str,
) -> None:
    monkeypatch.delattr("tauperp.commands.run.run_scenario")
    (tmp_path / "there.log").write_text("precious")
    assert main(["run", str(logs / "fd.toml"), "--record", str(tmp_path / name)]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert message in output.err
    assert [one.name for one in tmp_path.iterdir()] == ["there.log"]
    assert (tmp_path / "there.log").read_text() == "precious"


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
def test_ctrl_c_leaves_a_readable_file_of_the_run_so_far(tmp_path: Path, suffix: str) -> None:
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


def test_ctrl_c_of_the_command_keeps_its_recording(logs: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    command = [sys.executable, "-m", "tauperp.cli", "run", str(logs / "fd.toml"), "--record", str(path)]
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
    assert replayed(path, logs).equal


@pytest.mark.needs("can")
def test_can_utils_read_what_was_recorded(logs: Path) -> None:
    done = subprocess.run(["log2asc", "-I", str(logs / "fd.log"), "vcan0"], capture_output=True, text=True, check=True)
    assert done.stdout.count("CANFD") == len(frames_of(logs / "fd.log"))
