"""`tauperp replay LOG`: a log read, its guard's configuration found, its frames compared, and all of it told."""

import dataclasses
import itertools
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tauperp.config import Configuration
from tauperp.firmware import load_library
from tauperp.provenance import provenance, provenance_line
from tauperp.replay.buslog import BusLog
from tauperp.replay.compare import Comparison
from tauperp.replay.origin import Origin, check_configuration, configuration_of, look_ahead
from tauperp.replay.showing import LogShow
from tauperp.scenario import load_scenario, shipped
from tauperp.sim.moment import Watch
from tauperp.wire import Wire


@dataclasses.dataclass(frozen=True)
class LogReplay:
    """One log, compared as far as it could be read."""

    path: Path
    comparison: Comparison
    damage: str | None  # where the log could not be read on
    took_s: float

    @property
    def equal(self) -> bool:
        return self.comparison.equal


def replay_log(
    path: str | Path,
    *,
    config: str | Path | None = None,
    robot: str | Path | None = None,
    scenario: str | None = None,
    chain: Mapping[str, Any] | None = None,
    watch: Watch | None = None,
) -> LogReplay:
    """Compare a whole log; `watch` sees every tick.

    config, robot   of the guard in the log: a file or preset; without any, what is shipped is tried
    scenario        a file or shipped name instead: the configuration that `tauperp run` gave it
    chain           which part of the robot's file is the arm, as for load_configuration

    Raises InputError for a file that is no bus log, has no guard in it, or had another configuration.
    """
    log = BusLog(path)
    taken, origin = look_ahead(log, Wire.read(), log.path)
    comparison = Comparison(_configuration(origin, log.path, config, robot, scenario, chain), origin)
    begin = time.monotonic()
    show = None if watch is None else LogShow(comparison.configuration, watch)
    for frame in itertools.chain(taken, log):
        cycles = comparison.cycles
        comparison.take(frame)
        if show is not None:
            show.hear(frame)
            if comparison.cycles > cycles and comparison.verdict is not None:
                show.show(comparison.verdict, frame.timestamp - comparison.begin_s)
    damage = None if log.damage is None else str(log.damage)
    return LogReplay(log.path, comparison, damage, time.monotonic() - begin)


def _configuration(
    origin: Origin,
    path: Path,
    config: str | Path | None,
    robot: str | Path | None,
    scenario: str | None,
    chain: Mapping[str, Any] | None,
) -> Configuration:
    if scenario is None:
        return configuration_of(origin, path, config, robot, chain)
    file = scenario if Path(scenario).suffix == ".toml" else shipped(scenario)
    configuration = load_scenario(file, robot=robot, chain=chain).configuration
    check_configuration(configuration, origin, path)
    return configuration


def report(replay: LogReplay) -> dict[str, Any]:
    """As JSON. Times in s of the log's time stamps, Nm."""
    one = replay.comparison
    first = one.first
    return {
        "log": replay.path.name,
        "equal": replay.equal and replay.damage is None,
        "damage": replay.damage,
        "frames": one.frames,
        "foreign_frames": one.foreign_frames,
        "cycles": one.cycles,
        "compared_cycles": one.compared_cycles,
        "lost_ticks": one.lost_ticks,
        "out_of_sequence": one.out_of_sequence,
        "duration_s": round(one.end_s - one.begin_s, 6),
        "clock": "lockstep" if one.origin.lockstep else "time stamps",
        "joined": one.origin.joined,
        "masked": one.masked,
        "messages": {name: dataclasses.asdict(count) for name, count in one.counts.items()},
        "first_difference": None if first is None else dataclasses.asdict(first),
        "trips": [
            {
                "cycle": trip.cycle,
                "time_s": round(trip.time_s, 6),
                "reason": trip.reason.name,
                "joint": trip.joint,
                "index_nm": round(trip.index_nm, 4),
                "threshold_nm": round(trip.threshold_nm, 4),
            }
            for trip in one.trips
        ],
        "robot": one.configuration.robot.name,
        "cycles_per_s": round(one.cycles / replay.took_s),
        "hashes": provenance(load_library(one.origin.numeric), one.configuration),
    }


def lines(replay: LogReplay) -> Iterator[str]:
    """The same for people."""
    one = replay.comparison
    clock = "in lockstep" if one.origin.lockstep else "by time stamps"
    yield (
        f"{replay.path.name}: {one.frames} frames, {one.cycles} cycles {clock}, {one.end_s - one.begin_s:.3f} s; "
        f"{one.cycles / replay.took_s:.0f} cycles/s"
    )
    yield f"{'message':<14}{'equal':>9}{'different':>11}{'missing':>9}"
    for name, count in one.counts.items():
        yield f"{name:<14}{count.equal:>9}{count.different:>11}{count.missing:>9}"
    if one.origin.joined:
        since = f"{one.compared_cycles} of {one.cycles} cycles compared" if one.compared_cycles else "nothing compared"
        yield f"the log begins with a guard that was running: {since}"
    if one.foreign_frames or one.lost_ticks:
        yield f"frames of nobody on this wire: {one.foreign_frames}; cycles without StopCommand: {one.lost_ticks}"
    if one.out_of_sequence:
        yield f"StopCommands out of sequence: {one.out_of_sequence}; two guards, or two logs in one file"
    for why in dict.fromkeys(one.masked.values()):
        yield f"masked, {why}: {', '.join(name for name, reason in one.masked.items() if reason == why)}"
    for trip in one.trips:
        about = f", joint {trip.joint}" if trip.joint else ""
        index = f", {trip.index_nm:.2f} of {trip.threshold_nm:.2f} Nm" if trip.threshold_nm else ""
        yield f"trip at {trip.time_s:.6f} s: {trip.reason.name}{about}{index}"
    if one.first is not None:
        first = one.first
        yield f"first difference at {first.time_s:.6f} s, cycle {first.cycle}, {first.message}:"
        for name in first.logged:
            yield f"  {name:<20}{first.logged[name]:>12} in the log, {first.ours[name]} here"
        yield f"  {'data':<20}{first.logged_data or 'none'} in the log, {first.our_data or 'none'} here"
    if replay.damage is None:
        yield "equal" if replay.equal else "not equal"
    yield provenance_line(provenance(load_library(one.origin.numeric), one.configuration))
