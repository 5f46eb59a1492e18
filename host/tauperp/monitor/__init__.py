"""The live view of a bus with a guard. It only listens: nothing in this package can send.

    frames -> Monitor (model) -> Snapshot -> compose (screen) or report (JSON)

A Monitor keeps what it received. A Snapshot is its state at one instant as plain values. The rest only displays
Snapshots.
"""

from tauperp.monitor.model import Monitor
from tauperp.monitor.screen import compose
from tauperp.monitor.snapshot import Snapshot, report

__all__ = ["Monitor", "Snapshot", "compose", "report"]
