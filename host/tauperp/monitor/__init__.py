"""The live view of a bus with a guard on it. It only listens: nothing in this package has a way to send.

    frames -> Monitor (model) -> Snapshot -> compose (screen) or report (JSON)

A Monitor keeps what was heard, a Snapshot is all of it at one instant as plain values, and the rest only draws those.
"""

from tauperp.monitor.model import Monitor
from tauperp.monitor.screen import compose
from tauperp.monitor.snapshot import Snapshot, report

__all__ = ["Monitor", "Snapshot", "compose", "report"]
