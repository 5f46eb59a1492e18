"""The result of a run as JSON, with stable names and order."""

import dataclasses
from typing import Any

from tauperp.judge.result import Collision, FaultEffect, Installation, Judgement, Loss, PhaseResult, reason_name
from tauperp.run.pace import Kept


def report_of(judgement: Judgement) -> dict[str, Any]:
    """All numbers with everything that they depend on by its hash. Times s, Nm, N."""
    alone, about = judgement.residual_alone, judgement.installation
    report: dict[str, Any] = {} if judgement.experiment is None else {"experiment": judgement.experiment}
    report |= {
        "scenario": about.scenario,
        "verdict": judgement.verdict,
        "passed": judgement.passed,
        "why": list(judgement.why),
        "finished": judgement.finished,
        "ended": judgement.ended,
        "false_stops": judgement.false_stops,
        "collisions": [_collision(one) for one in judgement.collisions],
        "faults": [_fault(one) for one in judgement.faults],
        "peak_index_free_nm": judgement.peaks.largest_index_nm,
        "peak_residual_free_nm": judgement.peaks.largest_residual_nm,
        "peak_index_free_by_joint_nm": judgement.peaks.index_nm.tolist(),
        "peak_residual_free_by_joint_nm": judgement.peaks.residual_nm.tolist(),
        "threshold_nm": threshold_of(judgement),
        "residual_alone": {
            "false_stops": alone.false_stops,
            "first_s": alone.first_s,
            "share_of_free_time": alone.share_of_free_time,
        },
        "phases": [_phase(one) for one in judgement.phases],
        "permission": [{"from_s": begin, "until_s": end} for begin, end in judgement.permission],
        "stops": [_loss(one) for one in judgement.losses],
        "settle_s": judgement.settle_s,
        "cycles": judgement.cycles,
        "robot": about.robot,
        "assumed": list(about.assumed),
        "rate_hz": about.rate_hz,
        "format": about.format,
        "seed": about.seed,
        "guard": _guard(about),
        "guard_counters": judgement.counters,
        "hashes": about.hashes,
    }
    if judgement.frames is not None:
        report |= {"frames": judgement.frames.count, "frames_sha256": judgement.frames.sha256}
    if judgement.real_time is not None:
        report["real_time"] = _kept(judgement.real_time)
    return report


def threshold_of(judgement: Judgement) -> float | list[float]:
    """One number where there is one."""
    values = list(judgement.threshold_nm)
    return values[0] if len(values) == 1 else values


def _collision(one: Collision) -> dict[str, Any]:
    row: dict[str, Any] = {
        "link": one.link,
        "part": one.part,
        "contact_s": one.contact_s,
        "stop_s": None if one.stop is None else one.stop.time_s,
        "latency_ms": one.latency_ms,
        "detected": one.stop is not None,
        "verdict": one.verdict,
        "why": one.why,
        "peak_force_n": one.peak_force_n,
    }
    if one.contact_s is not None:
        row |= {
            "joint": None if one.stop is None else one.stop.joint,
            "reason": None if one.stop is None else reason_name(one.stop),
            "standstill_s": None if one.stop is None else one.stop.standstill_s,
        }
    return row


def _fault(one: FaultEffect) -> dict[str, Any]:
    return {
        "joint": one.fault.joint,
        "kind": one.fault.kind,
        "start_s": one.fault.start_s,
        "end_s": one.end_s,
        "verdict": one.verdict,
        "why": one.why,
        "stop_s": None if one.stop is None else one.stop.time_s,
        "latency_ms": one.latency_ms,
        "reason": None if one.stop is None else reason_name(one.stop),
    }


def _loss(one: Loss) -> dict[str, Any]:
    return {
        "time_s": one.stop.time_s,
        "reason": reason_name(one.stop),
        "joint": one.stop.joint,
        "cause": one.cause,
        "trip": one.stop.trip_number,
        "permitted_again_s": one.permitted_again_s,
    }


def _phase(one: PhaseResult) -> dict[str, Any]:
    return {
        "name": one.name,
        "task": one.task,
        "payload_kg": one.payload_kg,
        "peak_index_free_nm": one.peaks.largest_index_nm,
        "peak_residual_free_nm": one.peaks.largest_residual_nm,
        "peak_tip_speed_m_s": one.peak_tip_speed_m_s,
    }


def _guard(about: Installation) -> dict[str, Any]:
    """The guard of this process; or an external one as it reports itself, with its deviations."""
    if about.guard is None:
        return {"whose": "library"}
    return {"whose": "bus", **dataclasses.asdict(about.guard), "differences": list(about.differences)}


def _kept(kept: Kept) -> dict[str, Any]:
    slower = kept.times_slower_than_real
    return {
        "period_us": kept.period_us,
        "cycles": kept.cycles,
        "late_cycles": kept.late_cycles,
        "skipped_periods": kept.skipped_periods,
        "permission_not_in_time": kept.permission_not_in_time,
        "p99_lateness_us": round(kept.p99_lateness_s * 1e6, 1),
        "largest_lateness_us": round(kept.largest_lateness_s * 1e6, 1),
        "times_slower_than_real": None if slower is None else round(slower, 4),
    }
