"""`tauperp monitor` in a pseudo-terminal, on a pipe, and on a bus that cannot send."""

import dataclasses
import datetime
import errno
import functools
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from monitor_feed import MOVING, TRIPPED, Feed, Script
from terminal import Terminal

from tauperp import cli
from tauperp.commands import monitor as command
from tauperp.monitor import Monitor, Snapshot, compose
from tauperp.wire import Wire

FEED = str(Path(__file__).with_name("monitor_feed.py"))
SIZES = [(80, 24), (120, 40)]
WIRE = Wire.read()


def on_screen(script: str, columns: int, rows: int, *arguments: str) -> Terminal:
    return Terminal([FEED, script, "monitor", *arguments], columns, rows)


@functools.cache
def snapshot_of(*scripts: Script, cycles: int = 60) -> Snapshot:
    """The state after this many cycles of each script."""
    monitor, feed, now_s = Monitor(WIRE, now_s=0.0, epoch_s=1e9), Feed(WIRE), 0.0
    for script in scripts:
        for _ in range(cycles):
            for frame in feed.frames(script):
                monitor.hear(frame, now_s)
            now_s += 0.002
    return monitor.snapshot(now_s)


def drawn(snapshot: Snapshot, columns: int = 80, rows: int | None = 24) -> str:
    return "\n".join(line.plain for line in compose(snapshot, "socketcan can0", columns, rows))


@pytest.mark.parametrize(("columns", "rows"), SIZES)
def test_a_moving_robot_on_the_screen(columns: int, rows: int) -> None:
    with on_screen("moving", columns, rows) as terminal:
        terminal.wait_for_words(
            "monitoring: motion is permitted",
            "task payload",
            "smallest singular value 0.1234 Nm/N",
            "tick 45 us",
            "deadline margin 7210 us",
            "firmware 1.2 float32",
            "1badcafe",
            "bus load",
            "crc          11     0",
            "J7",
        )
        assert "│" in line_of(terminal, "J1")  # below its threshold: the mark is visible
        assert "-6.25" in line_of(terminal, "J2")
        assert line_of(terminal, "J2").rstrip().endswith("2.00")
        assert [line for line in terminal.lines if len(line) > columns] == []
        assert terminal.background("motion is permitted") == "005f00"
        assert terminal.press_ctrl_c() == 130


def line_of(terminal: Terminal, start: str) -> str:
    return next(line for line in terminal.lines if line.startswith(start))


@pytest.mark.parametrize(("columns", "rows"), SIZES)
def test_a_trip_on_the_screen(columns: int, rows: int) -> None:
    with on_screen("tripped", columns, rows) as terminal:
        terminal.wait_for_words(
            "stopped: motion is not permitted",
            "collision, joint 3, index +4.21 Nm",
            "trip 7, stop category 2 (stop and hold)",
            "7 collision J3 +4.21 Nm",  # in the history
            "J7",
        )
        assert "▶" in line_of(terminal, "J3")
        assert terminal.colour("J3") == "red"
        assert terminal.colour("J1") == "default"
        assert terminal.background("motion is not permitted") == "d70000"
        assert [line for line in terminal.lines if len(line) > columns] == []


def test_a_missing_joint_is_named() -> None:
    with on_screen("waiting", 80, 24) as terminal:
        terminal.wait_for(lambda text: "waiting for joint 5" in text and "Joint 5  " in text and "J7" in text)
        assert terminal.colour("Joint 5  ") == "red"
        assert terminal.background("motion is not permitted") == "d75f00"


def test_a_silent_bus_says_that_silence_means_stop() -> None:
    with on_screen("silence", 80, 24) as terminal:
        terminal.wait_for(lambda text: "no StopCommand: silence means stop" in text)
        assert "permitted" not in terminal.text


@pytest.mark.parametrize("end", ["press_ctrl_c", "interrupt"])
def test_the_terminal_is_restored_at_the_end(end: str) -> None:
    with on_screen("moving", 80, 24) as terminal:
        terminal.wait_for(lambda text: "motion is permitted" in text)
        assert "\x1b[?1049h" in terminal.output  # the alternate screen, so that the user's scrollback is kept
        assert getattr(terminal, end)() == 130
        assert terminal.output.rstrip().endswith("\x1b[?25h\x1b[?1049l")
        assert "Traceback" not in terminal.output


def test_a_set_time_ends_the_view_with_the_verdict() -> None:
    with on_screen("moving", 80, 24, "--duration", "2") as terminal:
        assert terminal.wait() == 0
    with on_screen("silence", 80, 24, "--duration", "0.5") as terminal:
        assert terminal.wait() == 1


@pytest.mark.parametrize("columns", [20, 79, 80, 81, 100, 200])
@pytest.mark.parametrize("rows", [5, 24, 25, 60])
def test_the_picture_fits_any_terminal(columns: int, rows: int) -> None:
    eight = dataclasses.replace(TRIPPED, joints=8, residual=(300.0,) * 8, index=(-300.0,) * 8, threshold=0.5)
    silent = dataclasses.replace(eight, silent_joints=(2, 3, 7))
    for snapshot in (snapshot_of(), snapshot_of(eight), snapshot_of(eight, silent, cycles=1100)):
        lines = drawn(snapshot, columns, rows).split("\n")
        assert len(lines) <= rows
        assert max(len(line) for line in lines) <= columns


def test_eighty_by_twenty_four_shows_everything_even_of_eight_joints() -> None:
    eight = dataclasses.replace(MOVING, joints=8, residual=(0.5,) * 8, index=(0.5,) * 8)
    text = drawn(snapshot_of(eight))
    wanted = ["J8", "JointState" if "JointState" in text else "Joint 1..8", "GuardIndex", "late", "trips", "1badcafe"]
    assert [word for word in wanted if word not in text] == []
    assert len(text.split("\n")) == 24


def test_a_bar_reaches_the_mark_exactly_at_the_threshold() -> None:
    def bar_of(index: float) -> str:
        script = dataclasses.replace(MOVING, joints=1, residual=(0.0,), index=(index,), threshold=1.0)
        return next(line for line in drawn(snapshot_of(script)).split("\n") if line.startswith("J1"))

    below, at, above = bar_of(0.98), bar_of(1.0), bar_of(1.1)
    marks = [place for place, letter in enumerate(below) if letter == "│"]
    assert below[marks[1] - 1] != " "
    assert at[marks[1] - 1] == "█"
    assert at[marks[1]] == "│"
    assert above[marks[1]] == "█"
    assert bar_of(-1.1) == above.replace("+1.10", "-1.10")
    assert "▶" in bar_of(100.0)


def test_old_values_are_grey() -> None:
    fresh = snapshot_of(MOVING)
    old = dataclasses.replace(
        fresh,
        status={name: dataclasses.replace(one, age_s=2.0) for name, one in fresh.status.items()},
        joints={joint: dataclasses.replace(one, age_s=2.0) for joint, one in fresh.joints.items()},
    )

    def coloured(snapshot: Snapshot) -> set[str]:
        lines = compose(snapshot, "bus", 80, 24)
        shown = [line for line in lines if line.plain.startswith(("state", "tick", "J"))]
        return {str(span.style) for line in shown for span in line.spans}

    assert coloured(fresh) > {"bold", "blue", "green"}
    assert coloured(old) == {"bright_black"}


def test_once_prints_the_same_picture_as_plain_text() -> None:
    done = subprocess.run(
        [sys.executable, FEED, "tripped", "monitor", "--once"], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "collision, joint 3, index +4.21 Nm" in done.stdout
    assert "\x1b" not in done.stdout
    assert max(len(line) for line in done.stdout.splitlines()) <= 100


def test_json_is_one_object_per_line() -> None:
    arguments = ["monitor", "--json", "--every", "0.5", "--duration", "1.8"]
    done = subprocess.run([sys.executable, FEED, "tripped", *arguments], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(lines) == 3
    assert lines[-1]["verdict"]["value"]["trip_number"] == 7
    assert lines[0]["time_s"] < lines[-1]["time_s"]
    now = datetime.datetime.now().timestamp()
    assert abs(lines[-1]["time_s"] - now) < 60


class ReceiveOnlyBus(can.BusABC):
    """A bus that cannot send; its frames come from a list."""

    channel_info = "receive only"

    def __init__(self, frames: Iterator[can.Message]) -> None:
        super().__init__(channel="receive only")
        self._frames = frames
        self.sent = 0

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        frame = next(self._frames, None)
        if frame is None:
            time.sleep(timeout or 0.0)
        return frame, False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.sent += 1
        raise AssertionError(f"the monitor sent {msg}")


@pytest.mark.parametrize("arguments", [["--once"], ["--json", "--duration", "1", "--every", "0.2"]])
def test_the_monitor_sends_nothing(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    feed = Feed(WIRE)
    bus = ReceiveOnlyBus(frame for script in (MOVING, TRIPPED, MOVING) * 20 for frame in feed.frames(script))
    monkeypatch.setattr(command, "open_bus", lambda *_, **__: bus)
    cli.main(["monitor", *arguments])
    assert "StopCommand" in capsys.readouterr().out
    assert bus.sent == 0


def test_the_live_view_sends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second node on the same bus receives nothing but the frames of the feed."""
    with can.Bus(interface="virtual", channel="watched") as bus, can.Bus(interface="virtual", channel="watched") as ear:
        feed = Feed(WIRE)
        sent = [frame for _ in range(20) for frame in feed.frames(MOVING)]
        threading.Timer(0.2, lambda: [bus.send(frame) for frame in sent]).start()
        monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
        assert cli.main(["monitor", "-i", "virtual", "-c", "watched", "--duration", "1"]) == 1
        heard = []
        while (frame := ear.recv(0.0)) is not None:
            heard.append(frame)
        assert len(heard) == len(sent)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--once", "-i", "socketcan", "-c", "nosuchcan0"], "CAN bus socketcan nosuchcan0: "),
        (["--once", "--duration", "0"], "--duration 0 is not a positive number"),
        (["--json", "--every", "-1"], "--every -1 is not a positive number"),
        ([], "the live view needs a terminal; use --once or --json"),
    ],
)
def test_a_wrong_bus_option_or_terminal_gives_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["monitor", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert err.count("\n") == 1


def test_a_bus_that_disappears_gives_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def unplugged() -> Iterator[can.Message]:
        yield from Feed(WIRE).frames(MOVING)
        raise can.CanOperationError("Failed to receive: No such device")

    monkeypatch.setattr(command, "open_bus", lambda *_, **__: ReceiveOnlyBus(unplugged()))
    assert cli.main(["monitor", "--once"]) == 2
    assert "Failed to receive: No such device" in capsys.readouterr().err


def test_a_terminal_that_cannot_show_the_view_is_refused() -> None:
    with Terminal([FEED, "moving", "monitor"], 80, 24, kind="dumb") as terminal:
        assert terminal.wait() == 2
        assert "this terminal (TERM) cannot show the live view; use --once or --json" in terminal.output


def test_the_monitor_counts_and_waits_while_an_interface_is_down(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Flapping:
        def __init__(self) -> None:
            feed = Feed(WIRE)
            self._frames = iter([frame for _ in range(3) for frame in feed.frames(MOVING)])
            self._down = True

        def __iter__(self) -> Iterator[can.Message]:
            return self

        def __next__(self) -> can.Message:
            if self._down:
                self._down = False
                raise can.CanOperationError("Network is down", errno.ENETDOWN)
            return next(self._frames)

    monkeypatch.setattr(command, "open_bus", lambda *_, **__: ReceiveOnlyBus(Flapping()))
    cli.main(["monitor", "--once", "--json", "--duration", "0.1"])
    output = capsys.readouterr()
    assert output.err == ""
    seen = json.loads(output.out)
    assert seen["error_frames"] == 1
    assert seen["verdict"] is not None
