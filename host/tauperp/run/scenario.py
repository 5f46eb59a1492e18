"""Scenario files: a robot, its guard, its steps, contacts and sensor faults, as TOML.

    robot = "ku_dex"                 # shipped name, or a URDF or MJCF file beside the scenario
    config = "paper"                 # the guard's preset or TOML file; [guard] overrides single keys of it
    seed = 1
    [point.P2]
    offset_m = [0.0, 0.25, 0.1]      # of the end-effector from its start, base frame
    [[phase]]
    task = "payload"
    payload = { mass_kg = 1.0, com_m = [0.0, 0.0, 0.05] }
    do = [ { wait_s = 1.0 }, { move = "P2" } ]
    [[phase.strike]]
    step = 2                         # during that step of `do`; a hand approaches from `after_s` on
    link = 7
    direction = [0.0, 0.0, 1.0]

Units are in the names. Phases follow each other; a payload is grasped or released at the start of a phase.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tauperp.config import TASKS, Configuration, load_configuration, preset_names
from tauperp.config.indexes import is_blind
from tauperp.errors import InputError
from tauperp.robot import Robot
from tauperp.run.reach import within_wire
from tauperp.run.tables import PhaseTable, PlantTable, PointTable, ScenarioTable, StepTable
from tauperp.sim.arm import Payload
from tauperp.sim.contact import Strike
from tauperp.sim.control import ImpedanceGains
from tauperp.sim.guiding import GuidingForce
from tauperp.sim.motion import Recovery
from tauperp.sim.rotor import with_rotors
from tauperp.sim.sensors import SENSOR_PRESETS, SensorFault, SensorModel, SensorPreset
from tauperp.sim.trajectory import Limits
from tauperp.toml import read_toml, validate

SCENARIOS = Path(__file__).resolve().parents[1] / "scenarios"


@dataclass(frozen=True)
class Phase:
    """One phase, ready to run: its steps, and the contacts of each step (from 0) with their delays."""

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
    notes: tuple[str, ...] = ()  # what was assumed of the arm, or changed for it


def shipped(name: str) -> Path:
    """The file of a shipped scenario. Raises InputError for an unknown name."""
    path = SCENARIOS / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(sorted(one.stem for one in SCENARIOS.glob("*.toml")))
        raise InputError(f"there is no shipped scenario '{name}' (there are {known})")
    return path


def load_scenario(
    path: str | Path,
    *,
    robot: str | Path | Robot | None = None,
    seed: int | None = None,
    rate_hz: float | None = None,
    mass_kg: float | None = None,
    last_link: bool = False,
    chain: Mapping[str, Any] | None = None,
    config: str | Path | None = None,
    sensors: SensorPreset | None = None,
) -> Scenario:
    """Read and check a scenario file; the arguments take precedence over the file.

    The scenario's robot is the one to simulate: its ranges are cut to what the wire carries, and rotor inertia that its
    file does not give is estimated. `last_link`: a strike on a link that the arm does not have goes to its last one.
    `rate_hz` takes the frame format that belongs to it: classic CAN up to 500 Hz, CAN FD above. `mass_kg` scales all
    payloads so that the heaviest has it. `chain` is the part of the robot's file that is the arm, as for
    load_configuration. `config` is a preset or a file of the guard's configuration, `sensors` are
    simulated instead of the scenario's. Raises InputError: one line with the file and the key's place.
    """
    path = Path(path)
    table = validate(ScenarioTable, read_toml(path), path)
    source = str(path)
    guard = dict(table.guard)
    if rate_hz is not None:
        guard["wire"] = {"rate_hz": rate_hz, "format": "classic" if rate_hz <= 500 else "fd"}
    configuration = load_configuration(
        config if config is not None else _beside(path, table.config, preset_names()),
        robot=robot if robot is not None else _beside(path, table.robot, ()),
        overrides=guard,
        chain=chain,
    )
    own = robot is None or configuration.robot.name == table.robot
    if last_link:
        table = _on_links(table, configuration.robot.n)
    _check(table, configuration.robot, configuration, source)
    arm, notes = _simulated(table.plant, configuration, own, source)
    heaviest = max((phase.payload.mass_kg for phase in table.phase if phase.payload), default=0.0)
    scale = 1.0 if mass_kg is None or heaviest == 0.0 else mass_kg / heaviest
    start = table.start_rad if own else None
    _check_postures(table, arm, start, source)
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
        sensors=table.sensors.model if sensors is None else SENSOR_PRESETS[sensors],
        faults=tuple(SensorFault(**one.model_dump()) for one in table.fault),
        model_error=table.plant.model_error,
        substeps=table.plant.substeps,
        notes=notes,
    )


def _beside(path: Path, name: str, known: Any) -> str | Path:
    """A shipped name unchanged; a file's path relative to the scenario that names it."""
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


def _on_links(table: ScenarioTable, n: int) -> ScenarioTable:
    """With the strikes on links that the arm has."""
    phases = []
    for phase in table.phase:
        strikes = [strike.model_copy(update={"link": min(strike.link, n)}) for strike in phase.strike]
        phases.append(phase.model_copy(update={"strike": strikes}))
    return table.model_copy(update={"phase": phases})


def _simulated(
    plant: PlantTable, configuration: Configuration, own: bool, source: str
) -> tuple[Robot, tuple[str, ...]]:
    """The arm to simulate, and what was assumed about it. `own`: the scenario is written for this arm."""
    robot, given = configuration.robot, plant.reflected_kg_m2 if own else None
    if given is not None and len(given) != robot.n:
        raise InputError(f"{source}: plant: {len(given)} values of rotor inertia for {robot.n} joints")
    try:
        robot = within_wire(robot, configuration.wire)
    except ValueError as error:
        raise InputError(f"{source}: {error}") from error
    robot, note = with_rotors(robot, given)
    return robot, () if note is None else (note,)


def _check_postures(table: ScenarioTable, robot: Robot, start: list[float] | None, source: str) -> None:
    places = {f"point.{name}.joints_rad": point.joints_rad for name, point in table.point.items()}
    for place, joints in {**places, "start_rad": start}.items():
        for axis, (joint, value) in enumerate(zip(robot.joints, joints or (), strict=False)):
            if not joint.position_min <= value <= joint.position_max:
                raise InputError(
                    f"{source}: {place}.{axis}: {value:g} rad is outside the range of {joint.name}"
                    f" ({joint.position_min:.3f} to {joint.position_max:.3f} rad)"
                )


def _check(table: ScenarioTable, robot: Robot, configuration: Configuration, source: str) -> None:
    """Checks that need more than one table."""

    def refuse(place: str, message: str) -> None:
        raise InputError(f"{source}: {place}: {message}")

    for name, point in table.point.items():
        if point.joints_rad is not None and len(point.joints_rad) != robot.n:
            refuse(f"point.{name}.joints_rad", f"{len(point.joints_rad)} values for {robot.n} joints")
    if table.start_rad is not None and robot.name == table.robot and len(table.start_rad) != robot.n:
        refuse("start_rad", f"{len(table.start_rad)} values for {robot.n} joints")
    for at, fault in enumerate(table.fault):
        if fault.joint > robot.n:
            refuse(f"fault.{at}.joint", f"{robot.name} has {robot.n} joints, not {fault.joint}")
    for number, phase in enumerate(table.phase):
        place = f"phase.{number}"
        if configuration.settings.task[phase.task].index == "off":
            off = f"'{phase.task}' is off in {configuration.source} for {robot.name}"
            index = {"payload": "d_p", "contact": "d_e"}.get(phase.task, "r")
            if is_blind(index, robot.n):
                off += f": with {robot.n} joints {index} is zero for every force, so the guard would detect nothing"
            refuse(f"{place}.task", off)
        for step, one in enumerate(phase.do):
            if one.move is not None and one.move not in table.point:
                known = ", ".join(table.point) or "none"
                refuse(f"{place}.do.{step}.move", f"there is no point '{one.move}' (there are {known})")
        steps = {f"strike.{index}": one.step for index, one in enumerate(phase.strike)}
        steps |= {f"guide.{index}": one.step for index, one in enumerate(phase.guide)}
        for visitor, at in steps.items():
            if at > len(phase.do):
                refuse(f"{place}.{visitor}.step", f"the phase has {len(phase.do)} steps, not {at}")
        for nth, strike in enumerate(phase.strike):
            if strike.link > robot.n:
                refuse(f"{place}.strike.{nth}.link", f"{robot.name} has {robot.n} links, not {strike.link}")
