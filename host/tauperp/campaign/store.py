"""Results on disk: one Parquet file per shard, complete or absent, so that a campaign can resume after any
interruption.

The folder belongs to one plan; `plan.json` holds its digest. Each shard's file carries the digest, too. A file that
does not belong to the plan or cannot be read is computed again.
"""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from tauperp.campaign.plan import Plan
from tauperp.campaign.work import Shard, Thresholds
from tauperp.errors import InputError
from tauperp.files import write_atomically
from tauperp.kernel import layout
from tauperp.kernel.bench import Rows

DIGEST = b"tauperp_plan"

BY_JOINT = ("free_max", "channel_max")  # stored for the arm's joints only

PLANNED = {
    "task": "task",
    "push": "push",
    "motion": "motion",
    "planned_link": "link",
    "force_n": "force_n",
    "push_s": "push_s",
    "payload_kg": "payload_mass",
}  # column: field of layout.RUN that is stored with the result


class Store:
    """The folder of one campaign."""

    def __init__(self, folder: Path, plan: Plan, names: dict[str, list[str]]) -> None:
        self.folder = folder
        self._digest = plan.digest
        self._joints = plan.configuration.robot.n
        self._note = folder / "plan.json"
        self._content = {
            "digest": self._digest,
            "plan": plan.file.model_dump(mode="json", by_alias=True),
            "detectors": names,
        }
        if self._note.exists():
            try:
                other = json.loads(self._note.read_text())["digest"]
            except (OSError, ValueError, KeyError, TypeError):
                other = None
            if other != self._digest:
                raise InputError(f"{folder}: holds the results of another plan; name another folder with --out")

    def claim(self) -> None:
        """Write into the folder which plan it belongs to, before any result."""
        if not self._note.exists():
            write_atomically(self._note, json.dumps(self._content, indent=2) + "\n")

    def _path(self, shard: Shard) -> Path:
        return self.folder / "shards" / f"{shard.name}.parquet"

    def has(self, shard: Shard) -> bool:
        """Whether the shard exists, is complete, and belongs to this plan."""
        import pyarrow as pa
        import pyarrow.parquet as parquet

        try:
            metadata = parquet.read_metadata(self._path(shard))
        except (OSError, pa.ArrowInvalid):
            return False
        owner = (metadata.metadata or {}).get(DIGEST, b"").decode()
        return owner == self._digest and metadata.num_rows == shard.count

    def write(self, shard: Shard, runs: Rows, results: Rows) -> None:
        """Raises OSError, without leaving a partial file, if the disk does not accept it."""
        import pyarrow as pa
        import pyarrow.parquet as parquet

        columns: dict[str, Any] = {name: runs[field] for name, field in PLANNED.items()}
        for name in layout.RESULT.names or ():
            values = results[name]
            if name in BY_JOINT:
                values = values[:, :, : self._joints]
            if name != "reserved":
                columns[name] = values
        arrays = [_column(values) for values in columns.values()]
        table = pa.Table.from_arrays(arrays, names=list(columns)).replace_schema_metadata({DIGEST: self._digest})
        packed = io.BytesIO()
        parquet.write_table(table, packed, compression="zstd")
        try:
            write_atomically(self._path(shard), packed.getvalue())
        except OSError as error:  # of a write, which names no file
            raise OSError(error.errno, error.strerror, str(self._path(shard))) from error

    def read(self, shards: list[Shard]) -> Rows:
        """The rows of these shards, in their order, as a structured array."""
        import pyarrow.parquet as parquet

        parts = []
        for shard in shards:
            table = parquet.read_table(self._path(shard))
            part = np.zeros(table.num_rows, row_type(self._joints))
            for name in table.column_names:
                values = table.column(name).combine_chunks()
                while hasattr(values, "flatten") and hasattr(values.type, "value_type"):
                    values = values.flatten()
                part[name] = np.asarray(values).reshape(part[name].shape)
            parts.append(part)
        return np.concatenate(parts) if parts else np.zeros(0, row_type(self._joints))

    def thresholds(self) -> Thresholds | None:
        """Results of the free moves, if they are complete."""
        path = self.folder / "thresholds.json"
        if not path.exists():
            return None
        try:
            content = json.loads(path.read_text())
        except ValueError:
            return None
        return content["thresholds"] if content.get("digest") == self._digest else None

    def keep_thresholds(self, thresholds: Thresholds) -> None:
        content = {"digest": self._digest, "thresholds": thresholds}
        write_atomically(self.folder / "thresholds.json", json.dumps(content, indent=2) + "\n")


def row_type(joints: int) -> np.dtype[Any]:
    """A stored row: the planned run with its result."""
    fields: list[tuple[Any, ...]] = [(name, layout.RUN[field]) for name, field in PLANNED.items()]
    for name in layout.RESULT.names or ():
        kind = layout.RESULT[name]
        if name in BY_JOINT:
            kind = np.dtype(("f8", (kind.shape[0], joints)))
        if name != "reserved":
            fields.append((name, kind))
    return np.dtype(fields)


def _column(values: Any) -> Any:
    import pyarrow as pa

    flat = np.ascontiguousarray(values)
    if flat.ndim == 1:
        return pa.array(flat)
    array = pa.array(flat.reshape(-1))
    for size in reversed(flat.shape[1:]):
        array = pa.FixedSizeListArray.from_arrays(array, size)
    return array
