"""Recordings of a real robot through the same firmware: what it would have found, missed and taken for a collision."""

from tauperp.replay.playback import Playback, Trip, play
from tauperp.replay.recording import Recording, read_csv
from tauperp.replay.score import Score, score

__all__ = ["Playback", "Recording", "Score", "Trip", "play", "read_csv", "score"]
