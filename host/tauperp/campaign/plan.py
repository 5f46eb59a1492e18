"""The plan of a campaign: one TOML file, every value checked before anything runs.

    robot = "ku_dex"                # shipped name, or a URDF or MJCF file beside the plan
    configuration = "default"       # the guard's preset or TOML file
    collisions = 10000              # of each task
    free_moves = 2000               # of each task without a collision; half of them calibrate
    tasks = ["none", "payload", "contact"]
    [thresholds]
    from = "free_moves"             # or "configuration"
    false_moves = 0.01              # wanted share of moves with a false stop

Ranges are [lowest, highest], drawn evenly. A missing table has the values below. With [recording] the pushes
go into recordings of a real arm instead of a simulation.
"""

import dataclasses
import hashlib
import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from tauperp.config import TASKS, Configuration, TaskName, load_configuration, preset_names
from tauperp.errors import InputError
from tauperp.sim.contact import BODY_PARTS
from tauperp.sim.rotor import with_rotors
from tauperp.sim.sensors import SENSOR_PRESETS, SensorModel
from tauperp.toml import Table, read_toml, validate

MOST_RUNS = 10_000_000
MOST_DELAY = 7  # cycles that the kernel's sensors remember


def _pair(value: Any) -> Any:
    """A single number means a range without width. TOML's lists become the models' tuples."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value, value)
    return tuple(value) if isinstance(value, list) else value


def _ascending(value: tuple[float, float]) -> tuple[float, float]:
    if value[1] < value[0]:
        raise ValueError("the second number must not be below the first")
    return value


def _at_least(low: float) -> AfterValidator:
    def check(value: tuple[float, float]) -> tuple[float, float]:
        if value[0] < low:
            raise ValueError(f"must not be below {low:g}, not {value[0]:g}")
        return value

    return AfterValidator(check)


def _above_zero(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] <= 0:
        raise ValueError(f"must be above 0, not {value[0]:g}")
    return value


Range = Annotated[tuple[float, float], BeforeValidator(_pair), AfterValidator(_ascending)]
PositiveRange = Annotated[Range, AfterValidator(_above_zero)]
NotNegativeRange = Annotated[Range, _at_least(0.0)]
LinkRange = Annotated[tuple[int, int], BeforeValidator(_pair), AfterValidator(_ascending)]
Share = Annotated[float, Field(ge=0, le=1)]


class Thresholds(Table):
    """Source of the guard's thresholds. The other detectors are always calibrated on the free moves."""

    source: Literal["free_moves", "configuration"] = Field(default="free_moves", alias="from")
    false_moves: float = Field(default=0.01, gt=0, le=0.5)


class Motion(Table):
    """`move`: there and back between two postures, at rest at both ends. `wave`: sums of sines with many reversals."""

    kinds: list[Literal["move", "wave", "rest"]] = Field(default=["move", "wave"], min_length=1)
    speed: PositiveRange = (0.15, 0.6)  # peak of the fastest joint, as a share of its limit
    spread_rad: PositiveRange = (0.2, 1.0)  # of the postures about the arm's home
    duration_s: float = Field(default=1.5, ge=0.5, le=60)


class Collision(Table):
    """`pulse`: a half-sine force at a point of the link. `contact`: a part of a body on soft tissue strikes it.

    `touch`: a force that rises slowly, and `clamp`: one that rises fast; both stay.
    """

    kinds: list[Literal["pulse", "contact", "touch", "clamp"]] = Field(default=["pulse", "contact"], min_length=1)
    links: LinkRange | None = None  # from 1; unset: from 2 to the last
    force_n: PositiveRange = (20.0, 100.0)
    push_ms: PositiveRange = (50.0, 300.0)
    touch_ms: PositiveRange = (400.0, 1000.0)  # in which the force of a touch rises
    parts: list[str] = Field(default=["hand", "forearm"], min_length=1)
    speed_m_s: PositiveRange = (0.1, 0.5)

    @model_validator(mode="after")
    def _known_parts(self) -> "Collision":
        for part in self.parts:
            if part not in BODY_PARTS:
                raise ValueError(f"parts: {part!r} is unknown (there are {', '.join(BODY_PARTS)})")
        return self


class Payload(Table):
    """The load of the arm in task `payload`: a ball, or a rod across the flange. The guard does not know it."""

    mass_kg: NotNegativeRange = (0.0, 3.0)
    com_m: NotNegativeRange = (0.0, 0.1)  # distance of its centre from the end-effector point
    rod_m: NotNegativeRange = (0.0, 1.0)  # length of the rod
    rods: Share = 0.3  # of the payloads


class Guide(Table):
    """The intended wrench at the end-effector in task `contact`."""

    force_n: NotNegativeRange = (0.0, 60.0)
    moment_nm: NotNegativeRange = (0.0, 6.0)
    rise_s: PositiveRange = (0.15, 0.4)


class Baselines(Table):
    """The detectors that are compared in the same runs, on the same signals."""

    paper: bool = True  # preset `paper` at its own thresholds
    gains_per_s: list[Annotated[float, Field(gt=0, le=500)]] = [25.0]  # the paper's index at other observer gains
    residual: bool = True  # one threshold a joint on r
    bands_hz: list[PositiveRange] = [(1.0, 10.0), (3.0, 30.0)]  # on r


class RecordingTable(Table):
    """Pushes through the transposed Jacobian into recordings of free motion."""

    files: list[str] = Field(min_length=1)
    map: str | None = None
    calibrate: float = Field(default=0.5, ge=0.1, le=0.9)  # share at the beginning of each; the rest is judged
    alarms_per_hour: float = Field(default=1.0, gt=0, le=3600)


class PlanFile(Table):
    robot: str | None = None
    configuration: str = "default"
    rate_hz: float | None = Field(default=None, ge=20, le=4000)
    format: Literal["classic", "fd"] | None = None
    numeric: Literal["float32", "q9.22"] = "float32"
    substeps: int = Field(default=1, ge=1, le=20)  # of physics in one cycle
    shard_runs: int = Field(default=1000, ge=1, le=100_000)  # runs in one file, and in one task of a cluster
    seed: int = Field(default=1, ge=0, lt=2**63)
    collisions: int = Field(ge=1, le=MOST_RUNS)
    free_moves: int = Field(default=0, ge=0, le=MOST_RUNS)
    tasks: list[TaskName] = Field(default=list(TASKS), min_length=1)
    model_error: float = Field(default=0.02, ge=0, lt=0.5)  # of each link's mass and inertia
    sensors: dict[str, float | int] | str = "harsh"  # a preset of tauperp.sim.sensors, or a table of its errors
    thresholds: Thresholds = Thresholds()
    motion: Motion = Motion()
    collision: Collision = Collision()
    payload: Payload = Payload()
    guide: Guide = Guide()
    baselines: Baselines = Baselines()
    recording: RecordingTable | None = None


class Plan:
    """A checked plan with its configuration. `digest` identifies everything that determines the results."""

    def __init__(self, file: PlanFile, configuration: Configuration, path: Path) -> None:
        self.file = file
        self.path = path
        robot, note = with_rotors(configuration.robot)
        self.configuration = configuration if note is None else dataclasses.replace(configuration, robot=robot)
        self.assumed = () if note is None else (note,)  # of the simulated arm
        self.sensors = _sensor_model(file.sensors, path)
        self.links = file.collision.links or (min(2, configuration.robot.n), configuration.robot.n)
        n = configuration.robot.n
        if not 1 <= self.links[0] <= self.links[1] <= n:
            raise InputError(f"{path}: collision.links: {configuration.robot.name} has links 1 to {n}")
        for task in file.tasks:
            if configuration.settings.task[task].index == "off":
                raise InputError(f"{path}: tasks: {task!r} is off for {configuration.robot.name}")
        if len(set(file.tasks)) != len(file.tasks):
            raise InputError(f"{path}: tasks: one is named twice")
        if file.thresholds.source == "free_moves" and file.free_moves < 20 and file.recording is None:
            raise InputError(f"{path}: free_moves: at least 20 are needed to calibrate on, not {file.free_moves}")
        if file.recording is None:
            longest = file.collision.push_ms[1] * 1e-3 + 0.9
            if file.motion.duration_s < longest:
                raise InputError(f"{path}: motion.duration_s: a push of this length needs {longest:g} s")

    def on(self, configuration: Configuration) -> "Plan":
        """The same plan with another configuration."""
        return Plan(self.file, configuration, self.path)

    @property
    def digest(self) -> str:
        text = json.dumps(self.file.model_dump(by_alias=True), sort_keys=True)
        crc = self.configuration.crc(self.file.numeric)
        return hashlib.sha256(f"{text} {crc:08x} {self.sensors}".encode()).hexdigest()[:16]


def read_plan(path: str | Path) -> Plan:
    """Raises InputError: one line with the file and the key."""
    path = Path(path)
    file = validate(PlanFile, read_toml(path), path)
    wire: dict[str, Any] = {}
    if file.rate_hz is not None:
        wire["rate_hz"] = file.rate_hz
    if file.format is not None:
        wire["format"] = file.format
    configuration = load_configuration(
        _beside(path, file.configuration, preset_names()),
        robot=None if file.robot is None else _beside(path, file.robot, ()),
        overrides={"wire": wire} if wire else None,
    )
    return Plan(file, configuration, path)


def _beside(path: Path, name: str, known: Any) -> str:
    """A file named in the plan is relative to the plan; a shipped name stays a name."""
    beside = path.parent / name
    return str(beside) if name not in known and beside.is_file() else name


def _sensor_model(given: dict[str, float | int] | str, path: Path) -> SensorModel:
    """A preset by its name, or a table of errors over ideal sensors."""
    if isinstance(given, str):
        found = next((model for name, model in SENSOR_PRESETS.items() if name == given), None)
        if found is None:
            raise InputError(f"{path}: sensors: {given!r} is unknown (there are {', '.join(SENSOR_PRESETS)})")
        return found
    for name, value in given.items():
        if name not in SensorModel.__dataclass_fields__:
            raise InputError(f"{path}: sensors.{name}: unknown key")
        if not 0 <= value < 1000:
            raise InputError(f"{path}: sensors.{name}: {value:g} is not in 0 to 1000")
    model = SensorModel(**given)  # type: ignore[arg-type]
    if model.delay_cycles > MOST_DELAY:
        raise InputError(f"{path}: sensors.delay_cycles: at most {MOST_DELAY}, not {model.delay_cycles}")
    return model
