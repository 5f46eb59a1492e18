"""Tauperp: a collision guard for torque-sensing robot arms. The host tools; the guard itself is C, in firmware/."""

__version__ = "0.1.0"
