"""Rows from an .mcap file with messages in JSON.

The topic of the first position column makes the rows: each of its messages is one. A column of another topic has the
value of that topic's newest message before it; messages that come before every topic was heard are left out.
"""

import json
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tauperp.errors import InputError
from tauperp.replay.mapping import Column
from tauperp.replay.recording import FloatArray
from tauperp.replay.table_damage import TableDamage, needs_extra

_BLOCK_ROWS = 4096
_OWN_TIMES = ("log_time", "publish_time")
_MAGIC_BYTES = 8
_RECORD_LIMIT = 1 << 28  # bytes of a record; a length beyond it is a broken file's


def mcap_blocks(path: Path, columns: Sequence[Column], label: Column | None) -> Iterator[FloatArray]:
    """Blocks of rows, (k, values), with the columns in their order.

    Raises InputError if a topic or field is not there or not in JSON, TableDamage with the byte where the file ends or
    breaks.
    """
    sources = [_Source.of(path, column) for column in ([*columns, label] if label else columns)]
    row_topic = sources[1].topic  # of the first position
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
    """Where a column's values are: a field of a topic's messages, or a message's own time."""

    column: Column
    topic: str  # empty: the stamps of the message that makes the row
    field: tuple[str, ...]

    @classmethod
    def of(cls, path: Path, column: Column) -> "_Source":
        if column.name in _OWN_TIMES:
            return cls(column, "", (column.name,))
        topic, colon, field = column.name.rpartition(":")
        if not (colon and topic and field):
            raise InputError(f"{path}: column '{column.name}' has no topic; name it 'topic:field' in a map (--map)")
        return cls(column, topic, tuple(field.split(".")))

    def numbers(self, path: Path, stamps: dict[str, int], newest: dict[str, Any]) -> list[float]:
        """Raises InputError if there is no such field, or it does not hold the numbers that it should."""
        value: Any = newest[self.topic] if self.topic else stamps
        for name in self.field:
            value = value.get(name) if isinstance(value, dict) else None
            if value is None:
                raise InputError(f"{path}: no field '{'.'.join(self.field)}' in a message on '{self.topic}'")
        values = value if self.column.width > 1 else [value]
        if not isinstance(values, list) or len(values) != self.column.width:
            raise InputError(f"{path}: '{self.column.name}' does not hold {self.column.width} values")
        if not all(isinstance(one, int | float) for one in values):
            raise InputError(f"{path}: '{self.column.name}' holds what is no number")
        return [float(one) for one in values]


def _messages(path: Path, topics: set[str]) -> Iterator[tuple[str, dict[str, int], Any]]:
    """Topic, own times and content of every message on these topics, in the order of the file."""
    try:
        from mcap.exceptions import EndOfFile
        from mcap.records import Channel, Message
        from mcap.stream_reader import StreamReader
    except ImportError as error:
        raise needs_extra(path, "mcap") from error
    channels: dict[int, str] = {}
    count, begin_ns = 0, None
    with path.open("rb") as raw:
        try:
            for record in StreamReader(raw, validate_crcs=True, record_size_limit=_RECORD_LIMIT).records:
                if isinstance(record, Channel) and record.topic in topics:
                    if record.message_encoding != "json":
                        raise InputError(f"{path}: '{record.topic}' is in {record.message_encoding}, and not in JSON")
                    channels[record.id] = record.topic
                elif isinstance(record, Message) and record.channel_id in channels:
                    content = json.loads(record.data)
                    # Since 1970 they are more nanoseconds than a float tells apart.
                    begin_ns = record.log_time if begin_ns is None else begin_ns
                    stamps = {
                        "log_time": record.log_time - begin_ns,
                        "publish_time": record.publish_time - begin_ns,
                    }
                    count += 1
                    yield channels[record.channel_id], stamps, content
        except InputError:
            raise
        except Exception as error:  # its decompressors and decoders raise several types on a broken file
            cut = isinstance(error, struct.error | EndOfFile)
            what = "the file ends in the middle of a record" if cut else " ".join(str(error).split())
            what = what or type(error).__name__
            kind = f"not an .mcap file: {what}" if raw.tell() <= _MAGIC_BYTES else f"after {count} messages: {what}"
            raise TableDamage(f"{path}: byte {raw.tell()}: {kind}") from error
