"""Judging a run: collisions, faults, stops, peaks, the permission, and a verdict.

A collision is *in progress* from the first touch until 5 / K after the last one, where K is the observer's gain. By
then the observer's memory of it has decayed below 1 %. A stop for a collision at any other time is a false stop.

The *free peaks* are the largest r and index while motion is permitted, no collision is in progress, and no sensor fault
of the scenario acts or has acted within 5 / K. The tick that ends a permission counts, so a false stop is included.
Grasping, releasing, retreating and returning are included, too.

Only an event on a moving, permitted robot was tested. A strike on a stopped arm, or a fault that nothing could detect,
is *not tested*: neither passed nor missed. The verdict is `failed` for a false stop, a missed collision or an
incomplete run; else `incomplete` if something was not tested; else `passed`.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tauperp.config import TASKS
from tauperp.firmware import DETECTION_REASONS, Guard, Reason
from tauperp.judge.result import (
    NOT_TESTED,
    Cause,
    Collision,
    FaultEffect,
    Installation,
    Judgement,
    Loss,
    Peaks,
    PhaseResult,
    ResidualAlone,
    reason_name,
)
from tauperp.provenance import provenance, provenance_of_bus
from tauperp.run.scenario import Scenario
from tauperp.run.telling import Telling
from tauperp.run.trace import Contact, Stop, Trace
from tauperp.sim.sensors import SensorFault
from tauperp.words import spoken

TIME_DIGITS, TORQUE_DIGITS, FORCE_DIGITS = 6, 4, 2  # of results
SETTLE_GAINS = 5.0  # times 1 / K
FAULT_AFTERMATH_S = 1.0  # s; a stop this long after wrong or missing frames still counts as caused by them
# Reasons with which a collision can stop the robot: a hard one can carry a reading out of its range.
DETECTIONS = (*DETECTION_REASONS, Reason.INPUT_RANGE)


def judge(scenario: Scenario, trace: Trace, guard: Guard | Telling) -> Judgement:
    """The run's numbers, verdict included, with everything that they depend on by its hash."""
    return _Judge(scenario, trace, guard).judgement()


class _Judge:
    def __init__(self, scenario: Scenario, trace: Trace, guard: Guard | Telling) -> None:
        self._scenario, self._trace, self._guard = scenario, trace, guard
        self._settle_s = SETTLE_GAINS / scenario.configuration.settings.observer.gain_per_s
        self._quiet = trace.quiet(self._settle_s, scenario.faults)
        self._rounded = {id(stop): _rounded(stop) for stop in trace.stops}

    def judgement(self) -> Judgement:
        scenario, trace = self._scenario, self._trace
        collisions = tuple(self._collision(contact) for contact in trace.contacts)
        faults = tuple(self._fault(fault) for fault in scenario.faults)
        losses = tuple(self._loss(stop) for stop in trace.stops)
        thresholds = [scenario.configuration.threshold_nm(name) for name in TASKS if TASKS[name] in trace.task]
        failures = tuple(self._failures(collisions, losses))
        why = (*failures, *self._untested(collisions, faults))
        return Judgement(
            verdict="failed" if failures else "incomplete" if why else "passed",
            why=why,
            finished=trace.finished,
            ended=trace.ended,
            collisions=collisions,
            faults=faults,
            losses=losses,
            peaks=self._peaks(self._quiet),
            threshold_nm=tuple(round(float(value), TORQUE_DIGITS) for value in np.unique(np.concatenate(thresholds))),
            residual_alone=self._residual_alone(),
            phases=tuple(self._phase(number) for number in range(len(scenario.phases))),
            permission=tuple(_permitted_spans(trace)),
            settle_s=self._settle_s,
            cycles=len(trace.time_s),
            installation=self._installation(),
            counters=self._guard.counters,
        )

    def _failures(self, collisions: tuple[Collision, ...], losses: tuple[Loss, ...]) -> Iterator[str]:
        for one in collisions:
            if one.verdict == "missed":
                yield f"the {one.part} on link {one.link} at {one.contact_s:.3f} s was missed"
        for loss in losses:
            if loss.cause == "none":
                yield f"false stop at {loss.stop.time_s:.3f} s: {_reason_of(loss.stop)}"
        if self._trace.ended is not None:
            yield f"ended at {self._trace.ended}"
        elif not self._trace.finished:
            yield f"the time limit of {self._scenario.time_limit_s:g} s came before the end{self._since()}"

    @staticmethod
    def _untested(collisions: tuple[Collision, ...], faults: tuple[FaultEffect, ...]) -> Iterator[str]:
        for one in collisions:
            if one.verdict == NOT_TESTED:
                yield f"the {one.part} on link {one.link} was not tested: {one.why}"
        for effect in faults:
            if effect.verdict == NOT_TESTED:
                fault = effect.fault
                yield f"the fault '{fault.kind}' of joint {fault.joint} was not tested: {effect.why}"

    def _since(self) -> str:
        """What an incomplete run was waiting for."""
        trace = self._trace
        if trace.permitted[-1]:
            return ""
        if not trace.permitted.any():
            return ": there never was a permission"
        stop = trace.stops[-1]
        return f": no permission since {stop.time_s:.3f} s ({_reason_of(stop)})"

    def _peaks(self, rows: NDArray[np.bool_]) -> Peaks:
        """In these rows of each joint, (N, n)."""

        def largest(values: NDArray[np.float64]) -> NDArray[np.float64]:
            peaks = np.where(rows, np.abs(values), 0.0).max(axis=0, initial=0.0)
            return np.array([round(float(peak), TORQUE_DIGITS) for peak in peaks])

        return Peaks(largest(self._trace.index_nm), largest(self._trace.residual_nm))

    def _collision(self, contact: Contact) -> Collision:
        trace, strike, record = self._trace, contact.strike, contact.record
        begin, end = record.contact_s, record.release_s
        if begin is None or end is None:
            why = "the run ended before it" if record.sent_s is None else "the hand met nothing"
            if record.withdrawn_s is not None:
                why = "the arm had stopped before the hand was there"
            return Collision(strike.link, strike.part, NOT_TESTED, why)
        stop = next(
            (one for one in trace.stops if one.reason in DETECTIONS and begin <= one.time_s <= end + self._settle_s),
            None,
        )
        struck = Collision(
            link=record.link,
            part=strike.part,
            verdict="missed",
            contact_s=round(begin, TIME_DIGITS),
            peak_force_n=round(record.peak_force_n, FORCE_DIGITS),
        )
        if stop is not None:
            return replace(struck, verdict="detected", stop=self._rounded[id(stop)])
        if not self._permitted_at(begin):
            why = "the arm was stopped already when the hand touched it"
            return replace(struck, verdict=NOT_TESTED, why=why)
        return struck

    def _fault(self, fault: SensorFault) -> FaultEffect:
        trace = self._trace
        rows = (trace.time_s >= fault.start_s) & (trace.time_s <= fault.end_s)
        end_s = None if fault.end_s >= trace.time_s[-1] else fault.end_s
        if not rows.any():
            return FaultEffect(fault, end_s, NOT_TESTED, "the run ended before it")
        if not trace.permitted[rows].any() and not self._permitted_before(fault.start_s):
            began = trace.permitted[trace.time_s < fault.start_s].any()
            why = "the arm was stopped already" if began else "it began before the first permission"
            return FaultEffect(fault, end_s, NOT_TESTED, f"{why}, and stayed so")
        stop = next((one for one in trace.stops if _is_doing(one, fault, self._settle_s)), None)
        if stop is None:
            return FaultEffect(fault, end_s, "no stop")
        return FaultEffect(fault, end_s, "stopped", stop=self._rounded[id(stop)])

    def _loss(self, stop: Stop) -> Loss:
        trace = self._trace
        given_up = trace.ended is not None and stop is trace.stops[-1] and stop.reason == 0
        cause: Cause = "guard" if given_up else "none"
        for fault in self._scenario.faults:
            if _is_doing(stop, fault, self._settle_s):
                cause = "fault"
        for contact in trace.contacts:
            begin, end = contact.record.contact_s, contact.record.release_s
            if begin is not None and end is not None and begin <= stop.time_s <= end + self._settle_s:
                cause = "collision"
        again = np.flatnonzero(trace.permitted & (trace.time_s > stop.time_s))
        again_s = round(float(trace.time_s[again[0]]), TIME_DIGITS) if len(again) else None
        return Loss(self._rounded[id(stop)], cause, again_s)

    def _permitted_at(self, time_s: float) -> bool:
        """Whether it was in the cycle that contains this time."""
        trace = self._trace
        row = int(np.searchsorted(trace.time_s, time_s, side="right")) - 1
        return bool(trace.permitted[max(row, 0)])

    def _permitted_before(self, time_s: float) -> bool:
        """Whether it was in the last cycle that started before this time."""
        row = int(np.searchsorted(self._trace.time_s, time_s, side="left")) - 1
        return row >= 0 and bool(self._trace.permitted[row])

    def _residual_alone(self) -> ResidualAlone:
        trace, quiet = self._trace, self._quiet
        above = np.any(quiet & (np.abs(trace.residual_nm) > trace.threshold_nm), axis=1)
        starts = np.flatnonzero(above & ~np.concatenate([[False], above[:-1]]))
        return ResidualAlone(
            false_stops=len(starts),
            first_s=round(float(trace.time_s[starts[0]]), TIME_DIGITS) if len(starts) else None,
            share_of_free_time=round(float(above.sum() / max(1, quiet.any(axis=1).sum())), 4),
        )

    def _phase(self, number: int) -> PhaseResult:
        phase, trace = self._scenario.phases[number], self._trace
        rows = trace.phase == number
        speed = trace.tip_speed_m_s[rows & ~trace.under_way(self._settle_s)]
        names = {wire: name for name, wire in TASKS.items()}
        return PhaseResult(
            name=phase.name,
            task=names[phase.task],
            payload_kg=0.0 if phase.payload is None else round(phase.payload.mass_kg, 4),
            peaks=self._peaks(self._quiet & rows[:, None]),
            peak_tip_speed_m_s=round(float(speed.max(initial=0.0)), 4),
        )

    def _installation(self) -> Installation:
        scenario, configuration = self._scenario, self._scenario.configuration
        identity = None if isinstance(self._guard, Guard) else self._guard.identity
        return Installation(
            scenario=Path(scenario.source).name,
            robot=scenario.robot.name,
            assumed=scenario.notes,
            rate_hz=configuration.settings.wire.rate_hz,
            format=configuration.settings.wire.format,
            seed=scenario.seed,
            guard=identity,
            differences=() if identity is None else tuple(identity.differences(configuration)),
            hashes=provenance(self._guard.library, configuration)
            if isinstance(self._guard, Guard)
            else provenance_of_bus(self._guard.identity, configuration),
        )


def _is_doing(stop: Stop, fault: SensorFault, settle_s: float) -> bool:
    """Whether a fault may have caused a stop.

    The guard never treats a wrong or missing frame as a collision, and its error rate may remember the sender for a
    while. The effect of a wrong torque on the index ends when the observer has settled.
    """
    of_torque = fault.kind in ("offset", "gain", "stuck")
    until_s = fault.end_s + (settle_s if of_torque else FAULT_AFTERMATH_S)
    return fault.start_s <= stop.time_s <= until_s and (of_torque or stop.reason not in DETECTIONS)


def _permitted_spans(trace: Trace) -> list[tuple[float, float | None]]:
    """Times at which permission was given and ended, s; None if it lasted to the end."""
    edges = np.diff(trace.permitted.astype(int), prepend=0)
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    times = [round(float(value), TIME_DIGITS) for value in trace.time_s]
    return [(times[begin], times[ends[at]] if at < len(ends) else None) for at, begin in enumerate(begins)]


def _rounded(stop: Stop) -> Stop:
    still_s = stop.standstill_s
    return replace(
        stop,
        time_s=round(stop.time_s, TIME_DIGITS),
        standstill_s=None if still_s is None else round(still_s, TIME_DIGITS),
    )


def _reason_of(stop: Stop) -> str:
    reason = spoken(reason_name(stop))
    return f"{reason}, joint {stop.joint}" if stop.joint else reason
