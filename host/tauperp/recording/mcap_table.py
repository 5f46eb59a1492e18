"""Rows from an .mcap file with messages in JSON or in ROS 2's CDR.

Each message on the topic of the first position column is one row. A column of another topic has the value of that
topic's newest message before it. Messages before every topic has sent one are omitted. If a message has a list `name`
in addition to a list of values, as sensor_msgs/JointState does, each joint's value is found by its name.
"""

import array
import json
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tauperp.errors import InputError
from tauperp.recording.csv_table import Skipped
from tauperp.recording.mapping import Column, ColumnMap
from tauperp.recording.recording import FloatArray
from tauperp.recording.table_damage import TableDamage, needs_extra

_BLOCK_ROWS = 4096
_OWN_TIMES = ("log_time", "publish_time")
_MAGIC_BYTES = 8
_SHOWN_NAMES = 10
_RECORD_LIMIT = 1 << 28  # bytes of a record; a length beyond it is a broken file's


def mcap_blocks(path: Path, columns: ColumnMap, label: Column | None, skipped: Skipped) -> Iterator[FloatArray]:
    """Blocks of rows, (k, values): the readings in their order, then the label.

    Raises InputError if a topic or field is not there or in another encoding, TableDamage with the byte where the file
    ends or breaks.
    """
    used = [*columns.readings, label] if label else list(columns.readings)
    sources = [_Source.of(path, column, columns.names) for column in used]
    row_topic = sources[len(columns.time)].topic  # of the first position
    topics = {source.topic for source in sources} - {""}
    newest: dict[str, Any] = {}
    rows: list[list[float]] = []
    damage = None
    try:
        for topic, stamps, content in _messages(path, topics):
            newest[topic] = content
            if topic == row_topic and len(newest) == len(topics):
                rows.append([number for source in sources for number in source.numbers(path, stamps, newest)])
            if len(rows) == _BLOCK_ROWS:
                yield np.array(rows)
                rows = []
    except TableDamage as error:
        damage = error
    if rows:
        yield np.array(rows)
    if damage is not None:
        raise damage
    for topic in sorted(topics - newest.keys()):
        raise InputError(f"{path}: no message on the topic '{topic}'")


@dataclass(frozen=True)
class _Source:
    """Place of a column's values: a field of a topic's messages, or a message's own time."""

    column: Column
    topic: str  # empty: the stamps of the message that makes the row
    field: tuple[str, ...]
    joints: tuple[str, ...]  # names to pick the values by

    @classmethod
    def of(cls, path: Path, column: Column, joints: tuple[str, ...]) -> "_Source":
        if column.name in _OWN_TIMES:
            return cls(column, "", (column.name,), ())
        topic, colon, field = column.name.rpartition(":")
        if not (colon and topic and field):
            raise InputError(f"{path}: column '{column.name}' has no topic; name it 'topic:field' in a map (--map)")
        return cls(column, topic, tuple(field.split(".")), joints)

    def numbers(self, path: Path, stamps: dict[str, int], newest: dict[str, Any]) -> list[float]:
        """Raises InputError if there is no such field, or it does not contain the expected numbers."""
        value: Any = newest[self.topic] if self.topic else stamps
        parent: Any = None
        for name in self.field:
            parent, value = value, _member(value, name)
            if value is None:
                raise InputError(f"{path}: no field '{'.'.join(self.field)}' in a message on '{self.topic}'")
        values = value if self.column.width > 1 else [value]
        if self.column.width > 1 and self.joints:
            values = self._by_name(path, values, _member(parent, "name"))
        if not isinstance(values, list) or len(values) != self.column.width:
            raise InputError(f"{path}: '{self.column.name}' does not hold {self.column.width} values")
        if not all(isinstance(one, int | float) for one in values):
            raise InputError(f"{path}: '{self.column.name}' holds a value that is not a number")
        return [float(one) for one in values]

    def _by_name(self, path: Path, values: Any, names: Any) -> Any:
        """The joints' values in their order, if the message has a name for each value."""
        if not (isinstance(values, list) and isinstance(names, list) and len(names) == len(values)):
            return values
        missing = [joint for joint in self.joints if joint not in names]
        if missing:
            there = ", ".join(f"'{name}'" for name in names[:_SHOWN_NAMES])
            raise InputError(
                f"{path}: no joint '{missing[0]}' in a message on '{self.topic}' (it has {there}): name the robot's "
                "joints in their order at the top of a map: joints = [...]"
            )
        return [values[names.index(joint)] for joint in self.joints]


def _member(value: Any, name: str) -> Any:
    """A member of a JSON object or of a decoded message. Lists stay lists. None if it does not exist."""
    if isinstance(value, dict):
        return value.get(name)
    found = None if name.startswith("_") else getattr(value, name, None)
    if isinstance(found, tuple | array.array | np.ndarray):
        return list(found)
    return None if callable(found) else found


def _decoder(path: Path, channel: Any, schema: Any) -> Callable[[bytes], Any]:
    """The decoder of a message's bytes. Raises InputError for another encoding, or if its package is missing."""
    encoding = channel.message_encoding
    if encoding == "json":
        return json.loads
    decode = None
    if encoding == "cdr":
        try:
            from mcap_ros2.decoder import DecoderFactory
        except ImportError as error:
            raise needs_extra(path, "mcap-ros2-support") from error
        try:
            decode = DecoderFactory().decoder_for(encoding, schema)
        except Exception as error:  # a schema that is damaged
            raise InputError(f"{path}: '{channel.topic}': {' '.join(str(error).split())}") from error
    if decode is None:
        raise InputError(
            f"{path}: '{channel.topic}' is in {encoding}, and neither in JSON nor ROS 2's CDR with a schema"
        )
    decoder: Callable[[bytes], Any] = decode
    return decoder


def _messages(path: Path, topics: set[str]) -> Iterator[tuple[str, dict[str, int], Any]]:
    """Topic, own times and content of every message on these topics, in the order of the file."""
    try:
        from mcap.exceptions import EndOfFile
        from mcap.records import Channel, Message, Schema
        from mcap.stream_reader import StreamReader
    except ImportError as error:
        raise needs_extra(path, "mcap") from error
    channels: dict[int, tuple[str, Callable[[bytes], Any]]] = {}
    schemas: dict[int, Any] = {}
    count, begin_ns = 0, None
    with path.open("rb") as raw:
        try:
            for record in StreamReader(raw, validate_crcs=True, record_size_limit=_RECORD_LIMIT).records:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel) and record.topic in topics:
                    channels[record.id] = (record.topic, _decoder(path, record, schemas.get(record.schema_id)))
                elif isinstance(record, Message) and record.channel_id in channels:
                    topic, decode = channels[record.channel_id]
                    content = decode(record.data)
                    # since 1970, nanoseconds do not fit into a float
                    begin_ns = record.log_time if begin_ns is None else begin_ns
                    stamps = {
                        "log_time": record.log_time - begin_ns,
                        "publish_time": record.publish_time - begin_ns,
                    }
                    count += 1
                    yield topic, stamps, content
        except InputError:
            raise
        except Exception as error:  # its decompressors and decoders raise several types on a broken file
            cut = isinstance(error, struct.error | EndOfFile)
            what = "the file ends in the middle of a record" if cut else " ".join(str(error).split())
            what = what or type(error).__name__
            kind = f"not an .mcap file: {what}" if raw.tell() <= _MAGIC_BYTES else f"after {count} messages: {what}"
            raise TableDamage(f"{path}: byte {raw.tell()}: {kind}") from error
