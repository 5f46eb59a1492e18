"""Recordings from tables: .csv, .csv.gz, .npz, .parquet and .mcap, by the file's suffix.

Every reader is a generator of blocks of rows. Where a file cannot be read on, it yields what it has and raises
`TableDamage`; a format whose directory is at its end (.npz, .parquet) is all or nothing when it is cut.
"""

import csv
import gzip
import io
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import IO, cast

import numpy as np

from tauperp.errors import InputError
from tauperp.replay.mapping import Column, ColumnMap, column_map
from tauperp.replay.mcap_table import mcap_blocks
from tauperp.replay.recording import FloatArray, Recording, place_of
from tauperp.replay.table_damage import TableDamage, needs_extra

MAX_ROWS = 2_000_000  # 33 minutes at 1 kHz; a recording and its playback take about 500 bytes a row
_BLOCK_ROWS = 4096
_GZIP_MAGIC = b"\x1f\x8b"

Reader = Callable[[Path, Sequence[Column], Column | None], Iterator[FloatArray]]


def read_csv(path: str | Path, joints: int) -> Recording:
    """A whole CSV file with the default columns. Raises InputError as read_recording does, and for any damage."""
    recording = read_recording(path, joints)
    if recording.damage is not None:
        raise InputError(recording.damage)
    return recording


def read_recording(path: str | Path, joints: int, map_file: str | Path | None = None) -> Recording:
    """Read a recording of an arm with so many joints, with the columns of the map or the default ones.

    A row that is no reading (not a number, not finite, back in time) ends the recording as damage does: the rows
    before it are there. Raises InputError if the file cannot be opened, lacks a column, has fewer than two good rows
    or more than MAX_ROWS, or if the map is wrong.
    """
    path = Path(path)
    columns = column_map(joints, map_file)
    suffix = "".join(path.suffixes[-2:]).lower() if path.suffix.lower() == ".gz" else path.suffix.lower()
    reader = _READERS.get(suffix)
    if reader is None:
        raise InputError(f"{path}: no recording is read from '{suffix}' (but from {' '.join(_READERS)})")
    by_line = reader is _csv_blocks
    label = columns.label
    with_label = columns.label_needed or _has_column(path, suffix, label.name)
    factors = np.array([factor for column in (*columns.readings, label) for factor in column.factors])
    blocks: list[FloatArray] = []
    rows, last, damage = 0, -np.inf, None
    try:
        for raw in reader(path, columns.readings, label if with_label else None):
            block = raw * factors[: raw.shape[1]]
            good, reason = _good_rows(block, last, columns)
            blocks.append(block[:good])
            rows += good
            if reason is not None:
                raise TableDamage(f"{place_of(path, rows, by_line)}: {reason}")
            if rows > MAX_ROWS:
                raise InputError(f"{path}: more than {MAX_ROWS} rows; cut it into shorter recordings")
            last = block[-1, 0]
    except TableDamage as error:
        damage = str(error)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    if rows < 2:
        raise InputError(damage or f"{path}: no recording: column names and two rows at least")
    values = np.concatenate(blocks)
    time_s, q, qd, tau = np.split(values[:, : 1 + 3 * joints], [1, 1 + joints, 1 + 2 * joints], axis=1)
    time_s = time_s[:, 0] - time_s[0, 0]
    if np.median(np.diff(time_s)) <= 0:
        raise InputError(f"{path}: time stands still")
    touched = values[:, -1] != 0 if with_label else None
    acceleration = values[:, 1 + 3 * joints : 4 + 3 * joints] if columns.acceleration else None
    name = path.name.removesuffix(".gz").rpartition(".")[0]
    return Recording(name, path, time_s, q, qd, tau, touched, damage, by_line, acceleration)


def _good_rows(block: FloatArray, last: float, columns: ColumnMap) -> tuple[int, str | None]:
    """How many rows of a block are readings, and what is wrong with the next one."""
    bad = ~np.isfinite(block)
    back = np.diff(block[:, 0], prepend=last) < 0
    wrong = np.flatnonzero(bad.any(axis=1) | back)
    if not wrong.size:
        return len(block), None
    row = int(wrong[0])
    if not bad[row].any():
        return row, "time goes back"
    names = [column.name for column in (*columns.readings, columns.label) for _ in column.factors]
    return row, f"{names[int(np.argmax(bad[row]))]} is not finite"


def _has_column(path: Path, suffix: str, name: str) -> bool:
    """Whether a table has a column that it need not have. False for what cannot be opened: its reader says why."""
    try:
        if suffix in (".csv", ".csv.gz"):
            with path.open("rb") as raw:
                return name in _header(csv.reader(_text(raw)))
        if suffix == ".npz":
            with np.load(path, allow_pickle=False) as arrays:
                return name in arrays
        if suffix == ".parquet":
            import pyarrow.parquet

            return name in pyarrow.parquet.read_schema(path).names
    except (ImportError, OSError, EOFError, ValueError, zlib.error, csv.Error, zipfile.BadZipFile):
        return False
    return False


# --- .csv ---------------------------------------------------------------------------------------------------------


def _text(raw: IO[bytes]) -> io.TextIOWrapper:
    packed = raw.read(2) == _GZIP_MAGIC
    raw.seek(0)
    stream = gzip.GzipFile(fileobj=raw) if packed else raw
    return io.TextIOWrapper(cast(IO[bytes], stream), encoding="utf-8-sig", newline="")


def _header(lines: Iterator[list[str]]) -> list[str]:
    return [name.strip() for name in next(lines, [])]


def _csv_blocks(path: Path, columns: Sequence[Column], label: Column | None) -> Iterator[FloatArray]:
    wanted = [*columns, label] if label else list(columns)
    rows: list[list[str]] = []
    done = 0
    with path.open("rb") as raw:
        lines = csv.reader(_text(raw))
        header: list[str] | None = None
        try:
            header = _header(lines)
            if header == []:
                raise InputError(f"{path}: no recording: column names and two rows at least")
            picked = [_position(path, header, column) for column in wanted]
            for row in lines:
                if len(row) != len(header):
                    raise TableDamage(
                        f"{place_of(path, done + len(rows), True)}: {len(row)} values under {len(header)} column names"
                    )
                rows.append([row[i] for i in picked])
                if len(rows) == _BLOCK_ROWS:
                    block, rows = rows, []
                    yield from _numbers(path, block, done)
                    done += len(block)
            damage = None
        except TableDamage as error:
            damage = str(error)
        except (EOFError, zlib.error, gzip.BadGzipFile, UnicodeDecodeError, csv.Error) as error:
            if header is None:
                raise InputError(f"{path}: not a CSV file, plain or gzipped") from error
            place = place_of(path, done + len(rows), True)
            where = f" at byte {raw.tell()}" if isinstance(error, EOFError | zlib.error | OSError) else ""
            damage = f"{place}: cannot be read on{where}: {' '.join(str(error).split())}"
    if rows:
        yield from _numbers(path, rows, done)
    if damage is not None:
        raise TableDamage(damage)


def _position(path: Path, header: list[str], column: Column) -> int:
    if column.width > 1:
        raise InputError(
            f"{path}: column '{column.name}' cannot hold a list here; give its name room for a joint: {{}}"
        )
    if header.count(column.name) > 1:
        raise InputError(f"{path}: column '{column.name}' is there {header.count(column.name)} times")
    try:
        return header.index(column.name)
    except ValueError:
        raise InputError(f"{path}: no column '{column.name}', which this arm needs (see --map)") from None


def _numbers(path: Path, rows: list[list[str]], before: int) -> Iterator[FloatArray]:
    try:
        yield np.array(rows, dtype=float)
    except ValueError:
        row, cell = next((row, cell) for row, cells in enumerate(rows) for cell in cells if not _is_number(cell))
        if row:
            yield np.array(rows[:row], dtype=float)
        what = f"{cell!r} is not a number" if cell.strip() else "a value is missing"
        raise TableDamage(f"{place_of(path, before + row, True)}: {what}") from None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


# --- .npz and .parquet --------------------------------------------------------------------------------------------


def _npz_blocks(path: Path, columns: Sequence[Column], label: Column | None) -> Iterator[FloatArray]:
    wanted = [*columns, label] if label else list(columns)
    try:
        with np.load(path, allow_pickle=False) as arrays:
            parts = []
            for column in wanted:
                if column.name not in arrays:
                    raise InputError(f"{path}: no array '{column.name}', which this arm needs (see --map)")
                parts.append(_flat(path, column, np.asarray(arrays[column.name])))
    except (zipfile.BadZipFile, ValueError, EOFError, zlib.error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not an .npz file of numbers, or cut: {' '.join(str(error).split())}") from error
    for one, other in pairwise(zip(parts, wanted, strict=True)):
        if len(one[0]) != len(other[0]):
            lengths = f"{len(one[0])} rows in '{one[1].name}', {len(other[0])} in '{other[1].name}'"
            raise InputError(f"{path}: {lengths}")
    for begin in range(0, len(parts[0]), _BLOCK_ROWS):
        yield np.concatenate([part[begin : begin + _BLOCK_ROWS] for part in parts], axis=1).astype(float)


def _flat(path: Path, column: Column, values: np.ndarray) -> np.ndarray:
    """(m, width) of numbers."""
    shape = (len(values) if values.ndim else 0, column.width)
    fits = values.ndim == 2 and values.shape[1] == column.width if column.width > 1 else values.ndim == 1
    if not fits or not (np.issubdtype(values.dtype, np.number) or values.dtype == bool):
        of = f" of {column.width} values" if column.width > 1 else ""
        raise InputError(f"{path}: '{column.name}' holds no column of numbers{of}, but {values.dtype} {values.shape}")
    return values.reshape(shape)


def _parquet_blocks(path: Path, columns: Sequence[Column], label: Column | None) -> Iterator[FloatArray]:
    wanted = [*columns, label] if label else list(columns)
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise needs_extra(path, "pyarrow") from error
    try:
        file = pyarrow.parquet.ParquetFile(path)
    except pyarrow.ArrowException as error:
        raise InputError(f"{path}: not a .parquet file, or cut: {' '.join(str(error).split())}") from error
    rows = 0
    with file:
        for column in wanted:
            if column.name not in file.schema_arrow.names:
                raise InputError(f"{path}: no column '{column.name}', which this arm needs (see --map)")
        try:
            for batch in file.iter_batches(_BLOCK_ROWS, columns=[column.name for column in wanted]):
                parts = []
                for column in wanted:
                    values = batch.column(column.name)
                    if column.width > 1:
                        values = np.array(values.to_pylist(), dtype=float)
                    else:
                        values = values.to_numpy(zero_copy_only=False)
                    parts.append(_flat(path, column, values))
                yield np.concatenate(parts, axis=1).astype(float)
                rows += len(batch)
        except (pyarrow.ArrowException, OSError, TypeError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            what = " ".join(str(error).split())
            raise TableDamage(f"{place_of(path, rows, False)}: cannot be read on: {what}") from error


_READERS: dict[str, Reader] = {
    ".csv": _csv_blocks,
    ".csv.gz": _csv_blocks,
    ".npz": _npz_blocks,
    ".parquet": _parquet_blocks,
    ".mcap": mcap_blocks,
}
