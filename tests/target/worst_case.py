"""The most instructions that a target may take: docs/guard.md has the same table.

By emulated processor and build: (one cycle of seven or eight joints from the first frame in to the last frame out,
whatever comes on the wire; one projection of 8 x 6 numbers on any bits at all).
"""

LIMITS = {
    ("m3", "float"): (340_000, 340_000),
    ("m4f", "float"): (21_000, 15_000),
    ("m7", "float"): (21_000, 15_000),
    ("r5f", "float"): (19_000, 14_000),
    ("m3", "fixed"): (80_000, 70_000),
    ("m4f", "fixed"): (80_000, 70_000),
    ("m7", "fixed"): (80_000, 70_000),
    ("r5f", "fixed"): (80_000, 70_000),
}
