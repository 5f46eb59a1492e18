"""Bus logs through the same firmware, bit for bit; and the readers of tables, which `tauperp.recording` scores."""

from tauperp.replay.recording import Recording
from tauperp.replay.tables import read_csv, read_recording

__all__ = ["Recording", "read_csv", "read_recording"]
