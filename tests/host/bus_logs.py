"""Bus logs for the tests of recording and replay: their scenario, and how to read, write and replay them."""

from collections.abc import Iterable
from pathlib import Path

import can

from tauperp.replay.buslog import BusLog
from tauperp.replay.log_report import LogReplay, replay_log
from tauperp.sim.moment import Watch
from tauperp.wire import Wire

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


def replayed(path: Path, folder: Path, form: str = "fd", watch: Watch | None = None) -> LogReplay:
    return replay_log(path, scenario=str(folder / f"{form}.toml"), watch=watch)


def counts(replay: LogReplay) -> tuple[int, int, int]:
    """Equal, different and missing frames."""
    counts = replay.comparison.counts.values()
    return sum(one.equal for one in counts), sum(one.different for one in counts), sum(one.missing for one in counts)
