"""Recordings of a real robot through the same firmware: what it would have found, missed and taken for a collision."""

from tauperp.replay.playback import Playback, Trip, play
from tauperp.replay.recording import Recording
from tauperp.replay.score import Score, score
from tauperp.replay.tables import read_csv, read_recording

__all__ = ["Playback", "Recording", "Score", "Trip", "play", "read_csv", "read_recording", "score"]
