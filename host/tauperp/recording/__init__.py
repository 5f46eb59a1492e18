"""Recordings of a real robot: tables that are read and sent through the same firmware."""

from tauperp.recording.offsets import Offsets, find_offsets
from tauperp.recording.playback import Playback, Trip, play
from tauperp.recording.recording import Recording
from tauperp.recording.score import Score, score
from tauperp.recording.tables import read_csv, read_recording

__all__ = [
    "Offsets",
    "Playback",
    "Recording",
    "Score",
    "Trip",
    "find_offsets",
    "play",
    "read_csv",
    "read_recording",
    "score",
]
