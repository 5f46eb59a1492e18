"""Thresholds, offsets and friction of one arm from recordings in which nobody touches it (`tauperp calibrate`)."""
