"""Running a scenario against the compiled firmware, and judging what came of it: the paper's two experiments and any
other.

A collision is *under way* from the first touch until 5 / K after the last one, K the observer's gain: by then what the
observer remembers of it has decayed below 1 %. A stop for a collision at any other time is a false stop; what r and the
index reach at any other time are the free peaks. Nothing else is left out, neither grasping and letting go of payloads
nor stopping, retreating and coming back.
"""

import dataclasses
import hashlib
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import can
import numpy as np
from can.interfaces.virtual import VirtualBus

from tauperp.bus import DEFAULT_CHANNEL
from tauperp.config import TASKS
from tauperp.errors import InputError
from tauperp.firmware import Guard, Reason
from tauperp.provenance import provenance, provenance_of_bus
from tauperp.scenario import Scenario, load_scenario, shipped
from tauperp.sim.guard_node import GuardNode, RemoteGuard
from tauperp.sim.lockstep import Lockstep, Progress
from tauperp.sim.moment import Watch
from tauperp.sim.pace import Pace, Patience, Patient, RealTime
from tauperp.sim.telling import Telling
from tauperp.sim.trace import Contact, Stop, Trace
from tauperp.sim.virtual import LockstepBus

EXPERIMENTS = ("payload", "contact")
SETTLE_GAINS = 5.0  # times 1 / K
FAULT_AFTERMATH_S = 1.0  # a stop that long after a sensor fault is still its doing
DETECTIONS = (
    Reason.COLLISION,
    Reason.EXPLAINED_FORCE,
    Reason.EXPLAINED_MOMENT,
    Reason.RESIDUAL_LIMIT,
    Reason.INPUT_RANGE,
)
FREE_INDEX_LIMIT_NM = 0.5  # an experiment's verdict: no more than this without a collision
CARRYING_S = 0.05  # of real time, for a bus that is not in this process to carry one cycle's frames


@dataclass(frozen=True)
class Setup:
    """What a scenario is run on.

    bus         opens one node's connection; by default a virtual bus of this process
    guard       "library": in this process, on a connection of its own; "bus": somebody else's, on that bus
    real_time   paced by the clock, waiting for nobody; else in lockstep
    patience    with a guard that is somebody else's
    """

    bus: Callable[[], can.BusABC] | None = None
    guard: Literal["library", "bus"] = "library"
    real_time: bool = False
    patience: Patience = field(default_factory=Patience)

    def pace(self, period_s: float, *, at_once: bool) -> Pace:
        """`at_once`: the guard's answer is there before the robot can look."""
        if self.real_time:
            return RealTime(period_s, self.patience if self.guard == "bus" else None)
        return Pace() if at_once else Patient(self.patience)


@dataclass(frozen=True)
class Outcome:
    """One run: its cycles, and its numbers as they go into a JSON file."""

    scenario: Scenario
    trace: Trace
    report: dict[str, Any]

    @property
    def passed(self) -> bool:
        """The verdict."""
        return bool(self.report["passed"])


def load_experiment(
    name: str,
    *,
    robot: str | Path | None = None,
    seed: int | None = None,
    rate_hz: float | None = None,
    mass_kg: float | None = None,
) -> Scenario:
    """One of EXPERIMENTS, as load_scenario."""
    return load_scenario(shipped(name), robot=robot, seed=seed, rate_hz=rate_hz, mass_kg=mass_kg)


def run_experiment(
    name: str, scenario: Scenario | None = None, setup: Setup = Setup(), *, progress: Progress | None = None
) -> Outcome:
    """One of EXPERIMENTS, as it is shipped or loaded otherwise. Raises InputError for what cannot be run."""
    scenario = load_experiment(name) if scenario is None else scenario
    outcome = run_scenario(scenario, setup, progress=progress)
    quiet = outcome.report["peak_index_free_nm"] <= FREE_INDEX_LIMIT_NM
    report = {"experiment": name, **outcome.report, "passed": outcome.passed and quiet}
    return Outcome(scenario, outcome.trace, report)


def run_scenario(
    scenario: Scenario,
    setup: Setup = Setup(),
    *,
    listener: Callable[[can.Message], None] | None = None,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> Outcome:
    """Robot and guard on one bus.

    `listener` gets every frame, in the order of the bus, stamped with simulated time if the bus is this process' own;
    `watch` sees every cycle. Raises InputError for a bus that cannot be opened or fails, a block that the firmware
    refuses, a move that the arm cannot do, or a guard that is not there.
    """
    try:
        return _run_scenario(scenario, setup, listener, progress, watch)
    except can.CanOperationError as error:
        raise InputError(f"CAN bus: {' '.join(str(error).split())}") from error


def _run_scenario(
    scenario: Scenario,
    setup: Setup,
    listener: Callable[[can.Message], None] | None,
    progress: Progress | None,
    watch: Watch | None,
) -> Outcome:
    configuration = scenario.configuration
    connect = setup.bus or (lambda: LockstepBus(DEFAULT_CHANNEL))
    with ExitStack() as stack:
        robot_bus = stack.enter_context(connect())
        at_once = setup.guard == "library" and isinstance(robot_bus, VirtualBus)
        pace = setup.pace(configuration.period_us * 1e-6, at_once=at_once)
        guard: Guard | None = None
        peer: GuardNode | RemoteGuard = RemoteGuard()
        if setup.guard == "library":
            guard = Guard(configuration.block())
            peer = GuardNode(stack.enter_context(connect()), guard, 0.0 if at_once else CARRYING_S)
        frames = _Ear(stack.enter_context(connect()), listener) if guard or listener else None
        lockstep = Lockstep(scenario, robot_bus, peer, pace)
        trace = lockstep.run(progress, frames.listen if frames else None, watch)
    report = judge(scenario, trace, guard or lockstep.telling)
    if frames is not None and setup.guard == "library":
        report |= {"frames": frames.count, "frames_sha256": frames.digest.hexdigest()}
    if pace.report is not None:
        report["real_time"] = pace.report
    return Outcome(scenario, trace, report)


class _Ear:
    """Hears every frame of the bus."""

    def __init__(self, bus: can.BusABC, listener: Callable[[can.Message], None] | None) -> None:
        self.digest = hashlib.sha256()
        self.count = 0
        self._bus = bus
        self._listener = listener

    def listen(self) -> None:
        while (frame := self._bus.recv(timeout=0.0)) is not None:
            self.digest.update(frame.arbitration_id.to_bytes(4, "little") + frame.data)
            self.count += 1
            if self._listener is not None:
                self._listener(frame)


def judge(scenario: Scenario, trace: Trace, guard: Guard | Telling) -> dict[str, Any]:
    """The run's numbers, verdict included, with everything that they depend on by its hash. Times s, Nm, N."""
    settle_s = SETTLE_GAINS / scenario.configuration.settings.observer.gain_per_s
    free = trace.free(settle_s)
    collisions = [_collision(contact, trace, settle_s) for contact in trace.contacts]
    stops = [_stop(stop, scenario, trace, settle_s) for stop in trace.stops]
    false_stops = sum(stop["cause"] == "none" for stop in stops)
    thresholds = [scenario.configuration.threshold_nm(name) for name in TASKS if TASKS[name] in trace.task]
    configuration = scenario.configuration
    return {
        "scenario": Path(scenario.source).name,
        "passed": trace.finished and false_stops == 0 and all(one["detected"] for one in collisions),
        "finished": trace.finished,
        "ended": trace.ended,
        "false_stops": false_stops,
        "collisions": collisions,
        "peak_index_free_nm": round(float(np.abs(trace.index_nm[free]).max(initial=0.0)), 4),
        "peak_residual_free_nm": round(float(np.abs(trace.residual_nm[free]).max(initial=0.0)), 4),
        "threshold_nm": _one_or_many(np.unique(np.concatenate(thresholds))),
        "residual_alone": _residual_alone(trace, settle_s),
        "phases": [_phase(number, scenario, trace, settle_s) for number in range(len(scenario.phases))],
        "stops": stops,
        "settle_s": settle_s,
        "cycles": len(trace.time_s),
        "robot": scenario.robot.name,
        "rate_hz": configuration.settings.wire.rate_hz,
        "format": configuration.settings.wire.format,
        "seed": scenario.seed,
        "guard": _guard(scenario, guard),
        "guard_counters": guard.counters,
        "hashes": provenance(guard.library, configuration)
        if isinstance(guard, Guard)
        else provenance_of_bus(guard.identity, configuration),
    }


def _guard(scenario: Scenario, guard: Guard | Telling) -> dict[str, Any]:
    """Whose it was: of this process, or of somebody else in its own words and with what is not as it should be."""
    if isinstance(guard, Guard):
        return {"whose": "library"}
    identity = guard.identity
    return {
        "whose": "bus",
        **dataclasses.asdict(identity),
        "differences": identity.differences(scenario.configuration),
    }


def _collision(contact: Contact, trace: Trace, settle_s: float) -> dict[str, Any]:
    """One strike. Detected: motion was stopped while it was under way, by the index (reason COLLISION) or because the
    blow drove a sensor out of its range (INPUT_RANGE)."""
    record = contact.record
    begin, end = record.contact_s, record.release_s
    if begin is None or end is None:
        return {
            "link": contact.strike.link,
            "contact_s": None,
            "stop_s": None,
            "latency_ms": None,
            "detected": False,
            "peak_force_n": 0.0,
        }
    stop = next(
        (one for one in trace.stops if one.reason in DETECTIONS and begin <= one.time_s <= end + settle_s), None
    )
    return {
        "link": record.link,
        "contact_s": round(begin, 6),
        "stop_s": None if stop is None else round(stop.time_s, 6),
        "latency_ms": None if stop is None else round((stop.time_s - begin) * 1000, 3),
        "detected": stop is not None,
        "peak_force_n": round(record.peak_force_n, 2),
        "part": contact.strike.part,
        "joint": None if stop is None else stop.joint,
        "reason": None if stop is None else Reason(stop.reason).name,
        "standstill_s": None if stop is None or stop.standstill_s is None else round(stop.standstill_s, 6),
    }


def _stop(stop: Stop, scenario: Scenario, trace: Trace, settle_s: float) -> dict[str, Any]:
    """One loss of permission and what caused it: a collision, a sensor fault of the scenario, a guard that was given up
    (the last stop then, told by the run's end), or none (false)."""
    cause = "guard" if trace.ended is not None and stop is trace.stops[-1] and stop.reason == 0 else "none"
    if any(fault.start_s <= stop.time_s <= fault.end_s + FAULT_AFTERMATH_S for fault in scenario.faults):
        cause = "fault"
    for contact in trace.contacts:
        begin, end = contact.record.contact_s, contact.record.release_s
        if begin is not None and end is not None and begin <= stop.time_s <= end + settle_s:
            cause = "collision"
    reason = "SILENCE" if stop.reason == 0 else Reason(stop.reason).name
    return {"time_s": round(stop.time_s, 6), "reason": reason, "joint": stop.joint, "cause": cause}


def _residual_alone(trace: Trace, settle_s: float) -> dict[str, Any]:
    """What the same threshold on r instead of the index would have done while no collision was under way."""
    free = ~trace.under_way(settle_s)
    above = np.any(trace.free(settle_s) & (np.abs(trace.residual_nm) > trace.threshold_nm), axis=1)
    starts = np.flatnonzero(above & ~np.concatenate([[False], above[:-1]]))
    return {
        "false_stops": len(starts),
        "first_s": round(float(trace.time_s[starts[0]]), 6) if len(starts) else None,
        "share_of_free_time": round(float(above.sum() / max(1, free.sum())), 4),
    }


def _phase(number: int, scenario: Scenario, trace: Trace, settle_s: float) -> dict[str, Any]:
    phase = scenario.phases[number]
    rows = trace.phase == number
    free = trace.free(settle_s) & rows[:, None]
    speed = trace.tip_speed_m_s[rows & ~trace.under_way(settle_s)]
    names = {wire: name for name, wire in TASKS.items()}
    return {
        "name": phase.name,
        "task": names[phase.task],
        "payload_kg": 0.0 if phase.payload is None else round(phase.payload.mass_kg, 4),
        "peak_index_free_nm": round(float(np.abs(trace.index_nm[free]).max(initial=0.0)), 4),
        "peak_residual_free_nm": round(float(np.abs(trace.residual_nm[free]).max(initial=0.0)), 4),
        "peak_tip_speed_m_s": round(float(speed.max(initial=0.0)), 4),
    }


def _one_or_many(values: np.ndarray) -> float | list[float]:
    return round(float(values[0]), 4) if len(values) == 1 else [round(float(value), 4) for value in values]
