"""A scenario, cycle by cycle: robot, bus and guard. In simulated time the same seed gives the same bits."""

from collections.abc import Callable
from dataclasses import replace

import can
import numpy as np

from tauperp.config import TASKS
from tauperp.errors import InputError
from tauperp.robot_side import Answer
from tauperp.run.guard_node import GuardPeer
from tauperp.run.node import RobotNode
from tauperp.run.pace import Pace
from tauperp.run.reach import wire_range
from tauperp.run.scenario import Scenario, StepTable
from tauperp.run.telling import Telling
from tauperp.run.trace import Contact, Stop, Trace, TraceRecorder
from tauperp.sim.arm import Arm
from tauperp.sim.contact import Hand, Obstructed
from tauperp.sim.dynamics import Dynamics
from tauperp.sim.guiding import Guidance
from tauperp.sim.moment import Moment, Watch
from tauperp.sim.motion import Job, Mode, Motion, Move, Wait, Yield
from tauperp.sim.posture import home
from tauperp.sim.sensors import Sensors
from tauperp.sim.stability import Stability
from tauperp.sim.trajectory import Planner, Unreachable
from tauperp.wire_values import REASON_CLASS, ReasonClass

LAST_LOOK_S = 0.5  # simulated after the last step is done
COMING_TO_REST_S = 2.0  # simulated at most after a guard has been given up
AT_REST_S = 0.1  # and after the robot has then stopped
BEYOND_S = 1.0  # s; a joint may be beyond the wire's range for this time before the run is aborted
REACTION_S = 0.15  # s until a person removes the hand that has stopped a robot

Progress = Callable[[float, str], None]  # share of the steps done, 0 to 1, and the phase's name


class Lockstep:
    """One run of a scenario with a guard on the same bus. Call `run` once.

    `bus` is the robot's own connection. `pace` decides when cycles start and how long to wait for the guard's answer.
    If it gives up the guard, the run ends when the robot has stopped. Raises InputError, with the scenario's file and
    the step, for a move that the arm cannot do; if no guard answers at the start; and in real time for a guard that
    reports lockstep.
    """

    def __init__(self, scenario: Scenario, bus: can.BusABC, guard: GuardPeer, pace: Pace | None = None) -> None:
        self._scenario = scenario
        self._pace = Pace() if pace is None else pace
        self._channel = bus.channel_info
        self._ended: str | None = None
        self._guard = guard
        settings, robot = scenario.configuration.settings, scenario.robot
        self._period = scenario.configuration.period_us * 1e-6
        self._thresholds = {number: scenario.configuration.threshold_nm(name) for name, number in TASKS.items()}
        rng = np.random.default_rng(scenario.seed)
        mass_scale = 1 + scenario.model_error * rng.uniform(-1, 1, robot.n)
        strikes = [
            (strike, f"phase.{number}.strike.{index}")
            for number, phase in enumerate(scenario.phases)
            for index, (_, _, strike) in enumerate(phase.strikes)
        ]
        self._hands = [Hand(strike, number + 1, place) for number, (strike, place) in enumerate(strikes)]
        self._guidance = Guidance()
        self._arm = Arm(
            robot,
            period_s=self._period,
            substeps=scenario.substeps,
            mass_scale=mass_scale,
            touching=[*self._hands, self._guidance],
        )
        dynamics = Dynamics(robot)
        start = home(robot, dynamics) if scenario.start_rad is None else scenario.start_rad
        self._steps = [(phase, step) for phase in range(len(scenario.phases)) for step in _steps(scenario, phase)]
        jobs = _jobs(scenario, dynamics, start)
        self._motion = Motion(
            Planner(robot, dynamics, self._period), dynamics, self._period, start, jobs, scenario.recovery
        )
        self._node = RobotNode(
            bus,
            scenario.configuration.wire,
            self._arm,
            Sensors(scenario.sensors, robot.n, rng, scenario.faults),
            self._motion,
            fd=settings.wire.format == "fd",
            hears_indexes=guard.remote,
        )
        self._arm.reset(start)
        self._node.start(scenario.faults)
        self._stability = Stability(self._arm)
        self._wire = wire_range(scenario.configuration.wire)
        self._beyond_since: float | None = None  # since when a joint is beyond the range of the wire
        self._job = -1
        self._stood_since = 0.0
        self._started = False  # the robot has had its first permission
        self._due: list[tuple[float, Hand]] = []

    def run(
        self,
        progress: Progress | None = None,
        listen: Callable[[], None] | None = None,
        watch: Watch | None = None,
    ) -> Trace:
        """Run all phases, or until the time limit.

        `listen` is called after every cycle, for a recorder; `watch` receives each cycle, for a viewer.
        """
        recorder = TraceRecorder()
        if self._guard.remote:
            self._node.forget_the_past()
        with self._pace:
            finished = self._cycles(recorder, progress, listen, watch)
        if progress is not None:
            progress(1.0, "")
        contacts = tuple(Contact(hand.strike, hand.record) for hand in self._hands)
        return recorder.trace(self._thresholds, contacts, finished and self._ended is None, self._ended)

    @property
    def telling(self) -> Telling:
        """The last reports of an external guard."""
        return self._node.telling

    def _cycles(
        self,
        recorder: TraceRecorder,
        progress: Progress | None,
        listen: Callable[[], None] | None,
        watch: Watch | None,
    ) -> bool:
        """True if every phase was done."""
        cycle, limit_s, finished_at = 0, self._scenario.time_limit_s, None
        was_permitted = False
        while cycle * self._period < limit_s:
            time_s = cycle * self._period
            self._begin_job(time_s, progress)
            self._send_hands(time_s)
            if self._ended is None:
                self._pace.begin()
            self._cycle(cycle)
            self._note(recorder, time_s, was_permitted)
            was_permitted = self._node.permitted
            if listen is not None:
                listen()
            if watch is not None:
                watch(self._moment(time_s))
            if self._ended is None and self._given_up(cycle):
                limit_s = time_s + COMING_TO_REST_S
            if self._ended is not None and self._motion.standing:
                limit_s = min(limit_s, time_s + AT_REST_S)
            cycle += 1
            if self._motion.finished:
                finished_at = time_s if finished_at is None else finished_at
                if time_s >= finished_at + LAST_LOOK_S:
                    break
        return finished_at is not None

    def _cycle(self, cycle: int) -> None:
        self._node.begin_cycle(cycle)
        self._guard.turn(cycle * self._scenario.configuration.period_us)
        try:
            self._node.end_cycle(cycle, self._pace.answer_timeout_s)
        except Unreachable as error:
            raise InputError(f"{self._scenario.source}: {self._place()}: {error}") from error
        self._check_physics(cycle * self._period)

    def _check_physics(self, time_s: float) -> None:
        """Raises InputError for a simulation that became unstable."""
        alone = self._motion.mode is not Mode.BRAKED and not any(hand.force_n for hand in self._hands)
        wrong = self._stability.look(self._node.sample.velocity, alone=alone)
        if wrong is None:
            return
        rotors = ", ".join(f"{joint.rotor_inertia:.2g}" for joint in self._scenario.robot.joints)
        raise InputError(
            f"{self._scenario.source}: the simulation of {self._scenario.robot.name} is unstable at {time_s:.3f} s:"
            f" {wrong}; the guard was not judged. Give larger rotor inertia (plant.rotor_inertia_kg_m2, now"
            f" {rotors}), more plant.substeps or softer [impedance]"
        )

    def _beyond_wire(self, time_s: float) -> str | None:
        """Why the run cannot continue: a joint stays outside the range of the wire."""
        position = np.abs(self._node.sample.position)
        if (position <= self._wire.position).all():
            self._beyond_since = None
            return None
        self._beyond_since = time_s if self._beyond_since is None else self._beyond_since
        if time_s < self._beyond_since + BEYOND_S:
            return None
        joint = int(np.argmax(position))
        name, value = self._scenario.robot.joints[joint].name, self._node.sample.position[joint]
        return (
            f"{name} (joint {joint + 1}) stands at {value:.3f} rad, beyond the {self._wire.position:.3f} rad that the"
            " wire carries: no guard can permit that"
        )

    def _given_up(self, cycle: int) -> bool:
        """Whether the guard is absent. Raises InputError if it never answered."""
        node, pace = self._node, self._pace
        reason = None
        if pace.real_time and self._guard.remote and node.telling.in_lockstep:
            raise InputError(
                f"the guard on {self._channel} runs in lockstep: its deadlines do not hold in real time"
                " (leave out --real-time, or start it without --lockstep)"
            )
        if pace.note(node.answer):
            assert pace.patience is not None
            if not pace.answered and node.answer is Answer.MISSING:
                raise InputError(
                    f"no guard on {self._channel}: no StopCommand answered the robot for {pace.patience.start_s:g} s"
                )
            reason = f"no answer of the guard for {pace.patience.answer_s:g} s"
            if node.answer is Answer.OTHER:
                reason += ", only StopCommands of other cycles or counters: it is late, has restarted or is not alone"
        if self._guard.remote and node.has_company:
            reason = "two guards answer: StopCommands come with two counters"
        reason = reason or self._beyond_wire(cycle * self._period)
        if reason is None:
            return False
        node.deaf = True
        self._ended = f"cycle {cycle}, {cycle * self._period:.3f} s: {reason}"
        return True

    def _begin_job(self, time_s: float, progress: Progress | None) -> None:
        """At the start of a step: grasp, send the task, and start contacts."""
        motion, scenario = self._motion, self._scenario
        if motion.job == self._job or motion.finished:
            return
        before = self._steps[self._job][0] if self._job >= 0 else -1
        self._job = motion.job
        phase, step = self._steps[self._job]
        current = scenario.phases[phase]
        if phase != before:
            self._arm.attach(current.payload)
            self._node.task = current.task
        self._guidance.start(tuple(force for at, force in current.guides if at == step), time_s)
        hand = sum(len(earlier.strikes) for earlier in scenario.phases[:phase])
        for number, (at, after_s, _) in enumerate(current.strikes):
            if at == step:
                self._due.append((time_s + after_s, self._hands[hand + number]))
        if progress is not None:
            progress(self._job / len(self._steps), current.name)

    def _send_hands(self, time_s: float) -> None:
        for due in [one for one in self._due if one[0] <= time_s]:
            try:
                due[1].start(self._arm, time_s)
            except Obstructed as error:
                raise InputError(f"{self._scenario.source}: {due[1].place}: {error}") from error
            self._due.remove(due)
        self._started = self._started or self._node.permitted
        if not self._started or self._motion.mode not in (Mode.PAUSING, Mode.BRAKED):
            self._stood_since = time_s
        elif time_s >= self._stood_since + REACTION_S:
            for hand in self._hands:
                hand.withdraw(time_s)

    def _note(self, recorder: TraceRecorder, time_s: float, was_permitted: bool) -> None:
        node, indexes = self._node, self._indexes()
        forces = (sum(hand.force_n for hand in self._hands), float(np.linalg.norm(self._guidance.force_n)))
        speed = float(np.linalg.norm(self._arm.tip_velocity()))
        phase = self._steps[max(self._job, 0)][0]
        fresh = node.telling.fresh if self._guard.remote and self._guard.verdict is None else None
        recorder.row(time_s, node.task, phase, node.permitted, forces, speed, indexes, fresh, node.unusable)
        if was_permitted and not node.permitted:
            recorder.stops.append(_stop(node, time_s))
        elif recorder.stops and recorder.stops[-1].standstill_s is None and self._motion.standing:
            recorder.stops[-1] = replace(recorder.stops[-1], standstill_s=time_s)

    def _indexes(self) -> tuple[np.ndarray, np.ndarray]:
        """r and the index of the active task, from the guard itself if it is in this process, else as last reported."""
        node, verdict = self._node, self._guard.verdict
        return (node.telling.residual, node.telling.index) if verdict is None else (verdict.residual, verdict.index)

    def _moment(self, time_s: float) -> Moment:
        command, permitted = self._node.stop_command, self._node.permitted
        tripped = command is not None and not permitted and _is_trip(int(command["Reason"]))
        return Moment(
            time_s,
            self._arm.model,
            self._arm.data,
            permitted,
            int(command["Joint"]) if command is not None and tripped else 0,
            *self._indexes(),
            threshold=self._thresholds[self._node.task],
            contact_n=sum(hand.force_n for hand in self._hands),
        )

    def _place(self) -> str:
        phase, step = self._steps[min(self._motion.job, len(self._steps) - 1)]
        return f"phase.{phase}.do.{step}"


def _steps(scenario: Scenario, phase: int) -> range:
    return range(len(scenario.phases[phase].steps))


def _jobs(scenario: Scenario, dynamics: Dynamics, start: np.ndarray) -> list[Job]:
    """The steps of all phases as the robot's jobs; points are relative to the start of the tip."""
    tip, rotation = dynamics.tip(start)
    jobs: list[Job] = []
    for phase in scenario.phases:
        jobs.extend(_job(step, scenario, tip, rotation) for step in phase.steps)
    return jobs


def _job(step: StepTable, scenario: Scenario, tip: np.ndarray, rotation: np.ndarray) -> Job:
    if step.wait_s is not None:
        return Wait(step.wait_s)
    if step.yield_s is not None:
        return Yield(step.yield_s, scenario.impedance)
    assert step.move is not None
    point = scenario.points[step.move]
    if point.joints_rad is not None:
        return Move(joints=np.array(point.joints_rad, float), limits=scenario.limits)
    assert point.offset_m is not None
    return Move(tip_m=tip + np.array(point.offset_m), rotation=rotation, limits=scenario.limits)


def _stop(node: RobotNode, time_s: float) -> Stop:
    command = node.stop_command
    if node.answer is not Answer.GOOD or command is None or command["Permission"] == 1:
        return Stop(time_s, reason=0, category=1, joint=0, value_nm=0.0, trip_number=0)
    return Stop(
        time_s,
        reason=int(command["Reason"]),
        category=int(command["StopCategory"]),
        joint=int(command["Joint"]),
        value_nm=float(command["IndexValue"]),
        trip_number=int(command["TripNumber"]),
    )


def _is_trip(reason: int) -> bool:
    """Whether it latches: every state except waiting."""
    return REASON_CLASS.get(reason, ReasonClass.UNKNOWN) is not ReasonClass.WAITING
