"""The wire: every message of the DBC encoded, decoded, protected and checked, with cantools and autosar-e2e.

Each frame carries AUTOSAR E2E profile 2: byte 0 the CRC, the low nibble of byte 1 the counter. Signals are given and
returned in the DBC's units (rad, rad/s, Nm, m/s^2), `CRC` and `Counter` left out; value tables stay numbers.
"""

import enum
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import can
import cantools
from cantools.database.can import Database, Message
from cantools.database.utils import create_encode_decode_formats
from e2e import p02

from tauperp.errors import InputError
from tauperp.files import dbc_path

COUNTER_MASK = 0x0F
COUNTER_BITS, CYCLE_HIGH_MASK = 4, 3  # JointState.CycleHigh: the two bits of the cycle above its counter
DATA_IDS = 16
_HEADER = ("CRC", "Counter")
_JOINT_STATE = "JointState"


class E2EStatus(enum.IntEnum):
    """The numbers of e2e_status_t in firmware/wire/e2e.h."""

    UNCHECKED = 0
    WRONG_CRC = 1
    REPEATED = 2
    WRONG_SEQUENCE = 3
    INITIAL = 4
    SOME_LOST = 5
    OK = 6

    @property
    def accepted(self) -> bool:
        """Whether the frame may update signals."""
        return self in (E2EStatus.OK, E2EStatus.SOME_LOST)


@dataclass(frozen=True, slots=True)
class _Scaling:
    """Scaling of one signal to its raw integer, and the raw range that the DBC allows."""

    name: str
    factor: float
    offset: float
    raw_min: int
    raw_max: int
    unit: str

    def raw(self, message: str, value: float) -> int:
        """Nearest raw integer. Raises InputError out of the DBC's range, which is never clamped."""
        try:
            raw = round((float(value) - self.offset) / self.factor)  # round() of numpy's float takes 20 times as long
        except (ValueError, OverflowError):  # NaN, infinity
            raise InputError(f"{message}.{self.name}: {value} is not a number that a frame can carry") from None
        if not self.raw_min <= raw <= self.raw_max:
            low, high = (self.offset + self.factor * limit for limit in (self.raw_min, self.raw_max))
            place = f"{message}.{self.name}: {value:g} {self.unit}".rstrip()
            raise InputError(f"{place} is outside {low:g} to {high:g}")
        return raw

    def holds(self, value: float | None) -> bool:
        """Whether a decoded value is in the DBC's range. True for a signal that is not in this frame (None)."""
        return value is None or self.raw_min <= round((value - self.offset) / self.factor) <= self.raw_max


@dataclass(frozen=True, eq=False)
class WireMessage:
    """One message of the DBC with its E2E rules."""

    definition: Message
    joint: int  # 1 to 8 for JointState1..8, else 0
    data_ids: bytes
    max_delta: int  # largest counter step that is accepted
    timeout_cycles: int  # cycles of silence after which the sender counts as missing; 0: never
    cycle_time_ms: int  # at 500 Hz; 0: an event
    counter_is_cycle: bool
    name: str = field(init=False)
    id: int = field(init=False)
    length: int = field(init=False)
    _scalings: tuple[_Scaling, ...] = field(init=False, repr=False)
    _packer: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        definition = self.definition
        # What Message.encode() compiles for a message without multiplexing; called directly it is ten times faster.
        formats = create_encode_decode_formats(definition.signals, definition.length)
        derived = {
            "name": definition.name,
            "id": definition.frame_id,
            "length": definition.length,
            "_scalings": tuple(_scaling(signal) for signal in definition.signals if signal.name not in _HEADER),
            "_packer": None if definition.is_multiplexed() else formats.little_endian,
        }
        for attribute, value in derived.items():
            object.__setattr__(self, attribute, value)

    @property
    def multiplexers(self) -> tuple[str, ...]:
        return tuple(signal.name for signal in self.definition.signals if signal.is_multiplexer)

    def encode(self, signals: Mapping[str, float]) -> bytearray:
        """The frame's bytes with CRC and counter zero, and a joint's CycleHigh zero unless it is given.

        Raises InputError for a signal that is missing, unknown, not finite or out of its range.
        """
        if self._packer is None:
            return self._encode_multiplexed(signals)
        if self.joint:
            signals = {"CycleHigh": 0, **signals}
        raw = {"CRC": 0, "Counter": 0}
        try:
            for scaling in self._scalings:
                name = scaling.name
                raw[name] = scaling.raw(self.name, signals[name])
        except KeyError as error:
            raise InputError(f"{self.name}: signal {error.args[0]} is missing") from error
        if len(signals) != len(self._scalings):
            unknown = ", ".join(name for name in signals if name not in raw or name in _HEADER)
            raise InputError(f"{self.name}: no signal {unknown} to set")
        data = bytearray(self._packer.pack(raw))
        data.reverse()  # cantools packs little-endian signals from the last byte to the first
        return data

    def _encode_multiplexed(self, signals: Mapping[str, float]) -> bytearray:
        for scaling in self._scalings:
            if scaling.name in signals:
                scaling.raw(self.name, signals[scaling.name])
        try:
            return bytearray(self.definition.encode({"CRC": 0, "Counter": 0, **signals}))
        except (cantools.database.EncodeError, KeyError) as error:
            raise InputError(f"{self.name}: {' '.join(str(error).split())}") from error

    def decode(self, data: bytes | bytearray) -> dict[str, float]:
        """Signals of a frame of the right length, in physical units, without a check of range and CRC.

        Raises InputError for another length or an unknown multiplexer value.
        """
        try:
            decoded = self.definition.decode(bytes(data), decode_choices=False)
        except cantools.database.DecodeError as error:
            raise InputError(f"{self.name}: {error}") from error
        return {name: value for name, value in decoded.items() if name not in _HEADER}  # type: ignore[union-attr, misc]

    def out_of_range(self, signals: Mapping[str, float]) -> tuple[str, ...]:
        """Names of the signals outside the DBC's range: not available, or sent by a defective sender."""
        return tuple(scaling.name for scaling in self._scalings if not scaling.holds(signals.get(scaling.name)))

    def seal(self, data: bytearray, counter: int) -> None:
        """Write the counter's low nibble and the CRC into encoded bytes."""
        data[1] = (data[1] & ~COUNTER_MASK & 0xFF) | (counter & COUNTER_MASK)
        p02.e2e_p02_protect(data, self.data_ids, increment_counter=False)


def _scaling(signal: Any) -> _Scaling:
    factor, offset = float(signal.scale), float(signal.offset)
    low, high = (round((limit - offset) / factor) for limit in (signal.minimum, signal.maximum))
    return _Scaling(signal.name, signal.scale, signal.offset, low, high, signal.unit or "")


@dataclass(frozen=True, eq=False)
class Wire:
    """The DBC: its identity and its messages."""

    path: Path
    crc: int  # CRC-32 of what the file means (`_meaning`), as in the firmware and the configuration block
    version: int  # the DBC's WireVersion
    database: Database = field(repr=False)
    messages: Mapping[str, WireMessage] = field(repr=False)  # by name, in the order of the file
    by_id: Mapping[int, WireMessage] = field(repr=False)

    @classmethod
    def read(cls, path: str | Path | None = None) -> "Wire":
        """From dbc/tauperp.dbc or another file.

        Raises InputError if the file is missing, not a DBC file, or breaks a rule that the wire relies on.
        """
        path = dbc_path() if path is None else Path(path)
        try:
            return replace(_wire_of(path.read_bytes()), path=path)
        except OSError as error:
            raise InputError(f"{path}: cannot read the wire's DBC file: {error.strerror}") from error
        except InputError as error:
            raise InputError(f"{path}: {error}") from error

    @property
    def hash(self) -> str:
        """The wire's identity as eight hex digits: what every result is printed with."""
        return f"{self.crc:08x}"

    def message(self, name: str) -> WireMessage:
        """Raises InputError if the wire has no such message."""
        try:
            return self.messages[name]
        except KeyError:
            raise InputError(f"{self.path.name}: no message {name}") from None


@lru_cache(maxsize=4)  # cantools takes 15 ms, and each configuration reads the wire
def _wire_of(content: bytes) -> Wire:
    """The wire of a DBC file's content, without a path."""
    try:
        database = cantools.database.load_string(content.decode("utf-8"), "dbc")
    except (cantools.Error, UnicodeDecodeError) as error:
        raise InputError(f"not a DBC file: {' '.join(str(error).split())}") from error
    if not isinstance(database, Database) or database.dbc is None:
        raise InputError("not a DBC file")
    try:
        version = int(database.dbc.attributes["WireVersion"].value)
        messages = {message.name: _message(message) for message in database.messages}
    except KeyError as error:
        raise InputError(f"attribute {error.args[0]} is missing") from error
    _check_data_ids(messages.values())
    by_id = {message.id: message for message in messages.values()}
    return Wire(Path(), zlib.crc32(_meaning(version, by_id).encode()), version, database, messages, by_id)


def _meaning(version: int, by_id: Mapping[int, WireMessage]) -> str:
    """Everything on which both ends of a bus must agree: one line per message and signal, ordered by id and place.

    Layouts, scalings, ranges, value tables, E2E data and times; not comments, names of signals, order or receivers.
    """
    lines = [str(version)]
    for number, message in sorted(by_id.items()):
        rules = (message.max_delta, message.timeout_cycles, message.cycle_time_ms, message.counter_is_cycle)
        lines.append(f"{number:X} {message.length} {message.data_ids.hex()} {rules}")
        for signal in sorted(message.definition.signals, key=lambda s: (s.multiplexer_ids or [-1], s.start)):
            place = (signal.start, signal.length, signal.byte_order, signal.is_signed, signal.is_multiplexer)
            numbers = (signal.scale, signal.offset, signal.minimum, signal.maximum)
            values = sorted((int(value), str(name)) for value, name in (signal.choices or {}).items())
            scaled = tuple(None if number is None else float(number) for number in numbers)
            lines.append(f" {signal.multiplexer_ids} {place} {scaled} {signal.unit} {values}")
    return "\n".join(lines)


def _message(definition: Message) -> WireMessage:
    assert definition.dbc is not None
    attributes = definition.dbc.attributes
    try:
        data_ids = bytes.fromhex(str(attributes["E2EDataIDs"].value))
    except ValueError as error:
        raise InputError(f"{definition.name}: E2EDataIDs are not hex digits") from error
    if len(data_ids) != DATA_IDS:
        raise InputError(f"{definition.name}: E2EDataIDs must be {DATA_IDS} bytes, not {len(data_ids)}")
    suffix = definition.name.removeprefix(_JOINT_STATE)
    source = attributes.get("CounterSource")
    return WireMessage(
        definition,
        joint=int(suffix) if definition.name.startswith(_JOINT_STATE) and suffix.isdecimal() else 0,
        data_ids=data_ids,
        max_delta=int(attributes["MaxDeltaCounter"].value),
        timeout_cycles=int(attributes["TimeoutCycles"].value),
        cycle_time_ms=int(attributes["GenMsgCycleTime"].value),
        counter_is_cycle=source is not None and source.value in (1, "Cycle"),
    )


def _check_data_ids(messages: Iterable[WireMessage]) -> None:
    """No two messages share a data id at the same counter; otherwise one could pass the check of the other."""
    seen: dict[tuple[int, int], str] = {}
    for message in messages:
        for entry in enumerate(message.data_ids):
            other = seen.setdefault(entry, message.name)
            if other != message.name:
                raise InputError(f"{other} and {message.name} share a data id at counter {entry[0]}")


class Sender:
    """Frames of one or more nodes, with a counter for each message.

    A message whose counter is the cycle's takes it from `cycle`; every other counts the frames sent, from 1. A joint's
    CycleHigh comes from `cycle` too, unless it is given.
    """

    def __init__(self, wire: Wire, *, fd: bool) -> None:
        self.wire = wire
        self.fd = fd
        self._counters: dict[str, int] = {}

    def frame(
        self, name: str, signals: Mapping[str, float], *, cycle: int | None = None, timestamp: float = 0.0
    ) -> can.Message:
        """One protected frame, ready to send.

        Raises InputError as WireMessage.encode does (no count is used up then), or if a cycle is missing.
        """
        message = self.wire.message(name)
        if message.joint and cycle is not None:
            signals = {"CycleHigh": cycle >> COUNTER_BITS & CYCLE_HIGH_MASK, **signals}
        data = message.encode(signals)
        if not message.counter_is_cycle:
            counter = (self._counters.get(name, 0) + 1) & COUNTER_MASK
            self._counters[name] = counter
        elif cycle is None:
            raise InputError(f"{name}: its counter is the cycle's, so it needs one")
        else:
            counter = cycle
        message.seal(data, counter)
        return can.Message(
            timestamp=timestamp,
            arbitration_id=message.id,
            is_extended_id=False,
            data=data,
            is_fd=self.fd,
            bitrate_switch=self.fd,
        )


@dataclass(frozen=True, slots=True)
class Received:
    """Result of a Receiver for one frame."""

    message: WireMessage
    status: E2EStatus
    lost: int  # frames missing right before this one
    signals: dict[str, float]  # empty unless the status is accepted and the signals were requested
    invalid: tuple[str, ...]  # the signals out of their DBC range: not to be used


class Receiver:
    """The E2E state machine of firmware/wire/e2e.h over every message of the wire."""

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        self._references: dict[int, int] = {}  # last counter, by id

    def receive(self, frame: can.Message, *, decode: bool = True) -> Received | None:
        """Check one frame; None if it is not of this wire (id, length, extended id, remote or error frame).

        Without `decode` its signals are not decoded, which takes a tenth of the time.
        """
        message = self.wire.by_id.get(frame.arbitration_id)
        special = frame.is_extended_id or frame.is_remote_frame or frame.is_error_frame
        if message is None or special or len(frame.data) != message.length:
            return None
        status, lost = self._check(message, frame.data)
        if not status.accepted or not decode:
            return Received(message, status, lost, {}, ())
        try:
            signals = message.decode(frame.data)
        except InputError:  # the length is right, so the multiplexer is wrong
            return Received(message, status, lost, {}, message.multiplexers)
        return Received(message, status, lost, signals, message.out_of_range(signals))

    def _check(self, message: WireMessage, data: bytes | bytearray) -> tuple[E2EStatus, int]:
        if not p02.e2e_p02_check(data, message.data_ids):
            return E2EStatus.WRONG_CRC, 0
        counter = data[1] & COUNTER_MASK
        reference = self._references.get(message.id)
        self._references[message.id] = counter
        if reference is None:
            return E2EStatus.INITIAL, 0
        delta = (counter - reference) & COUNTER_MASK
        if delta == 0:
            return E2EStatus.REPEATED, 0
        if delta > message.max_delta:
            return E2EStatus.WRONG_SEQUENCE, 0
        return (E2EStatus.OK if delta == 1 else E2EStatus.SOME_LOST), delta - 1
