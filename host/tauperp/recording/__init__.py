"""Recordings of a real robot through the same firmware: what it would have found, missed and taken for a collision."""

from tauperp.recording.offsets import Offsets, find_offsets
from tauperp.recording.playback import Playback, Trip, play
from tauperp.recording.score import Score, score

__all__ = ["Offsets", "Playback", "Score", "Trip", "find_offsets", "play", "score"]
