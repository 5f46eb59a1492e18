"""Rows of a .csv file as real programs write it: any separator, decimal comma, text before the names, empty lines.

The line with the names is the first that holds every requested column, for one of the separators. A `#` before it is
ignored. Rows without any reading are not part of the recording; they are counted, not refused.
"""

import codecs
import csv
import gzip
import io
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, cast

import numpy as np

from tauperp.errors import InputError
from tauperp.recording.mapping import Column, ColumnMap
from tauperp.recording.recording import FloatArray
from tauperp.recording.table_damage import TableDamage

if TYPE_CHECKING:
    import _csv

SEPARATORS = (",", ";", "\t", "|", " ")
BLOCK_ROWS = 4096
_GZIP_MAGIC = b"\x1f\x8b"
_HEAD_BYTES = 1 << 16
_PIECE_BYTES = 1 << 10
_HEAD_LINES = 200  # of text before the names
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*$")
_TO_POINT = {ord(","): ".", ord("."): "'"}
_WORDS = {"true": "1", "false": "0", "yes": "1", "no": "0"}


@dataclass
class Skipped:
    """Content that a reader ignored, for the report, and the line of each row."""

    rows: int = 0  # without any of the readings
    units: bool = False  # a line of units under the names
    lines: list[int] = field(default_factory=list)  # of the file, for each row, from 1


@dataclass(frozen=True)
class _Head:
    names: list[str]
    separator: str
    line: int  # of the names, from 1


def has_column(path: Path, columns: ColumnMap, name: str) -> bool:
    """Whether such a column exists. False for a file that cannot be read: its reader reports why."""
    try:
        with path.open("rb") as raw:
            return name in _find_head(path, _first_lines(_text(raw, path)), columns).names
    except (OSError, EOFError, ValueError, zlib.error, csv.Error):
        return False


def csv_blocks(path: Path, columns: ColumnMap, label: Column | None, skipped: Skipped) -> Iterator[FloatArray]:
    """Blocks of rows, (k, values): the readings in their order, then the label.

    skipped: filled on the way. Raises InputError if a column is not there, TableDamage, with the line, where the file
    cannot be read on.
    """
    with path.open("rb") as raw:
        try:
            text = _text(raw, path)
            head = _find_head(path, _first_lines(text), columns)
        except (EOFError, zlib.error, gzip.BadGzipFile, UnicodeError, LookupError) as error:
            raise InputError(f"{path}: not a CSV file, plain or gzipped") from error
        picked = [_position(path, head, column) for column in (*columns.readings, *([label] if label else []))]
        rows = _Rows(path, picked, bool(label), len(columns.time), columns.decimal, skipped)
        yield from rows.blocks(raw, _reader(_kept(text), head.separator), head)


def _text(raw: IO[bytes], path: Path) -> io.TextIOWrapper:
    """The text: UTF-16 by its mark, UTF-8, or Windows' Western encoding if the first 64 kB are not UTF-8."""
    packed = raw.read(2) == _GZIP_MAGIC
    raw.seek(0)
    stream = cast(IO[bytes], gzip.GzipFile(fileobj=raw) if packed else raw)
    start = _start(stream)
    stream.seek(0)
    encoding = "utf-8-sig"
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encoding = "utf-16"
    elif b"\0" in start:
        raise InputError(f"{path}: not a CSV file, plain or gzipped")
    else:
        try:
            codecs.getincrementaldecoder("utf-8")().decode(start)
        except UnicodeDecodeError:
            if b"\n" not in start and b"\r" not in start:
                raise InputError(f"{path}: not a CSV file, plain or gzipped") from None
            encoding = "cp1252"
    return io.TextIOWrapper(stream, encoding=encoding, newline="")


def _start(stream: IO[bytes]) -> bytes:
    """The first bytes, as far as a truncated or broken file has them."""
    start = b""
    try:
        while len(start) < _HEAD_BYTES and (piece := stream.read(_PIECE_BYTES)):
            start += piece
    except (EOFError, zlib.error, gzip.BadGzipFile):
        pass  # the reader gets the same error again and reports it
    return start


def _first_lines(text: io.TextIOWrapper) -> Iterator[str]:
    """The lines that may precede the names."""
    for _ in range(_HEAD_LINES):
        line = text.readline()
        if not line:
            return
        yield line


def _kept(lines: Iterator[str]) -> Iterator[str]:
    """Comments as empty lines, so that line numbers stay correct."""
    return ("\n" if line.startswith("#") else line for line in lines)


def _reader(lines: Iterator[str], separator: str) -> "_csv.Reader":
    return csv.reader(lines, delimiter=separator, skipinitialspace=separator == " ")


def _cells(line: str, separator: str) -> list[str]:
    line = line.strip().lstrip("#").strip() if separator in (" ", "\t") or line.startswith("#") else line
    row = next(_reader(iter([line]), separator), [])
    return [name.strip() for name in row]


def _find_head(path: Path, lines: Iterator[str], columns: ColumnMap) -> _Head:
    """The line with the names; later lines are not read. Without one, the line that has most of them.

    If no line has any of them, the first line that is not a comment and splits into the most names.
    """
    separators = SEPARATORS if columns.separator is None else (columns.separator,)
    wanted = {column.name for column in columns.readings}
    best: tuple[tuple[int, bool, int, int], _Head] | None = None
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        for separator in separators:
            head = _Head(_cells(line, separator), separator, number)
            found = len(wanted & set(head.names))
            if found == len(wanted):
                return head
            rank = (found, not line.startswith("#"), -number, len(head.names))
            if best is None or rank > best[0]:
                best = (rank, head)
    if best is None:
        raise InputError(f"{path}: no recording: column names and two rows at least")
    return best[1]


def _position(path: Path, head: _Head, column: Column) -> int:
    if column.width > 1:
        raise InputError(
            f"{path}: column '{column.name}' cannot hold a list here; give its name room for a joint: {{}}"
        )
    count = head.names.count(column.name)
    if count > 1:
        raise InputError(f"{path}: column '{column.name}' is there {count} times")
    if count == 0:
        there = ", ".join(f"'{name[:32]}'" for name in head.names[:8]) + (", ..." if len(head.names) > 8 else "")
        raise InputError(
            f"{path}: no column '{column.name}', which this arm needs (see --map); line {head.line} has {there}"
        )
    return head.names.index(column.name)


class _Rows:
    """Cells to numbers, block by block."""

    def __init__(
        self, path: Path, picked: list[int], with_label: bool, times: int, decimal: str | None, skipped: Skipped
    ) -> None:
        self._path = path
        self._picked = picked
        self._with_label = with_label
        self._times = times
        self._decimal = decimal
        self._skipped = skipped
        self._label = "0"
        self._cells: list[list[str]] = []
        self._lines: list[int] = []

    def blocks(self, raw: IO[bytes], rows: "_csv.Reader", head: _Head) -> Iterator[FloatArray]:
        width = len(head.names)
        line = head.line
        damage = None
        try:
            for row in rows:
                line = head.line + rows.line_num
                if len(row) != width:
                    if not any(cell.strip() for cell in row):
                        continue  # an empty line
                    if len(row) < width or any(cell.strip() for cell in row[width:]):
                        raise TableDamage(f"{self._path}:{line}: {len(row)} values under {width} column names")
                self._take([row[i] for i in self._picked], line)
                if len(self._cells) == BLOCK_ROWS:
                    yield from self._block()
        except TableDamage as error:
            damage = str(error)
        except (EOFError, zlib.error, gzip.BadGzipFile, UnicodeError, csv.Error) as error:
            where = f" at byte {raw.tell()}" if isinstance(error, EOFError | zlib.error | OSError) else ""
            damage = f"{self._path}:{line + 1}: cannot be read on{where}: {' '.join(str(error).split())}"
        if self._cells:
            yield from self._block()
        if damage is not None:
            raise TableDamage(damage)

    def _take(self, cells: list[str], line: int) -> None:
        if self._with_label:
            self._label = cells[-1] = cells[-1].strip() or self._label
        readings = cells[self._times : len(cells) - self._with_label]
        if not any(readings) or not any(_is_there(cell) for cell in readings):
            self._skipped.rows += 1
            return
        if not self._lines and not self._skipped.lines and not self._skipped.units and _are_words(readings):
            self._skipped.units = True
            return
        self._cells.append(cells)
        self._lines.append(line)

    def _block(self) -> Iterator[FloatArray]:
        cells, lines = self._cells, self._lines
        self._cells, self._lines = [], []
        if self._decimal is None:
            # The first value with a mark decides: a file has one kind.
            marked = next((cell for row in cells for cell in row if "," in cell or "." in cell), None)
            self._decimal = None if marked is None else "," if _DECIMAL_COMMA.match(marked) else "."
        if self._with_label:
            for row in cells:
                row[-1] = _WORDS.get(row[-1].lower(), row[-1])
        texts = cells
        if self._decimal == ",":  # a point would separate thousands
            texts = [[cell.translate(_TO_POINT) for cell in row] for row in cells]
        try:
            block = np.array(texts, dtype=float)
        except ValueError:
            bad, column = next((i, k) for i, row in enumerate(texts) for k, x in enumerate(row) if not _is_number(x))
            if bad:
                self._skipped.lines += lines[:bad]
                yield np.array(texts[:bad], dtype=float)
            cell = cells[bad][column]
            what = f"{cell!r} is not a number" if cell.strip() else "a value is missing"
            raise TableDamage(f"{self._path}:{lines[bad]}: {what}") from None
        self._skipped.lines += lines
        yield block


def _is_there(cell: str) -> bool:
    return cell.strip().lower() not in ("", "nan", "null", "none", "na")


def _are_words(cells: list[str]) -> bool:
    """True for a line of units: letters instead of numbers."""
    return all(not _is_number(cell.replace(",", ".")) and any(x.isalpha() for x in cell) for cell in cells)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
