"""The most instructions that a target may take: docs/guard.md has the same table.

For each emulated processor and build: (one cycle of seven or eight joints, from its first received to its last sent
frame, with any frames; one projection of 8 x 6 numbers with any bits).
"""

LIMITS = {
    ("m3", "float"): (330_000, 300_000),
    ("m4f", "float"): (29_000, 16_500),
    ("m7", "float"): (29_000, 16_500),
    ("r5f", "float"): (29_000, 15_500),
    ("m3", "fixed"): (105_000, 72_000),
    ("m4f", "fixed"): (105_000, 72_000),
    ("m7", "fixed"): (105_000, 72_000),
    ("r5f", "fixed"): (115_000, 78_000),
}
