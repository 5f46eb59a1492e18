"""`tauperp replay LOG`: reads a log, finds its guard's configuration, compares the frames and reports the result."""

import dataclasses
import itertools
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tauperp.config import Configuration
from tauperp.errors import InputError
from tauperp.firmware import load_library
from tauperp.provenance import provenance, provenance_line
from tauperp.replay.buslog import BusLog, channel_name
from tauperp.replay.compare import Comparison
from tauperp.replay.origin import Origin, check_configuration, configuration_of, look_ahead
from tauperp.replay.showing import LogShow
from tauperp.run.scenario import load_scenario, shipped
from tauperp.sim.moment import Watch
from tauperp.wire import Wire
from tauperp.words import spoken

_LOOKED_AT = 20_000  # frames, for the channel of the guard


@dataclasses.dataclass(frozen=True)
class LogReplay:
    """One log, compared as far as it could be read."""

    path: Path
    comparison: Comparison
    damage: str | None  # where the log could not be read on
    took_s: float
    passed_over: int = 0  # lines or objects of the log that are not frames
    other_channels: Mapping[str, int] = dataclasses.field(default_factory=dict)  # frames on the omitted channels

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
    channel: str | None = None,
    watch: Watch | None = None,
) -> LogReplay:
    """Compare a whole log; `watch` gets every tick.

    config, robot   of the guard in the log: a file or preset; without it, the shipped ones are tried
    scenario        a file or shipped name instead: the configuration that `tauperp run` gave it
    chain           the part of the robot's file that is the arm, as for load_configuration
    channel         only this one of the log's, named as the file does; without it the only one with a guard

    Raises InputError for a file that is not a bus log, has no guard in it, or had another configuration.
    """
    wire = Wire.read()
    log = BusLog(path, channel or _channel_of_guard(path, wire))
    taken, origin = look_ahead(log, wire, log.path)
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
    return LogReplay(log.path, comparison, damage, time.monotonic() - begin, log.passed_over, _others(log))


def _channel_of_guard(path: str | Path, wire: Wire) -> str | None:
    """The channel of the StopCommands among a log's first frames; None if it has one channel, or no guard.

    Raises InputError, with the channels that there are, if there are guards on several.
    """
    log, stop = BusLog(path), wire.message("StopCommand").id
    guards: dict[str, int] = {}
    for frame in itertools.islice(log, _LOOKED_AT):
        if frame.arbitration_id == stop and not frame.is_extended_id:
            guards[channel_name(frame)] = guards.get(channel_name(frame), 0) + 1
    if len(guards) > 1:
        named = ", ".join(f"{name} ({count} frames)" for name, count in sorted(log.channels.items()))
        raise InputError(f"{path}: guards on several channels: {named}; choose one with --log-channel")
    return next(iter(guards), None) if len(log.channels) > 1 else None


def _others(log: BusLog) -> dict[str, int]:
    """Frames on the omitted channels."""
    return {name: count for name, count in log.channels.items() if log.channel not in (None, name)}


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


def _only_format(replay: LogReplay) -> bool:
    """Whether the first frame that differs has the same bytes in the other format."""
    first = replay.comparison.first
    return first is not None and first.logged_data == first.our_data


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
        "passed_over": replay.passed_over,
        "other_channels": replay.other_channels,
        "only_format_differs": _only_format(replay),
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
        yield f"frames of other wires: {one.foreign_frames}; cycles without StopCommand: {one.lost_ticks}"
    if replay.passed_over:
        yield f"in the log that are not frames: {replay.passed_over} lines or objects"
    if replay.other_channels:
        named = ", ".join(f"{name} ({count})" for name, count in replay.other_channels.items())
        yield f"frames on other channels, omitted: {named}"
    if one.out_of_sequence:
        yield f"StopCommands out of sequence: {one.out_of_sequence}; two guards, or two logs in one file"
    for why in dict.fromkeys(one.masked.values()):
        yield f"masked, {why}: {', '.join(name for name, reason in one.masked.items() if reason == why)}"
    for trip in one.trips:
        about = f", joint {trip.joint}" if trip.joint else ""
        index = f", {trip.index_nm:.2f} of {trip.threshold_nm:.2f} Nm" if trip.threshold_nm else ""
        yield f"trip at {trip.time_s:.6f} s: {spoken(trip.reason.name)}{about}{index}"
    if _only_format(replay):
        yield "only the frame format differs (classic or CAN FD), the bytes are the same"
    if one.first is not None:
        first = one.first
        yield f"first difference at {first.time_s:.6f} s, cycle {first.cycle}, {first.message}:"
        for name in first.logged:
            yield f"  {name:<20}{first.logged[name]:>12} in the log, {first.ours[name]} here"
        yield f"  {'data':<20}{first.logged_data or 'none'} in the log, {first.our_data or 'none'} here"
    if replay.damage is None:
        yield "equal" if replay.equal else "not equal"
    yield provenance_line(provenance(load_library(one.origin.numeric), one.configuration))
