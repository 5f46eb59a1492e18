"""Running a scenario against the compiled firmware: the paper's two experiments and any other."""

import hashlib
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import can
from can.interfaces.virtual import VirtualBus

from tauperp.bus import DEFAULT_CHANNEL
from tauperp.errors import InputError
from tauperp.firmware import Guard
from tauperp.judge.judge import judge
from tauperp.judge.report import report_of
from tauperp.judge.result import Frames, Judgement
from tauperp.robot import Robot
from tauperp.run.fitting import fitted
from tauperp.run.guard_node import GuardNode, RemoteGuard
from tauperp.run.lockstep import Lockstep, Progress
from tauperp.run.pace import Pace, Patience, Patient, RealTime
from tauperp.run.scenario import Scenario, load_scenario, shipped
from tauperp.run.trace import Trace
from tauperp.run.virtual import LockstepBus
from tauperp.sim.moment import Watch
from tauperp.sim.sensors import SensorPreset

EXPERIMENTS = ("payload", "contact")
OWN_ROBOT = "ku_dex"  # of both
PUBLISHED = (
    "guard and sensors are `paper`: with real sensors (--sensors) this arm needs calibrated thresholds (--config)"
)
FREE_INDEX_LIMIT_NM = 0.5  # an experiment's verdict: no more than this without a collision
CARRYING_S = 0.05  # of real time, for a bus that is not in this process to carry one cycle's frames


@dataclass(frozen=True)
class Setup:
    """The setup on which a scenario is run.

    bus         opens one node's connection; by default a virtual bus of this process
    guard       "library": in this process, with its own connection; "bus": an external guard on that bus
    real_time   paced by the clock, without waiting for answers; otherwise in lockstep
    patience    with an external guard
    channels    of the library's guard: 1, or 2 that must agree
    """

    bus: Callable[[], can.BusABC] | None = None
    guard: Literal["library", "bus"] = "library"
    real_time: bool = False
    patience: Patience = field(default_factory=Patience)
    channels: int = 1

    def pace(self, period_s: float, *, at_once: bool) -> Pace:
        """`at_once`: the guard's answer arrives before the robot reads the bus."""
        if self.real_time:
            return RealTime(period_s, self.patience if self.guard == "bus" else None)
        return Pace() if at_once else Patient(self.patience)


@dataclass(frozen=True)
class Outcome:
    """One run: its cycles and its judgement."""

    scenario: Scenario
    trace: Trace
    judgement: Judgement

    @property
    def passed(self) -> bool:
        """The verdict."""
        return self.judgement.passed

    @property
    def report(self) -> dict[str, Any]:
        """The numbers of the JSON file."""
        return report_of(self.judgement)


def load_experiment(
    name: str,
    *,
    robot: str | Path | Robot | None = None,
    seed: int | None = None,
    rate_hz: float | None = None,
    mass_kg: float | None = None,
    chain: Mapping[str, Any] | None = None,
    config: str | Path | None = None,
    sensors: SensorPreset | None = None,
) -> Scenario:
    """Load one of EXPERIMENTS, as load_scenario does. For another arm than the paper's it is adapted to that arm.

    The preset `default` needs calibrated thresholds there. Another arm therefore has the published guard and sensors,
    unless `config` or `sensors` is given. Raises InputError also for an experiment that the arm cannot do.
    """
    other = robot is not None and (robot.name if isinstance(robot, Robot) else str(robot)) != OWN_ROBOT
    published = other and config is None and sensors is None
    if published:
        config, sensors = "paper", "paper"
    scenario = load_scenario(
        shipped(name),
        robot=robot,
        seed=seed,
        rate_hz=rate_hz,
        mass_kg=mass_kg,
        last_link=True,
        chain=chain,
        config=config,
        sensors=sensors,
    )
    if published:
        scenario = replace(scenario, notes=(*scenario.notes, PUBLISHED))
    return scenario if robot is None else fitted(scenario)


def run_experiment(
    name: str,
    scenario: Scenario | None = None,
    setup: Setup = Setup(),
    *,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> Outcome:
    """Run one of EXPERIMENTS, the shipped one or the given scenario. Raises InputError if it cannot run."""
    scenario = load_experiment(name) if scenario is None else scenario
    outcome = run_scenario(scenario, setup, progress=progress, watch=watch)
    judgement = replace(outcome.judgement, experiment=name)
    peak = judgement.peaks.largest_index_nm
    if peak > FREE_INDEX_LIMIT_NM:
        reached = f"without a collision the index reached {peak:.2f} Nm of {FREE_INDEX_LIMIT_NM}"
        judgement = replace(judgement, verdict="failed", why=(*judgement.why, reached))
    return replace(outcome, judgement=judgement)


def run_scenario(
    scenario: Scenario,
    setup: Setup = Setup(),
    *,
    listener: Callable[[can.Message], None] | None = None,
    progress: Progress | None = None,
    watch: Watch | None = None,
) -> Outcome:
    """Run a scenario with robot and guard on one bus.

    `listener` gets every frame, in the order of the bus, stamped with simulated time if the bus is this process' own;
    `watch` gets every cycle. Raises InputError for a bus that cannot be opened or fails, a block that the firmware
    refuses, a move that the arm cannot do, or a missing guard.
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
            guard = Guard(configuration.block(), second=configuration.second_block(setup.channels))
            peer = GuardNode(stack.enter_context(connect()), guard, 0.0 if at_once else CARRYING_S)
        frames = _Receiver(stack.enter_context(connect()), listener) if guard or listener else None
        lockstep = Lockstep(scenario, robot_bus, peer, pace)
        trace = lockstep.run(progress, frames.listen if frames else None, watch)
    judgement = judge(scenario, trace, guard or lockstep.telling)
    counted = None
    if frames is not None and setup.guard == "library":
        counted = Frames(frames.count, frames.digest.hexdigest())
    return Outcome(scenario, trace, replace(judgement, frames=counted, real_time=pace.kept))


class _Receiver:
    """Receives every frame of the bus."""

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
