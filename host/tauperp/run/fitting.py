"""An experiment fitted to another arm: its start, its moves, its payloads and its strikes.

The paper's arm has seven joints, a reach of a metre and strong drives. Another arm may be shorter, weaker, of six
joints, or have a shape that keeps a hand from the same place. Steps that the arm can do stay unchanged. The others are
changed as little as possible, and each change is one line in the report. A step that the arm cannot do at all is an
InputError.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tauperp.config import TASKS
from tauperp.errors import InputError
from tauperp.run.reachable import Reachable, Way
from tauperp.run.scenario import Phase, PointTable, Scenario
from tauperp.sim.arm import DRIVE_SHARE
from tauperp.sim.contact import Strike
from tauperp.sim.guiding import GuidingForce
from tauperp.sim.trajectory import Limits

Vector = NDArray[np.float64]

SLOWER = (1.0, 0.5, 0.25)  # speeds of moves
SCALES = (1.0, 0.75, 0.5, 0.35, 0.25)  # of moves
MASSES = (1.0, 0.75, 0.5, 0.25, 0.1)  # of payloads
GUIDES = (1.0, 0.7, 0.5, 0.3)  # of guiding forces
TURNS_RAD = (0.0, np.pi / 2, -np.pi / 2, np.pi)  # of the moves about the base
PLACES = (0.5, 0.7, 0.9, 0.3)  # along a link
SEEN = 4.0  # thresholds that a strike has to reach in the index: it lasts only 0.2 s, and grows from nothing
FEEL_SHARE = 0.9  # largest share of a drive's torque for a strike
SOFTEST_N = 20.0  # of a sufficiently strong strike
SINGULAR = 0.05  # m/rad: a start nearer to a singular posture is none


def fitted(scenario: Scenario) -> Scenario:
    """The scenario as this arm can do it, with a note for every change. Raises InputError for what it cannot do."""
    arm = Reachable(scenario.robot, scenario.configuration)
    refusals: list[str] = []
    starts = arm.starts() if scenario.start_rad is None else [scenario.start_rad, *arm.starts()]
    usable = [start for start in starts if _steady(arm, start)] or starts[:1]
    for scale in SCALES:
        for start in usable:
            for turn in TURNS_RAD:
                fit = _Fit(scenario, arm, start, scale, turn)
                try:
                    result = fit.scenario()
                except InputError as error:
                    refusals.append(str(error))
                    if not scenario.points:
                        break
                    continue
                return replace(result, notes=(*scenario.notes, *fit.notes))
        if not scenario.points:
            break
    why = max(set(refusals), key=refusals.count)
    raise InputError(f"{scenario.source}: {scenario.robot.name} cannot do this experiment: {why}")


def _steady(arm: Reachable, posture: Vector) -> bool:
    smallest = np.linalg.svd(arm.dynamics.jacobian(posture), compute_uv=False)[-1]
    return bool(smallest > SINGULAR) and bool((arm.load(posture, np.zeros(3)) < 1.0).all())


class _Fit:
    """One try: a start, a scale of the moves and a turn of them about the base."""

    def __init__(self, scenario: Scenario, arm: Reachable, start: Vector, scale: float, turn_rad: float) -> None:
        self._scenario, self._arm, self._start = scenario, arm, start
        self._scale, self._turn = scale, turn_rad
        self._limits = scenario.limits
        self.notes: list[str] = []

    def scenario(self) -> Scenario:
        """Raises InputError with the obstacle."""
        points = {name: self._point(point) for name, point in self._scenario.points.items()}
        way = self._way(points)
        if self._scale != 1.0 or self._turn != 0.0:
            turned = f", turned by {np.degrees(self._turn):.0f} degrees" if self._turn else ""
            self.notes.append(f"moves are {self._scale:.0%} of the experiment's{turned}")
        mass = self._mass(way)
        guide = self._guide()
        phases, first = [], 0
        for phase in self._scenario.phases:
            phases.append(self._phase(phase, way, first, mass, guide))
            first += len(phase.steps)
        return replace(self._scenario, points=points, phases=tuple(phases), start_rad=self._start, limits=self._limits)

    def _point(self, point: PointTable) -> PointTable:
        if point.offset_m is None:
            return point
        x, y, z = (self._scale * value for value in point.offset_m)
        cos, sin = np.cos(self._turn), np.sin(self._turn)
        return PointTable(offset_m=(float(cos * x - sin * y), float(sin * x + cos * y), z))

    def _way(self, points: dict[str, PointTable]) -> Way:
        """The postures of every step of every phase; a step without motion has its start posture."""
        tip, rotation = self._arm.tip(self._start)
        goals, last = [], tip
        for phase in self._scenario.phases:
            for step in phase.steps:
                if step.move is not None:
                    last = tip + np.array(points[step.move].offset_m)
                goals.append(last)
        distinct = {tuple(np.round(goal, 9)) for goal in goals}
        if len(distinct) == 1:
            return Way(self._start[None], (0,) * len(goals))
        for share in SLOWER:
            limits = _slower(self._scenario.limits, share)
            way = self._arm.plan(self._start, goals, rotation, limits)
            if isinstance(way, Way):
                self._limits = limits
                if share != 1.0:
                    self.notes.append(
                        f"moves are at {share:.0%} of the experiment's speed: the joints cannot be faster"
                    )
                return way
            if "speed" not in way:
                break
        raise InputError(f"its straight moves: {way}")

    def _mass(self, way: Way) -> float:
        """Share of every payload's mass that the drives can carry everywhere."""
        heaviest = max((phase.payload.mass_kg for phase in self._scenario.phases if phase.payload), default=0.0)
        postures = way.position[:: max(1, len(way.position) // 40)]
        for share in MASSES:
            need, joint = self._arm.weakest(postures, share * heaviest)
            if need <= 1.0:
                if share != 1.0:
                    self.notes.append(f"payloads are {share:.0%} of the experiment's: joint {joint} carries no more")
                return share
        limit = self._arm.robot.joints[joint - 1].torque_max
        raise InputError(
            f"joint {joint} with {limit:.3g} Nm cannot carry the arm, alone or with {MASSES[-1]:.0%} payload"
        )

    def _guide(self) -> float:
        """Share of every guiding force that the drives can hold."""
        forces = [np.array(force.force_n) for phase in self._scenario.phases for _, force in phase.guides]
        for share in GUIDES:
            if all((self._arm.load(self._start, share * force) <= 1.0).all() for force in forces):
                if share != 1.0:
                    self.notes.append(
                        f"guiding forces are {share:.0%} of the experiment's: the drives withstand no more"
                    )
                return share
        raise InputError("its drives cannot withstand a tenth of the guiding force")

    def _phase(self, phase: Phase, way: Way, first: int, mass: float, guide: float) -> Phase:
        payload = phase.payload and replace(phase.payload, mass_kg=mass * phase.payload.mass_kg)
        guides = tuple((step, _scaled(force, guide)) for step, force in phase.guides)
        carried = payload.mass_kg if payload else 0.0
        strikes = tuple(
            (step, after_s, self._strike(strike, phase, self._poses(phase, way, first, step, after_s, guide), carried))
            for step, after_s, strike in phase.strikes
        )
        return replace(phase, payload=payload, guides=guides, strikes=strikes)

    def _poses(self, phase: Phase, way: Way, first: int, step: int, after_s: float, guide: float) -> list[Vector]:
        """The postures of the arm while the hand approaches."""
        forces = [np.array(force.force_n) for at, force in phase.guides if at == step]
        if forces and len(way.position) == 1:
            shift = guide * np.sum(forces, axis=0) / self._scenario.impedance.stiffness_n_m
            pushed = self._arm.give_way(self._start, shift)
            return [pushed]
        return [way.at(first + step, after_s + wait) for wait in (0.0, 0.3, 0.6)]

    def _strike(self, strike: Strike, phase: Phase, poses: list[Vector], carried_kg: float) -> Strike:
        """The strike itself if the arm can be struck so, else the nearest that is seen well enough."""
        task, middle = phase.task, poses[len(poses) // 2]
        response, threshold = self._arm.response(middle, task), self._arm.threshold(task)
        strength = DRIVE_SHARE * np.array([joint.torque_max for joint in self._arm.robot.joints])
        spare = FEEL_SHARE * strength - self._arm.load(middle, -carried_kg * self._arm.robot.gravity) * 0.8 * strength
        best, most = None, 0.0
        for one in _others(strike, self._arm.n):
            lever, _, _ = self._arm.lever(middle, one)
            seen = float((np.abs(response @ lever) / threshold).max())
            with np.errstate(divide="ignore"):
                hardest = float((np.maximum(spare, 0.0) / np.maximum(np.abs(lever), 1e-9)).min())
            push = min(strike.push_n, max(hardest, SOFTEST_N))
            reached = seen * push
            if reached <= most or not all(self._arm.clear(pose, one) for pose in poses):
                continue
            best, most = replace(one, push_n=round(push, 1)), reached
            if reached >= SEEN:
                break
        if best is None:
            raise InputError("a hand has no free path to any link")
        if most < SEEN:
            raise InputError(
                f"no strike reaches {SEEN:g} thresholds of the index of task '{_task_name(task)}' (at most {most:.1f})"
            )
        if best != strike:
            self.notes.append(
                f"phase '{phase.name}' strikes link {best.link} at {best.along:g} towards"
                f" ({', '.join(f'{round(value, 2) + 0.0:g}' for value in best.direction)}) with {best.push_n:g} N"
                f" instead of link {strike.link}"
            )
        return best


def _scaled(force: GuidingForce, share: float) -> GuidingForce:
    x, y, z = (share * value for value in force.force_n)
    return replace(force, force_n=(x, y, z))


def _slower(limits: Limits, share: float) -> Limits:
    return replace(
        limits,
        speed_m_s=share * limits.speed_m_s,
        acceleration_m_s2=share * limits.acceleration_m_s2,
        turn_rad_s=share * limits.turn_rad_s,
        joint_speed_rad_s=share * limits.joint_speed_rad_s,
        joint_acceleration_rad_s2=share * limits.joint_acceleration_rad_s2,
    )


def _others(strike: Strike, n: int) -> Iterator[Strike]:
    """The strike unchanged, then with other directions, other places, and other links near its own."""
    first = min(strike.link, n)
    yield replace(strike, link=first)
    own = np.array(strike.direction) / np.linalg.norm(strike.direction)
    ways = [own, -own]
    for x, y, z in (
        (1, 0, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 1, 0),
        (1, -1, 0),
        (0, 1, 1),
        (0, 1, -1),
        (1, 0, 1),
        (1, 0, -1),
    ):
        one = np.array((x, y, z)) / np.linalg.norm((x, y, z))
        ways += [one, -one]
    links = [first] + [link for step in (1, 2, 3) for link in (first - step, first + step) if 2 <= link <= n]
    for link in links:
        for along in PLACES:
            for way in ways:
                yield replace(
                    strike,
                    link=link,
                    along=along,
                    direction=(float(way[0]), float(way[1]), float(way[2])),
                    frame="base",
                )


def _task_name(task: int) -> str:
    return next(name for name, number in TASKS.items() if number == task)
