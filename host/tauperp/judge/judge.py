"""The result of a run, in numbers and in words: collisions, faults, stops, peaks, the permission, and a verdict.

A collision is *in progress* from the first touch until 5 / K after the last one, where K is the observer's gain. By
then the observer's memory of it has decayed below 1 %. A stop for a collision at any other time is a false stop.

The *free peaks* are the largest r and index while motion is permitted, no collision is in progress, and no sensor fault
of the scenario acts or has acted within 5 / K. The tick that ends a permission counts, so a false stop is included.
Grasping, releasing, retreating and returning are included, too.

Only an event on a moving, permitted robot was tested. A strike on a stopped arm, or a fault that nothing could detect,
is *not tested*: neither passed nor missed. The verdict is `failed` for a false stop, a missed collision or an
incomplete run; else `incomplete` if something was not tested; else `passed`.
"""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauperp.config import TASKS
from tauperp.firmware import Guard, Reason
from tauperp.provenance import provenance, provenance_of_bus
from tauperp.run.scenario import Scenario
from tauperp.run.telling import Telling
from tauperp.run.trace import Contact, Stop, Trace
from tauperp.sim.sensors import SensorFault
from tauperp.words import spoken

SETTLE_GAINS = 5.0  # times 1 / K
FAULT_AFTERMATH_S = 1.0  # s; a stop this long after wrong or missing frames still counts as caused by them
DETECTIONS = (
    Reason.COLLISION,
    Reason.EXPLAINED_FORCE,
    Reason.EXPLAINED_MOMENT,
    Reason.RESIDUAL_LIMIT,
    Reason.SUDDEN,
    Reason.INPUT_RANGE,
)
SILENCE = "SILENCE"  # reason of a stop without any StopCommand
DETECTED, MISSED, NOT_TESTED = "detected", "missed", "not tested"


def judge(scenario: Scenario, trace: Trace, guard: Guard | Telling) -> dict[str, Any]:
    """The run's numbers, verdict included, with everything that they depend on by its hash. Times s, Nm, N."""
    return _Judge(scenario, trace, guard).report()


class _Judge:
    def __init__(self, scenario: Scenario, trace: Trace, guard: Guard | Telling) -> None:
        self._scenario, self._trace, self._guard = scenario, trace, guard
        self._settle_s = SETTLE_GAINS / scenario.configuration.settings.observer.gain_per_s
        self._quiet = trace.quiet(self._settle_s, scenario.faults)

    def report(self) -> dict[str, Any]:
        scenario, trace, configuration = self._scenario, self._trace, self._scenario.configuration
        collisions = [self._collision(contact) for contact in trace.contacts]
        faults = [self._fault(fault) for fault in scenario.faults]
        stops = [self._stop(stop) for stop in trace.stops]
        thresholds = [configuration.threshold_nm(name) for name in TASKS if TASKS[name] in trace.task]
        why = [*self._failures(collisions, stops), *self._untested(collisions, faults)]
        failed = any(self._failures(collisions, stops))
        return {
            "scenario": Path(scenario.source).name,
            "verdict": "failed" if failed else "incomplete" if why else "passed",
            "passed": not why,
            "why": why,
            "finished": trace.finished,
            "ended": trace.ended,
            "false_stops": sum(stop["cause"] == "none" for stop in stops),
            "collisions": collisions,
            "faults": faults,
            "peak_index_free_nm": self._peak(trace.index_nm),
            "peak_residual_free_nm": self._peak(trace.residual_nm),
            "peak_index_free_by_joint_nm": self._peaks(trace.index_nm),
            "peak_residual_free_by_joint_nm": self._peaks(trace.residual_nm),
            "threshold_nm": _one_or_many(np.unique(np.concatenate(thresholds))),
            "residual_alone": self._residual_alone(),
            "phases": [self._phase(number) for number in range(len(scenario.phases))],
            "permission": [{"from_s": begin, "until_s": end} for begin, end in permitted_spans(trace)],
            "stops": stops,
            "settle_s": self._settle_s,
            "cycles": len(trace.time_s),
            "robot": scenario.robot.name,
            "assumed": list(scenario.notes),
            "rate_hz": configuration.settings.wire.rate_hz,
            "format": configuration.settings.wire.format,
            "seed": scenario.seed,
            "guard": self._whose(),
            "guard_counters": self._guard.counters,
            "hashes": provenance(self._guard.library, configuration)
            if isinstance(self._guard, Guard)
            else provenance_of_bus(self._guard.identity, configuration),
        }

    def _failures(self, collisions: list[dict[str, Any]], stops: list[dict[str, Any]]) -> Iterator[str]:
        for one in collisions:
            if one["verdict"] == MISSED:
                yield f"the {one['part']} on link {one['link']} at {one['contact_s']:.3f} s was missed"
        for stop in stops:
            if stop["cause"] == "none":
                yield f"false stop at {stop['time_s']:.3f} s: {_reason_of(stop)}"
        if self._trace.ended is not None:
            yield f"ended at {self._trace.ended}"
        elif not self._trace.finished:
            yield f"the time limit of {self._scenario.time_limit_s:g} s came before the end{self._since()}"

    @staticmethod
    def _untested(collisions: list[dict[str, Any]], faults: list[dict[str, Any]]) -> Iterator[str]:
        for one in collisions:
            if one["verdict"] == NOT_TESTED:
                yield f"the {one['part']} on link {one['link']} was not tested: {one['why']}"
        for one in faults:
            if one["verdict"] == NOT_TESTED:
                yield f"the fault '{one['kind']}' of joint {one['joint']} was not tested: {one['why']}"

    def _since(self) -> str:
        """What an incomplete run was waiting for."""
        trace = self._trace
        if trace.permitted[-1]:
            return ""
        if not trace.permitted.any():
            return ": there never was a permission"
        stop = trace.stops[-1]
        reason = _reason_of({"reason": _name(stop.reason), "joint": stop.joint})
        return f": no permission since {stop.time_s:.3f} s ({reason})"

    def _peak(self, values: NDArray[np.float64]) -> float:
        return round(float(np.abs(values[self._quiet]).max(initial=0.0)), 4)

    def _peaks(self, values: NDArray[np.float64]) -> list[float]:
        masked = np.where(self._quiet, np.abs(values), 0.0)
        return [round(float(value), 4) for value in masked.max(axis=0, initial=0.0)]

    def _collision(self, contact: Contact) -> dict[str, Any]:
        """One strike. Detected: motion was stopped while it was in progress, by the index (reason COLLISION) or because
        the blow drove a sensor out of its range (INPUT_RANGE)."""
        trace, record = self._trace, contact.record
        begin, end = record.contact_s, record.release_s
        row: dict[str, Any] = {
            "link": contact.strike.link,
            "part": contact.strike.part,
            "contact_s": None,
            "stop_s": None,
            "latency_ms": None,
            "detected": False,
            "verdict": NOT_TESTED,
            "why": None,
            "peak_force_n": 0.0,
        }
        if begin is None or end is None:
            row["why"] = "the run ended before it" if record.sent_s is None else "the hand met nothing"
            if record.withdrawn_s is not None:
                row["why"] = "the arm had stopped before the hand was there"
            return row
        stop = next(
            (one for one in trace.stops if one.reason in DETECTIONS and begin <= one.time_s <= end + self._settle_s),
            None,
        )
        row |= {
            "link": record.link,
            "contact_s": round(begin, 6),
            "peak_force_n": round(record.peak_force_n, 2),
            "joint": None,
            "reason": None,
            "standstill_s": None,
        }
        if stop is not None:
            standstill = stop.standstill_s
            row |= {
                "stop_s": round(stop.time_s, 6),
                "latency_ms": round((stop.time_s - begin) * 1000, 3),
                "detected": True,
                "verdict": DETECTED,
                "joint": stop.joint,
                "reason": Reason(stop.reason).name,
                "standstill_s": None if standstill is None else round(standstill, 6),
            }
        elif not self._permitted_at(begin):
            row["why"] = "the arm was stopped already when the hand touched it"
        else:
            row["verdict"] = MISSED
        return row

    def _fault(self, fault: SensorFault) -> dict[str, Any]:
        """One sensor fault: its effect on the permission."""
        trace = self._trace
        rows = (trace.time_s >= fault.start_s) & (trace.time_s <= fault.end_s)
        stop = next((one for one in trace.stops if _is_doing(one, fault, self._settle_s)), None)
        row: dict[str, Any] = {
            "joint": fault.joint,
            "kind": fault.kind,
            "start_s": fault.start_s,
            "end_s": None if fault.end_s >= trace.time_s[-1] else fault.end_s,
            "verdict": "no stop",
            "why": None,
            "stop_s": None,
            "latency_ms": None,
            "reason": None,
        }
        if not rows.any():
            row |= {"verdict": NOT_TESTED, "why": "the run ended before it"}
        elif not trace.permitted[rows].any() and not self._permitted_before(fault.start_s):
            began = trace.permitted[trace.time_s < fault.start_s].any()
            why = "the arm was stopped already" if began else "it began before the first permission"
            row |= {"verdict": NOT_TESTED, "why": f"{why}, and stayed so"}
        elif stop is not None:
            row |= {
                "verdict": "stopped",
                "stop_s": round(stop.time_s, 6),
                "latency_ms": round((stop.time_s - fault.start_s) * 1000, 3),
                "reason": _name(stop.reason),
            }
        return row

    def _stop(self, stop: Stop) -> dict[str, Any]:
        """One loss of permission and what caused it: a collision, a sensor fault of the scenario, a guard that was
        given up (the last stop then, told by the run's end), or none (false); and when the permission came back."""
        trace = self._trace
        cause = "guard" if trace.ended is not None and stop is trace.stops[-1] and stop.reason == 0 else "none"
        for fault in self._scenario.faults:
            if _is_doing(stop, fault, self._settle_s):
                cause = "fault"
        for contact in trace.contacts:
            begin, end = contact.record.contact_s, contact.record.release_s
            if begin is not None and end is not None and begin <= stop.time_s <= end + self._settle_s:
                cause = "collision"
        again = np.flatnonzero(trace.permitted & (trace.time_s > stop.time_s))
        return {
            "time_s": round(stop.time_s, 6),
            "reason": _name(stop.reason),
            "joint": stop.joint,
            "cause": cause,
            "trip": stop.trip_number,
            "permitted_again_s": round(float(trace.time_s[again[0]]), 6) if len(again) else None,
        }

    def _permitted_at(self, time_s: float) -> bool:
        """Whether it was in the cycle that contains this time."""
        trace = self._trace
        row = int(np.searchsorted(trace.time_s, time_s, side="right")) - 1
        return bool(trace.permitted[max(row, 0)])

    def _permitted_before(self, time_s: float) -> bool:
        """Whether it was in the last cycle that started before this time."""
        row = int(np.searchsorted(self._trace.time_s, time_s, side="left")) - 1
        return row >= 0 and bool(self._trace.permitted[row])

    def _residual_alone(self) -> dict[str, Any]:
        """How the same threshold on r instead of the index would have acted while no collision was in progress."""
        trace, quiet = self._trace, self._quiet
        above = np.any(quiet & (np.abs(trace.residual_nm) > trace.threshold_nm), axis=1)
        starts = np.flatnonzero(above & ~np.concatenate([[False], above[:-1]]))
        return {
            "false_stops": len(starts),
            "first_s": round(float(trace.time_s[starts[0]]), 6) if len(starts) else None,
            "share_of_free_time": round(float(above.sum() / max(1, quiet.any(axis=1).sum())), 4),
        }

    def _phase(self, number: int) -> dict[str, Any]:
        phase, trace = self._scenario.phases[number], self._trace
        rows = trace.phase == number
        quiet = self._quiet & rows[:, None]
        speed = trace.tip_speed_m_s[rows & ~trace.under_way(self._settle_s)]
        names = {wire: name for name, wire in TASKS.items()}
        return {
            "name": phase.name,
            "task": names[phase.task],
            "payload_kg": 0.0 if phase.payload is None else round(phase.payload.mass_kg, 4),
            "peak_index_free_nm": round(float(np.abs(trace.index_nm[quiet]).max(initial=0.0)), 4),
            "peak_residual_free_nm": round(float(np.abs(trace.residual_nm[quiet]).max(initial=0.0)), 4),
            "peak_tip_speed_m_s": round(float(speed.max(initial=0.0)), 4),
        }

    def _whose(self) -> dict[str, Any]:
        """The guard of this process; or an external one as it reports itself, with its deviations."""
        if isinstance(self._guard, Guard):
            return {"whose": "library"}
        identity = self._guard.identity
        return {
            "whose": "bus",
            **dataclasses.asdict(identity),
            "differences": identity.differences(self._scenario.configuration),
        }


def _is_doing(stop: Stop, fault: SensorFault, settle_s: float) -> bool:
    """Whether a fault may have caused a stop.

    The guard never treats a wrong or missing frame as a collision, and its error rate may remember the sender for a
    while. The effect of a wrong torque on the index ends when the observer has settled.
    """
    of_torque = fault.kind in ("offset", "gain", "stuck")
    until_s = fault.end_s + (settle_s if of_torque else FAULT_AFTERMATH_S)
    return fault.start_s <= stop.time_s <= until_s and (of_torque or stop.reason not in DETECTIONS)


def permitted_spans(trace: Trace) -> list[tuple[float, float | None]]:
    """Times at which permission was given and ended, s; None if it lasted to the end."""
    edges = np.diff(trace.permitted.astype(int), prepend=0)
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    times = [round(float(value), 6) for value in trace.time_s]
    return [(times[begin], times[ends[at]] if at < len(ends) else None) for at, begin in enumerate(begins)]


def _name(reason: int) -> str:
    return SILENCE if reason == 0 else Reason(reason).name


def _reason_of(stop: dict[str, Any]) -> str:
    reason = spoken(stop["reason"])
    return f"{reason}, joint {stop['joint']}" if stop["joint"] else reason


def _one_or_many(values: NDArray[np.float64]) -> float | list[float]:
    return round(float(values[0]), 4) if len(values) == 1 else [round(float(value), 4) for value in values]
