"""Tauperp: a collision guard for torque-sensing robot arms. The host tools; the guard itself is C, in firmware/."""

import importlib.metadata

__version__ = importlib.metadata.version("tauperp")  # its one place is firmware/guard/version.h
