"""Information in a bus log about its guard: the configuration, the clock, and how long it had run.

A guard sends all of it within one round of the pages of GuardStatus, so the first frames contain it.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import can

from tauperp.config import NUMERICS, Configuration, Numeric, load_configuration, preset_names
from tauperp.errors import InputError
from tauperp.firmware import Reason
from tauperp.robot.load import shipped
from tauperp.wire import COUNTER_MASK, Wire, WireMessage
from tauperp.wire_values import Page

_LOOK_AHEAD_TICKS = 64  # two rounds of pages and joints, and some lost
_LOOK_AHEAD_FRAMES = 20_000  # of a bus without a guard
_PAGES, _WIRE_FORMATS = len(Page), {"classic": 500.0, "fd": 1000.0}
_MAX_TICKS_BEFORE = 2464  # until counters (32 ticks), pages (22) and seven joints (14) are together again


@dataclasses.dataclass(frozen=True)
class Field:
    """One unsigned signal inside a frame's bytes; to read a million of them without decoding the frames."""

    shift: int
    mask: int

    @classmethod
    def of(cls, message: WireMessage, name: str) -> "Field":
        signal = message.definition.get_signal_by_name(name)
        return cls(signal.start, (1 << signal.length) - 1)

    def read(self, data: bytes | bytearray) -> int:
        return int.from_bytes(data, "little") >> self.shift & self.mask


@dataclasses.dataclass(frozen=True)
class Origin:
    """The guard in a log. None: the log ends before the guard has sent it."""

    config_crc: int | None
    numeric: Numeric
    channels: int  # 1 or 2
    build: tuple[int, int] | None  # FirmwareVersion, BuildId
    lockstep: bool  # its time was the bus's: no tick ever took any
    joined: bool  # it had received frames of the robot before the log begins
    ticks_before: int  # before the first in the log, modulo the round of its counters, pages and joints


def look_ahead(frames: Iterator[can.Message], wire: Wire, path: Path) -> tuple[list[can.Message], Origin]:
    """The first frames, taken from the iterator, and the information in them.

    Raises InputError if there is no StopCommand among them.
    """
    stop, status, index = (wire.message(name) for name in ("StopCommand", "GuardStatus", "GuardIndex"))
    taken: list[can.Message] = []
    stops: list[can.Message] = []
    pages: dict[int, can.Message] = {}
    told: dict[int, tuple[int, can.Message]] = {}  # the first status and the first index, with their tick
    page_of = Field.of(status, "Page")
    for frame in frames:
        taken.append(frame)
        if frame.arbitration_id == stop.id and len(frame.data) == stop.length:
            stops.append(frame)
        elif frame.arbitration_id in (status.id, index.id) and stops and len(frame.data) == status.length:
            told.setdefault(frame.arbitration_id, (len(stops) - 1, frame))
            if frame.arbitration_id == status.id:
                pages[page_of.read(frame.data)] = frame
        if len(stops) >= _LOOK_AHEAD_TICKS or len(taken) >= _LOOK_AHEAD_FRAMES:
            break
    if not stops:
        raise InputError(f"{path}: no StopCommand in its first {len(taken)} frames: there was no guard to compare with")
    first = stops[0].data
    before_the_robot = (Reason.SELF_TEST, Reason.WAITING_SYNC)
    joined = (
        Field.of(stop, "TripNumber").read(first) != 0 or Field.of(stop, "Reason").read(first) not in before_the_robot
    )

    def value(page: int, name: str) -> int | None:
        return Field.of(status, name).read(pages[page].data) if page in pages else None

    numeric: Numeric = next((name for name, number in NUMERICS.items() if number == value(6, "Numeric")), "float32")
    version, build = value(4, "FirmwareVersion"), value(4, "BuildId")
    return taken, Origin(
        config_crc=value(5, "ConfigCrc"),
        numeric=numeric,
        channels=value(7, "Channels") or 1,
        build=None if version is None or build is None else (version, build),
        lockstep=not (value(0, "TickTime") or value(6, "WorstTickTime")),
        joined=joined,
        ticks_before=_ticks_before(stops[0], told, wire, value(6, "RobotJoints") or 8),
    )


def _ticks_before(stop: can.Message, told: dict[int, tuple[int, can.Message]], wire: Wire, joints: int) -> int:
    """How many ticks bring a new guard to the counters, page and joint of the log; 0 if none does.

    The t-th tick since its start sends StopCommand with counter t, and alternately the next page or the next joint.
    """
    status, index = wire.message("GuardStatus"), wire.message("GuardIndex")
    kinds = {status.id: (1, Field.of(status, "Page"), _PAGES), index.id: (0, Field.of(index, "Joint"), joints)}

    def fits(first: int) -> bool:
        if first & COUNTER_MASK != _counter(stop):
            return False
        for identifier, (later, frame) in told.items():
            parity, turn, turns = kinds[identifier]
            tick = first + later
            number = (tick + parity) // 2  # of its kind, from 1
            if tick % 2 != parity or number & COUNTER_MASK != _counter(frame):
                return False
            if (number - 1) % turns != turn.read(frame.data):
                return False
        return True

    return next((first - 1 for first in range(1, _MAX_TICKS_BEFORE + 1) if fits(first)), 0)


def _counter(frame: can.Message) -> int:
    return frame.data[1] & COUNTER_MASK


def configuration_of(
    origin: Origin,
    path: Path,
    source: str | Path | None,
    robot: str | Path | None = None,
    chain: Mapping[str, Any] | None = None,
) -> Configuration:
    """The configuration that the guard in the log ran on, checked by its CRC where the log contains it.

    source      a file or preset; without one, every shipped preset on every shipped robot is tried

    Raises InputError if the named configuration has another CRC, or no shipped one has it.
    """
    if source is not None:
        configuration = load_configuration(source, robot=robot, chain=chain)
        check_configuration(configuration, origin, path)
        return configuration
    if origin.config_crc is None:
        raise InputError(f"{path}: ends before the guard reports its configuration: name it with --config")
    for preset in preset_names():
        for arm in (None, *shipped()) if robot is None else (robot,):
            for form, rate_hz in _WIRE_FORMATS.items():
                overrides = {"wire": {"rate_hz": rate_hz, "format": form}}
                try:
                    configuration = load_configuration(preset, robot=arm, overrides=overrides, chain=chain)
                    if configuration.crc(origin.numeric) == origin.config_crc:
                        return configuration
                except InputError:  # a preset that does not fit this robot
                    continue
    raise InputError(
        f"{path}: its guard ran on configuration {origin.config_crc:08x}, which belongs to no shipped preset: "
        "name the file with --config, or the scenario with --scenario"
    )


def check_configuration(configuration: Configuration, origin: Origin, path: Path) -> None:
    """Raises InputError, naming both, if the log's guard ran on another configuration."""
    own = configuration.crc(origin.numeric)
    if origin.config_crc is not None and own != origin.config_crc:
        raise InputError(
            f"{path}: its guard ran on configuration {origin.config_crc:08x}, {configuration.source} is {own:08x}"
        )
