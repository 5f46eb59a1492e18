"""Biomechanical limits of force for regions of the human body.

Quasi-static limits of ISO/TS 15066:2016, table A.2, adopted by ISO 10218-2:2025. A transient contact (the body part can
recoil) may have twice the force. Newton. Only regions that an arm meets at work.
"""

from typing import NamedTuple

SOURCE = "ISO/TS 15066:2016, table A.2, and ISO 10218-2:2025; transient contact: twice the quasi-static limit"
TRANSIENT = 2.0


class Region(NamedTuple):
    """A region of the body and its quasi-static limit, N."""

    name: str
    limit_n: float


REGIONS = (
    Region("abdomen", 110.0),
    Region("chest", 140.0),
    Region("hand", 140.0),
    Region("upper arm", 150.0),
    Region("forearm", 160.0),
    Region("pelvis", 180.0),
    Region("back", 210.0),
)
