"""Scenario files: a robot, its guard, what it is to do, who touches it and which sensors fail, as TOML.

    robot = "ku_dex"                 # shipped name, or a URDF or MJCF file beside the scenario
    config = "paper"                 # the guard's preset or TOML file; [guard] overrides single keys of it
    seed = 1
    [point.P2]
    offset_m = [0.0, 0.25, 0.1]      # of the end-effector from where it starts, base frame
    [[phase]]
    task = "payload"
    payload = { mass_kg = 1.0, com_m = [0.0, 0.0, 0.05] }
    do = [ { wait_s = 1.0 }, { move = "P2" } ]
    [[phase.strike]]
    step = 2                         # while that step of `do` lasts; a hand comes from `after_s` on
    link = 7
    direction = [0.0, 0.0, 1.0]

Units are in the names. Phases follow each other; a payload is grasped or let go where a phase begins.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tauperp.config import TASKS, Configuration, TaskName, load_configuration, preset_names
from tauperp.errors import InputError
from tauperp.robot import Robot
from tauperp.sim.arm import Payload
from tauperp.sim.contact import Strike
from tauperp.sim.control import ImpedanceGains
from tauperp.sim.guiding import GuidingForce
from tauperp.sim.motion import Recovery
from tauperp.sim.sensors import FaultKind, SensorFault, SensorModel
from tauperp.sim.trajectory import Limits
from tauperp.toml import Table, read_toml, validate

SCENARIOS = Path(__file__).resolve().parent / "scenarios"


def _numbers(value: Any) -> Any:
    """TOML's lists are what the models hold as tuples."""
    return tuple(value) if isinstance(value, list) else value


def _not_zero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if not any(value):
        raise ValueError("must have a length")
    return value


Vector3 = Annotated[tuple[float, float, float], BeforeValidator(_numbers)]
Direction = Annotated[Vector3, AfterValidator(_not_zero)]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]


class PayloadTable(Table):
    mass_kg: Positive = Field(le=50)
    com_m: Vector3 = (0.0, 0.0, 0.0)  # from the end-effector point, in the last link's axes
    radius_m: Positive = 0.04  # of the solid ball whose inertia it has


class StrikeTable(Table):
    """A collision; see tauperp.sim.contact.Strike."""

    step: int = Field(default=1, ge=1)
    after_s: NotNegative = 0.0
    link: int = Field(ge=1)
    along: Share = 0.5
    direction: Direction
    frame: Literal["base", "link"] = "base"
    part: Literal["hand", "forearm"] = "hand"
    speed_m_s: Positive = Field(default=0.3, le=2)
    push_n: Positive = Field(default=100.0, le=1000)
    duration_s: Positive = Field(default=0.2, le=10)


class GuideTable(Table):
    """An intended force on the end-effector; see tauperp.sim.guiding.GuidingForce."""

    step: int = Field(default=1, ge=1)
    after_s: NotNegative = 0.0
    force_n: Vector3
    moment_nm: Vector3 = (0.0, 0.0, 0.0)
    rise_s: Positive = 0.5
    hold_s: NotNegative = 1.0


class StepTable(Table):
    """One thing to do: a move to a point, standing still, or yielding to a person's hand in impedance control."""

    move: str | None = None
    wait_s: Positive | None = None
    yield_s: Positive | None = None

    @model_validator(mode="after")
    def _one_thing(self) -> "StepTable":
        if sum(value is not None for value in (self.move, self.wait_s, self.yield_s)) != 1:
            raise ValueError("must have exactly one of move, wait_s and yield_s")
        return self


class PhaseTable(Table):
    name: str = ""
    task: TaskName
    payload: PayloadTable | None = None
    do: list[StepTable] = Field(min_length=1)
    strike: list[StrikeTable] = []
    guide: list[GuideTable] = []


class PointTable(Table):
    """A place: of the end-effector relative to where it starts, its orientation kept, or all joints."""

    offset_m: Vector3 | None = None
    joints_rad: list[float] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> "PointTable":
        if (self.offset_m is None) == (self.joints_rad is None):
            raise ValueError("must have either offset_m or joints_rad")
        return self


class SensorTable(Table):
    """Errors of the joint sensors; see tauperp.sim.sensors.SensorModel."""

    torque_noise_nm: NotNegative = 0.0
    torque_offset_nm: NotNegative = 0.0
    torque_gain_error: NotNegative = Field(default=0.0, lt=1)
    torque_ripple_nm: NotNegative = 0.0
    ripple_per_turn: int = Field(default=2, ge=1)
    position_noise_rad: NotNegative = 0.0
    velocity_noise_rad_s: NotNegative = 0.0
    delay_cycles: int = Field(default=0, ge=0, le=100)


class FaultTable(Table):
    """Something that goes wrong with a sensor; see tauperp.sim.sensors.SensorFault."""

    joint: int = Field(ge=1)
    kind: FaultKind
    start_s: NotNegative
    end_s: Positive = 1e9
    value: float = 0.0


class PlantTable(Table):
    """How the simulated arm differs from what everybody believes it to be."""

    model_error: NotNegative = Field(default=0.0, le=0.5)  # each link's mass and inertia, evenly within plus and minus
    substeps: int = Field(default=2, ge=1, le=100)  # of the physics in one cycle


class LimitTable(Table):
    """Of moves; see tauperp.sim.trajectory.Limits."""

    speed_m_s: Positive = 0.5
    acceleration_m_s2: Positive = 2.0
    turn_rad_s: Positive = 1.0
    joint_speed_rad_s: Positive = 0.8
    joint_acceleration_rad_s2: Positive = 3.0


class ImpedanceTable(Table):
    """While it yields; see tauperp.sim.control.ImpedanceGains."""

    stiffness_n_m: Positive = 500.0
    stiffness_nm_rad: Positive = 50.0
    damping_ratio: Positive = 1.0
    posture_nm_rad: NotNegative = 20.0


class RecoveryTable(Table):
    """How it stops and comes back; see tauperp.sim.motion.Recovery."""

    deceleration_rad_s2: Positive = 6.0
    pause_s: NotNegative = 0.4
    retreat_m: NotNegative = 0.05


class ScenarioTable(Table):
    robot: str = Field(default="ku_dex", min_length=1)
    config: str = "default"
    seed: int = Field(default=1, ge=0)
    time_limit_s: Positive = 120.0
    start_rad: list[float] | None = None
    guard: dict[str, Any] = {}
    point: dict[str, PointTable] = {}
    phase: list[PhaseTable] = Field(min_length=1)
    limits: LimitTable = LimitTable()
    impedance: ImpedanceTable = ImpedanceTable()
    recovery: RecoveryTable = RecoveryTable()
    sensors: SensorTable = SensorTable()
    plant: PlantTable = PlantTable()
    fault: list[FaultTable] = []


@dataclass(frozen=True)
class Phase:
    """One phase, ready to be run: what to do, and who comes during which step (counted from 0) after how long."""

    name: str
    task: int  # as on the wire
    payload: Payload | None
    steps: tuple[StepTable, ...]
    strikes: tuple[tuple[int, float, Strike], ...]
    guides: tuple[tuple[int, GuidingForce], ...]


@dataclass(frozen=True)
class Scenario:
    """A checked scenario. `source` names its file in messages."""

    source: str
    robot: Robot
    configuration: Configuration
    seed: int
    time_limit_s: float
    start_rad: np.ndarray | None
    points: dict[str, PointTable]
    phases: tuple[Phase, ...]
    limits: Limits
    impedance: ImpedanceGains
    recovery: Recovery
    sensors: SensorModel
    faults: tuple[SensorFault, ...]
    model_error: float
    substeps: int


def shipped(name: str) -> Path:
    """The file of a shipped scenario. Raises InputError if there is none of this name."""
    path = SCENARIOS / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(sorted(one.stem for one in SCENARIOS.glob("*.toml")))
        raise InputError(f"there is no shipped scenario '{name}' (there are {known})")
    return path


def load_scenario(
    path: str | Path,
    *,
    robot: str | Path | None = None,
    seed: int | None = None,
    rate_hz: float | None = None,
    mass_kg: float | None = None,
) -> Scenario:
    """Read and check a scenario file; what is given here wins over what it says.

    `rate_hz` takes the frame format that belongs to it: classic CAN up to 500 Hz, CAN FD above. `mass_kg` scales all
    payloads so that the heaviest has it. Raises InputError: one line with the file and the key's place.
    """
    path = Path(path)
    table = validate(ScenarioTable, read_toml(path), path)
    source = str(path)
    guard = dict(table.guard)
    if rate_hz is not None:
        guard["wire"] = {"rate_hz": rate_hz, "format": "classic" if rate_hz <= 500 else "fd"}
    configuration = load_configuration(
        _beside(path, table.config, preset_names()),
        robot=robot if robot is not None else _beside(path, table.robot, ()),
        overrides=guard,
    )
    arm = configuration.robot
    _check(table, arm, configuration, source)
    heaviest = max((phase.payload.mass_kg for phase in table.phase if phase.payload), default=0.0)
    scale = 1.0 if mass_kg is None or heaviest == 0.0 else mass_kg / heaviest
    start = table.start_rad if robot is None or arm.name == table.robot else None
    return Scenario(
        source=source,
        robot=arm,
        configuration=configuration,
        seed=table.seed if seed is None else seed,
        time_limit_s=table.time_limit_s,
        start_rad=None if start is None else np.array(start, float),
        points=table.point,
        phases=tuple(_phase(one, scale) for one in table.phase),
        limits=Limits(**table.limits.model_dump()),
        impedance=ImpedanceGains(**table.impedance.model_dump()),
        recovery=Recovery(**table.recovery.model_dump()),
        sensors=SensorModel(**table.sensors.model_dump()),
        faults=tuple(SensorFault(**one.model_dump()) for one in table.fault),
        model_error=table.plant.model_error,
        substeps=table.plant.substeps,
    )


def _beside(path: Path, name: str, known: Any) -> str | Path:
    """A name that is shipped as it is; a file's path relative to the scenario that names it."""
    beside = path.parent / name
    return beside if name not in known and (beside.suffix or beside.is_file()) else name


def _phase(table: PhaseTable, scale: float) -> Phase:
    payload = None
    if table.payload is not None:
        payload = Payload(table.payload.mass_kg * scale, table.payload.com_m, table.payload.radius_m)
    strikes = []
    for one in table.strike:
        strikes.append((one.step - 1, one.after_s, Strike(**one.model_dump(exclude={"step", "after_s"}))))
    guides = []
    for guide in table.guide:
        force = GuidingForce(guide.force_n, guide.moment_nm, guide.after_s, guide.rise_s, guide.hold_s)
        guides.append((guide.step - 1, force))
    return Phase(table.name, TASKS[table.task], payload, tuple(table.do), tuple(strikes), tuple(guides))


def _check(table: ScenarioTable, robot: Robot, configuration: Configuration, source: str) -> None:
    """What one table by itself cannot know."""

    def refuse(place: str, message: str) -> None:
        raise InputError(f"{source}: {place}: {message}")

    for name, point in table.point.items():
        if point.joints_rad is not None and len(point.joints_rad) != robot.n:
            refuse(f"point.{name}.joints_rad", f"{len(point.joints_rad)} values for {robot.n} joints")
    if table.start_rad is not None and robot.name == table.robot and len(table.start_rad) != robot.n:
        refuse("start_rad", f"{len(table.start_rad)} values for {robot.n} joints")
    for number, fault in enumerate(table.fault):
        if fault.joint > robot.n:
            refuse(f"fault.{number}.joint", f"{robot.name} has {robot.n} joints, not {fault.joint}")
    for number, phase in enumerate(table.phase):
        place = f"phase.{number}"
        if configuration.settings.task[phase.task].index == "off":
            refuse(f"{place}.task", f"'{phase.task}' is off in {configuration.source} for {robot.name}")
        for step, one in enumerate(phase.do):
            if one.move is not None and one.move not in table.point:
                known = ", ".join(table.point) or "none"
                refuse(f"{place}.do.{step}.move", f"there is no point '{one.move}' (there are {known})")
        steps = {f"strike.{index}": one.step for index, one in enumerate(phase.strike)}
        steps |= {f"guide.{index}": one.step for index, one in enumerate(phase.guide)}
        for visitor, at in steps.items():
            if at > len(phase.do):
                refuse(f"{place}.{visitor}.step", f"the phase has {len(phase.do)} steps, not {at}")
        for index, strike in enumerate(phase.strike):
            if strike.link > robot.n:
                refuse(f"{place}.strike.{index}.link", f"{robot.name} has {robot.n} links, not {strike.link}")
