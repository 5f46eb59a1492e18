"""Both experiments of the paper through the process: every byte of StopCommand, GuardStatus and GuardIndex as in the
library.

The library's run is recorded from python-can's virtual bus, then its robot's frames are played to the process in
lockstep. The robot obeys the guard's frames, so equal frames mean an equal experiment.
"""

import hashlib
import json
import subprocess
from pathlib import Path

import bus_guard
import can
import pytest
from bus_guard import ROOT
from bus_kit import Start
from bus_robot import INDEX, STATUS, STOP_COMMAND

from tauperp.experiment import EXPERIMENTS, Setup, run_scenario
from tauperp.files import dbc_path, write_atomically
from tauperp.run.scenario import Scenario, load_scenario, shipped

OF_GUARD = (STOP_COMMAND, STATUS, INDEX)
SLICE_CYCLES = 400
SLICE_PERIOD_S = 0.008  # a rate of canplayer that User-Mode Linux can process
FRAMES_A_CYCLE = 2

Recorded = tuple[Scenario, list[can.Message], Path]  # frames in the order of the bus, and a candump log of them


def log_line(frame: can.Message, timestamp_s: float) -> str:
    """Formatted like candump -L."""
    flags = f"#{4 | (1 if frame.bitrate_switch else 0)}" if frame.is_fd else ""
    return f"({timestamp_s:017.6f}) vcan0 {frame.arbitration_id:03X}#{flags}{frame.data.hex().upper()}\n"


@pytest.fixture(scope="module", params=EXPERIMENTS)
def recorded(request: pytest.FixtureRequest) -> Recorded:
    """Cached in build/bus while firmware, DBC and scenario are unchanged: a run takes half a minute."""
    scenario = load_scenario(shipped(request.param))
    made_of = (ROOT / "build" / "libtauperp.so", dbc_path(), shipped(request.param))
    key = hashlib.sha256(b"".join(path.read_bytes() for path in made_of) + scenario.configuration.block())
    log = ROOT / "build" / "bus" / f"{request.param}-{key.hexdigest()[:16]}.log"
    if not log.is_file():
        for old in log.parent.glob(f"{request.param}-*.log"):
            old.unlink()
        recording: list[can.Message] = []
        outcome = run_scenario(scenario, Setup(channels=2), listener=recording.append)
        assert outcome.report["stops"], "an experiment without a stop is too weak a test"
        write_atomically(log, "".join(log_line(frame, frame.timestamp) for frame in recording))
    with can.CanutilsLogReader(log) as reader:
        frames = list(reader)
    return scenario, frames, log


def test_every_answer_is_the_librarys_bit_for_bit(start: Start, recorded: Recorded) -> None:
    scenario, frames, log = recorded
    process = start(scenario.configuration, "--lockstep", program=bus_guard.RELEASE)
    result = subprocess.run([bus_guard.PEER, "replay", "vcan0", log], capture_output=True, text=True, timeout=600)
    report = json.loads(result.stdout)
    expected = sum(frame.arbitration_id in OF_GUARD for frame in frames)
    assert result.returncode == 0, f"{report} {log.read_text().splitlines()[report['differs_at_line'] - 1]}"
    assert report == {"same": expected, "sent": len(frames) - expected}
    end = process.end()
    assert end["frames"] == len(frames) - expected
    assert end["ticks"] == expected / FRAMES_A_CYCLE + 1  # a last tick at the end
    assert (end["overflows"], end["unsent"]) == (0, 0)


def test_a_different_answer_is_detected(start: Start, recorded: Recorded, tmp_path: Path) -> None:
    """The comparison can fail: one bit of one recorded answer is enough."""
    scenario, frames, log = recorded
    lines = log.read_text().splitlines(keepends=True)[: 20 * 11]
    place = max(number for number, frame in enumerate(frames[: 20 * 11]) if frame.arbitration_id == INDEX)
    last = lines[place].rstrip("\n")
    lines[place] = f"{last[:-1]}{int(last[-1], 16) ^ 1:X}\n"
    broken = tmp_path / "broken.log"
    broken.write_text("".join(lines))
    start(scenario.configuration, "--lockstep", program=bus_guard.RELEASE)
    result = subprocess.run([bus_guard.PEER, "replay", "vcan0", broken], capture_output=True, text=True, timeout=60)
    assert result.returncode == 1
    assert json.loads(result.stdout)["differs_at_line"] == place + 1


def test_canplayer_and_candump_confirm_the_answers(start: Start, recorded: Recorded, tmp_path: Path) -> None:
    """The first part again with can-utils as peers, in real time."""
    scenario, frames, _ = recorded
    period_s = scenario.configuration.period_us * 1e-6
    early = [frame for frame in frames if frame.timestamp < SLICE_CYCLES * period_s - period_s / 2]
    expected = [(frame.arbitration_id, bytes(frame.data)) for frame in early if frame.arbitration_id in OF_GUARD]
    played = tmp_path / "robot.log"
    robot = [frame for frame in frames if frame.arbitration_id not in OF_GUARD][: len(early) - len(expected)]
    cycle = -1
    with open(played, "w") as file:
        for frame in robot:
            cycle += frame.arbitration_id == 0x020
            file.write(log_line(frame, 1.0 + max(cycle, 0) * SLICE_PERIOD_S))
    received = tmp_path / "guard.log"
    with bus_guard.candump(received, "vcan0,010:7FF,200:7FE"):
        process = start(scenario.configuration, "--lockstep", program=bus_guard.RELEASE)
        subprocess.run(["canplayer", "-I", str(played)], check=True, timeout=120)
        process.end()
    with can.CanutilsLogReader(received) as reader:
        answers = [(frame.arbitration_id, bytes(frame.data)) for frame in reader]
    assert len(expected) > SLICE_CYCLES
    assert answers[: len(expected)] == expected
    assert len(answers) == len(expected) + FRAMES_A_CYCLE  # and the last stop
