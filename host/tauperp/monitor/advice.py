"""Advice while the robot may not move: the required reset, why the last reset was refused, and which
conditions are not met yet.
"""

from tauperp.monitor.snapshot import Snapshot, spoken

NEAR = 1.0  # share of its threshold; an index above it prevents a reset
SILENT_SHARE = 0.5  # share of the expected frames; below it frames are missing, not only slow
RESET_SHOWN_S = 5.0  # s; an older reset is no longer the last attempt
WANTED = ("AwaitingReset", "Restarted")


def advice(snapshot: Snapshot) -> str:
    """One line while motion is not permitted and the guard answers; else empty."""
    if snapshot.verdict is None or not snapshot.heard or snapshot.permitted:
        return ""
    verdict, state = snapshot.verdict.value, snapshot.live("State")
    if state == "Fault":
        return "next: remove the cause and restart the guard; no reset ends a fault"
    troubles = _troubles(snapshot)
    if verdict.trip_number == 0 and verdict.reason not in WANTED:
        return f"next: {troubles}" if troubles else "next: wait until the guard requests a reset"
    wanted = f"next: GuardReset of trip {verdict.trip_number}, Request from 0 to 1"
    if troubles:
        wanted = f"next: {troubles}; then GuardReset of trip {verdict.trip_number}"
    refused = _refused(snapshot)
    return f"{wanted} ({refused})" if refused else wanted


def _troubles(snapshot: Snapshot) -> str:
    """What is missing or too large at present."""
    silent = [one for one in snapshot.traffic if one.missing and one.rate_hz < SILENT_SHARE * (one.expected_hz or 0.0)]
    if snapshot.live("Variant") == "Lockstep":  # a simulation may be slower than real time
        silent = [one for one in silent if one.rate_hz == 0.0]
    missing = [f"joint {one.joint}" if one.joint else one.name for one in silent]
    missing = [name for name in missing if name not in ("StopCommand", "GuardStatus", "GuardIndex")]
    above = [
        f"joint {joint}"
        for joint, reading in snapshot.joints.items()
        if reading.live and abs(reading.value.index_nm) >= NEAR * reading.value.threshold_nm > 0
    ]
    said = []
    if missing:
        said.append(f"frames of {_few(missing)} are missing")
    if above:
        said.append(f"index of {_few(above)} is above its threshold")
    return ", ".join(said)


def _few(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{names[0]} and {len(names) - 1} more"


def _refused(snapshot: Snapshot) -> str:
    """Why the last reset had no effect."""
    verdict, reset = snapshot.verdict, snapshot.reset
    if verdict is None or reset is None or reset.age_s > RESET_SHOWN_S or not reset.value.request:
        return ""
    if reset.value.trip_number != verdict.value.trip_number:
        return f"the last reset named trip {reset.value.trip_number}"
    if _troubles(snapshot):
        return "the last reset came too early"
    return "the last reset came before everything was good for long enough"


def singular(snapshot: Snapshot) -> str:
    """Meaning of a smallest singular value of zero; empty for any other."""
    if snapshot.live("SmallestSingular") != 0.0:
        return ""
    task = snapshot.live("Task")
    if isinstance(task, str) and spoken(task) == "none":
        return "0: this task explains nothing"
    return "0: no basis, or a direction of it is lost"
