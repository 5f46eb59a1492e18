"""The compiled C firmware in this process: its core on numpy arrays, and the whole guard in lockstep.

    core = Core("panda")                        # the mathematics, one function at a time
    core.terms(q, qd).gravity                   # (7,) Nm; (m, 7) for m instants in one call
    core.trips(q, qd, tau, "contact")           # where an index of a whole recording crosses its threshold

    guard = Guard(load_configuration("default", robot="panda").block())
    guard.receive(frame, now_us)                # can.Message in
    verdict = guard.tick(now_us)                # permission, indexes and can.Messages out

Both call the shared library that `make library` builds; nothing of the mathematics exists twice.
"""

from tauperp.firmware.core import Core, CoreTrip, Projection, Step, Terms
from tauperp.firmware.guard import DETECTION_REASONS, Guard, Reason, Start, State, Variant, Verdict, reaction_us
from tauperp.firmware.library import Library, load_library
from tauperp.firmware.schedule import Schedule

__all__ = [
    "DETECTION_REASONS",
    "Core",
    "CoreTrip",
    "Guard",
    "Library",
    "Projection",
    "Reason",
    "Schedule",
    "Start",
    "State",
    "Step",
    "Terms",
    "Variant",
    "Verdict",
    "load_library",
    "reaction_us",
]
