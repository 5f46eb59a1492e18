"""The event recorder from the compiled firmware to the file: a trip as the guard computed it, read over the bus."""

import json
import time
from pathlib import Path

import can
import numpy as np
import pytest
from test_score import still

from tauperp.commands.monitor import listen
from tauperp.config import Configuration, load_configuration
from tauperp.firmware import Guard, Reason
from tauperp.monitor import Monitor
from tauperp.monitor.events import AFTER, Event, EventFolder, EventReader
from tauperp.recording.playback import _Bus, at_rate_of

TRIP_ROW = 500


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    own = load_configuration("replay_panda")
    return at_rate_of(still(1.0), own.changed(sensor={"offset_nm": [-0.5, 0.3, -0.2, 0.4, 0.1, 0.1, -0.3]}))


@pytest.fixture(scope="module")
def told(configuration: Configuration) -> tuple[list[can.Message], np.ndarray, np.ndarray]:
    """All frames that a guard sends while its arm is pushed from TRIP_ROW on, and its r and index tick by tick."""
    recording = still(3.0, touched=[(TRIP_ROW * 0.005, TRIP_ROW * 0.005 + 0.3)])
    guard = Guard(configuration.block(), with_events=True)
    bus = _Bus(recording, configuration, "none")
    frames: list[can.Message] = []
    residual, index = [], []
    verdict = None
    for cycle in range(TRIP_ROW + 7500):  # three rounds of the recorder
        row = min(cycle, len(recording.time_s) - 1)
        samples = np.stack([recording.q[row], recording.qd[row], recording.tau[row]], axis=-1)
        asked = verdict.trip_number if verdict and not verdict.permitted and cycle < TRIP_ROW else None
        for frame in bus.frames(row, cycle, samples, asked):
            guard.receive(frame, cycle * configuration.period_us)
        verdict = guard.tick(cycle * configuration.period_us)
        frames += verdict.frames
        residual.append(verdict.residual)
        index.append(verdict.index)
    assert verdict is not None
    assert verdict.reason == Reason.COLLISION
    return frames, np.array(residual), np.array(index)


def read(frames: list[can.Message], configuration: Configuration) -> list[Event]:
    reader = EventReader(configuration.wire)
    return [event for frame in frames if (event := reader.hear(frame)) is not None]


def test_an_event_holds_r_and_index_around_the_trip(
    told: tuple[list[can.Message], np.ndarray, np.ndarray], configuration: Configuration
) -> None:
    frames, residual, index = told
    (event,) = read(frames, configuration)
    assert (event.trip, event.reason, event.joint) == (1, Reason.COLLISION, 2)
    assert event.step_s == pytest.approx(0.005)
    threshold = configuration.threshold_nm("none")[1]
    row = int(np.argmax(np.abs(index[:, 1]) > threshold))
    rows = slice(row - event.before, row + 1 + AFTER)
    np.testing.assert_allclose(event.residual, residual[rows], atol=0.0051)
    np.testing.assert_allclose(event.index, index[rows], atol=0.0051)
    assert set(event.task.tolist()) == {1}
    assert event.time_s[event.before] == 0.0


def test_a_lost_frame_is_sent_again(
    told: tuple[list[can.Message], np.ndarray, np.ndarray], configuration: Configuration
) -> None:
    frames, *_ = told
    identifier = configuration.wire.message("GuardEvent").id
    places = [place for place, frame in enumerate(frames) if frame.arbitration_id == identifier]
    damaged = list(frames)
    data = bytearray(damaged[places[50]].data)
    data[5] ^= 0x10
    damaged[places[50]] = can.Message(arbitration_id=identifier, is_extended_id=False, is_fd=False, data=data)
    del damaged[places[70]]
    (event,) = read(damaged, configuration)
    (whole,) = read(frames, configuration)
    np.testing.assert_array_equal(event.residual, whole.residual)


def test_events_are_written_and_drawn(
    told: tuple[list[can.Message], np.ndarray, np.ndarray], configuration: Configuration, tmp_path: Path
) -> None:
    folder = EventFolder(configuration.wire, tmp_path / "events")
    for frame in told[0]:
        folder.hear(frame)
    (path,) = folder.written
    content = json.loads(path.read_text())
    assert (path.name, content["reason"], content["joint"]) == ("trip-001.json", "Collision", 2)
    assert len(content["residual_nm"]) == len(content["time_s"]) == len(content["channel"])
    assert path.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


def test_the_monitor_writes_the_events_that_it_receives(
    told: tuple[list[can.Message], np.ndarray, np.ndarray], configuration: Configuration, tmp_path: Path
) -> None:
    identifier = configuration.wire.message("GuardEvent").id
    frames = iter([frame for frame in told[0] if frame.arbitration_id == identifier])

    class Played:
        def recv(self, timeout: float) -> can.Message | None:
            frame = next(frames, None)
            if frame is None:
                time.sleep(timeout)
            return frame

    begin = time.monotonic()
    monitor, folder = Monitor(configuration.wire, now_s=begin), EventFolder(configuration.wire, tmp_path)
    last = listen(Played(), monitor, begin, 3.0, 3.0, lambda snapshot: None, folder)
    assert [path.name for path in folder.written] == ["trip-001.json"]
    assert not next(one for one in last.traffic if one.name == "GuardEvent").missing


def test_a_guard_without_the_recorder_sends_no_events(configuration: Configuration) -> None:
    guard = Guard(configuration.block())
    assert all(len(guard.tick(tick * configuration.period_us).frames) == 2 for tick in range(50))
