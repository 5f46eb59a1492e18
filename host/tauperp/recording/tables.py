"""Recordings from tables: .csv, .csv.gz, .npz, .parquet and .mcap, by the file's suffix.

Every reader is a generator of blocks of rows. Where a file cannot be read, it yields the rows so far and raises
`TableDamage`. Formats with a directory at the end (.npz, .parquet) give all rows or none.
"""

import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from tauperp.errors import InputError
from tauperp.recording.csv_table import BLOCK_ROWS, Skipped, csv_blocks, has_column
from tauperp.recording.mapping import Column, ColumnMap, column_map
from tauperp.recording.mcap_table import mcap_blocks
from tauperp.recording.recording import FloatArray, IntArray, Recording, place_of
from tauperp.recording.stamps import fitted_time, wrapped
from tauperp.recording.table_damage import TableDamage, needs_extra

MAX_ROWS = 2_000_000  # 33 minutes at 1 kHz; a recording and its playback take about 500 bytes a row

Reader = Callable[[Path, ColumnMap, Column | None, Skipped], Iterator[FloatArray]]


def read_csv(path: str | Path, joints: int) -> Recording:
    """A whole CSV file with the default columns. Raises InputError as read_recording does, and for any damage."""
    recording = read_recording(path, joints)
    if recording.damage is not None:
        raise InputError(recording.damage)
    return recording


def read_recording(
    path: str | Path, joints: int, map_file: str | Path | None = None, *, names: Sequence[str] = ()
) -> Recording:
    """Read a recording of an arm with `joints` joints, with the columns of the map or the default ones.

    names: of the joints, to select values by name where a message has names. A row without a valid reading (not a
    number, not finite, back in time) ends the recording like damage: the rows before it are kept. Rows without any
    reading and repeated time stamps are left out and reported in `notes`. Raises InputError if the file cannot be
    opened, lacks a column, has fewer than two good rows or more than MAX_ROWS, or if the map is wrong.
    """
    path = Path(path)
    columns = column_map(joints, map_file, names)
    suffix = "".join(path.suffixes[-2:]).lower() if path.suffix.lower() == ".gz" else path.suffix.lower()
    reader = _READERS.get(suffix)
    if reader is None:
        raise InputError(f"{path}: no recording is read from '{suffix}' (but from {' '.join(_READERS)})")
    label = columns.label if columns.label_needed or _has_column(path, suffix, columns) else None
    skipped = Skipped()
    rows = _Rows(path, columns, label is not None, reader is csv_blocks)
    damage = None
    try:
        for raw in reader(path, columns, label, skipped):
            rows.take(raw, skipped)
    except TableDamage as error:
        damage = str(error)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from error
    if rows.count < 2:
        raise InputError(damage or f"{path}: no recording: column names and two rows at least")
    values, where = np.concatenate(rows.blocks), np.concatenate(rows.where)
    kept, notes = fitted_time(path, values, columns)
    values, where = values[kept], where[kept]
    time_s, q, qd, tau = np.split(values[:, : 1 + 3 * joints], [1, 1 + joints, 1 + 2 * joints], axis=1)
    q, turned = wrapped(path, q, columns)
    return Recording(
        name=path.name.removesuffix(".gz").rpartition(".")[0],
        path=path,
        time_s=time_s[:, 0] - time_s[0, 0],
        q=q,
        qd=qd,
        tau=tau,
        touched=values[:, -1] != 0 if label else None,
        damage=damage,
        line_by_line=reader is csv_blocks,
        acceleration=values[:, 1 + 3 * joints : 4 + 3 * joints] if columns.acceleration else None,
        where=where,
        notes=(*_notes(skipped), *notes, *turned),
        time_column=columns.time[0].name,
    )


def _notes(skipped: Skipped) -> list[str]:
    notes = [f"{skipped.rows} rows without any reading are omitted"] if skipped.rows else []
    return notes + (["the line of units is omitted"] if skipped.units else [])


class _Rows:
    """The rows of a file in s, rad, rad/s and Nm, up to the first invalid row."""

    def __init__(self, path: Path, columns: ColumnMap, with_label: bool, by_line: bool) -> None:
        self.blocks: list[FloatArray] = []
        self.where: list[IntArray] = []
        self.count = 0
        self._path = path
        self._columns = columns
        self._by_line = by_line
        used = (*columns.readings, columns.label) if with_label else columns.readings
        self._factors = np.array([factor for column in used for factor in column.factors])
        self._names = [column.name for column in used for _ in column.factors]
        self._begin: FloatArray | None = None  # of the time columns: seconds since 1970 leave no room for microseconds
        self._last_s = -np.inf
        self._read = 0

    def take(self, raw: FloatArray, skipped: Skipped) -> None:
        """One more block. Raises TableDamage, with the place, at the first invalid row."""
        times = len(self._columns.time)
        if self._by_line:
            where = np.array(skipped.lines[self._read : self._read + len(raw)])
        else:
            where = np.arange(self._read + 1, self._read + 1 + len(raw))
        self._read += len(raw)
        there = ~np.isnan(raw[:, times : self._width]).all(axis=1)
        skipped.rows += int(np.count_nonzero(~there))
        raw, where = raw[there], where[there]
        if not len(raw):
            return
        if self._begin is None:
            self._begin = np.where(np.isfinite(raw[0, :times]), raw[0, :times], 0.0)
        block = (raw - np.concatenate([self._begin, np.zeros(raw.shape[1] - times)])) * self._factors
        bad = ~np.isfinite(block)
        stamp = block[:, :times].sum(axis=1)
        wrong = np.flatnonzero(bad.any(axis=1) | (np.diff(stamp, prepend=self._last_s) < 0))
        good = int(wrong[0]) if wrong.size else len(block)
        self.blocks.append(np.column_stack([stamp, block[:, times:]])[:good])
        self.where.append(where[:good])
        self.count += good
        if self.count > MAX_ROWS:
            raise InputError(f"{self._path}: more than {MAX_ROWS} rows; cut it into shorter recordings")
        if wrong.size:
            what = f"{self._names[int(np.argmax(bad[good]))]} is not finite" if bad[good].any() else self._back()
            raise TableDamage(f"{place_of(self._path, int(where[good]), self._by_line)}: {what}")
        self._last_s = float(stamp[-1])

    @property
    def _width(self) -> int:
        """Values of a row without the label."""
        return sum(column.width for column in self._columns.readings)

    def _back(self) -> str:
        stamp = self._columns.time
        if len(stamp) == 1 and stamp[0].factors[0] < 1.0:
            return "time goes back (seconds in another column? columns = [SECONDS, NANOSECONDS] under [time] of a map)"
        return "time goes back"


def _has_column(path: Path, suffix: str, columns: ColumnMap) -> bool:
    """Whether a table has the optional label. False for a file that cannot be opened: its reader reports why."""
    name = columns.label.name
    try:
        if suffix in (".csv", ".csv.gz"):
            return has_column(path, columns, name)
        if suffix == ".npz":
            with np.load(path, allow_pickle=False) as arrays:
                return name in arrays
        if suffix == ".parquet":
            import pyarrow.parquet

            return name in pyarrow.parquet.read_schema(path).names
    except (ImportError, OSError, EOFError, ValueError, zlib.error, zipfile.BadZipFile):
        return False
    return False


# --- .npz and .parquet --------------------------------------------------------------------------------------------


def _npz_blocks(path: Path, columns: ColumnMap, label: Column | None, skipped: Skipped) -> Iterator[FloatArray]:
    wanted = [*columns.readings, label] if label else list(columns.readings)
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
    for begin in range(0, len(parts[0]), BLOCK_ROWS):
        yield np.concatenate([part[begin : begin + BLOCK_ROWS] for part in parts], axis=1).astype(float)


def _flat(path: Path, column: Column, values: np.ndarray) -> np.ndarray:
    """(m, width) of numbers."""
    shape = (len(values) if values.ndim else 0, column.width)
    fits = values.ndim == 2 and values.shape[1] == column.width if column.width > 1 else values.ndim == 1
    if not fits or not (np.issubdtype(values.dtype, np.number) or values.dtype == bool):
        of = f" of {column.width} values" if column.width > 1 else ""
        raise InputError(f"{path}: '{column.name}' holds no column of numbers{of}, but {values.dtype} {values.shape}")
    return values.reshape(shape)


def _parquet_blocks(path: Path, columns: ColumnMap, label: Column | None, skipped: Skipped) -> Iterator[FloatArray]:
    wanted = [*columns.readings, label] if label else list(columns.readings)
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
            for batch in file.iter_batches(BLOCK_ROWS, columns=[column.name for column in wanted]):
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
            raise TableDamage(f"{place_of(path, rows + 1, False)}: cannot be read on: {what}") from error


_READERS: dict[str, Reader] = {
    ".csv": csv_blocks,
    ".csv.gz": csv_blocks,
    ".npz": _npz_blocks,
    ".parquet": _parquet_blocks,
    ".mcap": mcap_blocks,
}
