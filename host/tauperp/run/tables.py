"""The tables of a scenario file: every key with its type, bounds, default and meaning.

tauperp.run.scenario reads them, and tauperp.run.describe writes docs/scenario.md from them.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, model_validator

from tauperp.config import TaskName
from tauperp.sim.sensors import FaultKind
from tauperp.toml import Table


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


class Described(Table):
    """A table whose keys say what they mean."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class PayloadTable(Described):
    """What the gripper holds during a phase: grasped where it begins, let go where the next one begins."""

    mass_kg: Positive = Field(le=50)
    """Mass, kg."""
    com_m: Vector3 = (0.0, 0.0, 0.0)
    """Centre of mass from the end-effector point, in the last link's axes, m."""
    radius_m: Positive = 0.04
    """Of the solid ball whose inertia it has, m."""


class StrikeTable(Described):
    """A collision: a part of a body that comes from 12 cm away, touches the link and pushes."""

    step: int = Field(default=1, ge=1)
    """During which step of `do` it comes, counted from 1."""
    after_s: NotNegative = 0.0
    """How long after the step has begun the hand sets off, s."""
    link: int = Field(ge=1)
    """Which link, from 1."""
    along: Share = 0.5
    """Where on the link: 0 is the lower end of its axis, 1 the upper."""
    direction: Direction
    """The way the hand moves; its length does not matter."""
    frame: Literal["base", "link"] = "base"
    """Of `direction`: the robot's base, or the link's own axes."""
    part: Literal["hand", "forearm"] = "hand"
    """Part of the body by ISO/TS 15066: hand 0.6 kg and 75 N/mm, forearm 2 kg and 40 N/mm."""
    speed_m_s: Positive = Field(default=0.3, le=2)
    """At which it comes, m/s."""
    push_n: Positive = Field(default=100.0, le=1000)
    """Peak of the push after the touch, half a sine wave, N. The impact may exceed it."""
    duration_s: Positive = Field(default=0.2, le=10)
    """Of the push, s."""


class GuideTable(Described):
    """An intended force on the end-effector, as of a hand that guides it."""

    step: int = Field(default=1, ge=1)
    """During which step of `do` it acts, counted from 1."""
    after_s: NotNegative = 0.0
    """How long after the step has begun it sets in, s."""
    force_n: Vector3
    """At the end-effector point, base frame, N."""
    moment_nm: Vector3 = (0.0, 0.0, 0.0)
    """Moment there, base frame, Nm."""
    rise_s: Positive = 0.5
    """It rises and falls in this time, s."""
    hold_s: NotNegative = 1.0
    """It stays for this time, s."""


class StepTable(Described):
    """One thing to do: a move to a point, standing still, or yielding to a person's hand in impedance control."""

    move: str | None = None
    """Name of a point: straight to its `offset_m`, or to its `joints_rad` joint by joint."""
    wait_s: Positive | None = None
    """Stand still in position control, s."""
    yield_s: Positive | None = None
    """Hold the pose in impedance control, for a hand to push it out of, s."""

    @model_validator(mode="after")
    def _one_thing(self) -> "StepTable":
        if sum(value is not None for value in (self.move, self.wait_s, self.yield_s)) != 1:
            raise ValueError("must have exactly one of move, wait_s and yield_s")
        return self


class PhaseTable(Described):
    """A part of the run with one task and one payload. Phases follow each other."""

    name: str = ""
    """For figures and tables."""
    task: TaskName
    """The task that the robot sends to the guard: none, payload or contact."""
    payload: PayloadTable | None = None
    """What the gripper holds; nothing by default."""
    do: list[StepTable] = Field(min_length=1)
    """Steps, one after the other, each with one of `move`, `wait_s` and `yield_s`."""
    strike: list[StrikeTable] = []
    """Collisions during the phase."""
    guide: list[GuideTable] = []
    """Intended forces during the phase."""


class PointTable(Described):
    """A place: of the end-effector relative to where it starts, its orientation kept, or all joints."""

    offset_m: Vector3 | None = None
    """End-effector from where it starts, base frame, m. Its orientation stays."""
    joints_rad: list[float] | None = None
    """Or all joints, rad."""

    @model_validator(mode="after")
    def _one_way(self) -> "PointTable":
        if (self.offset_m is None) == (self.joints_rad is None):
            raise ValueError("must have either offset_m or joints_rad")
        return self


class SensorTable(Described):
    """Errors of the joint sensors, drawn once a run from the seed."""

    torque_noise_nm: NotNegative = 0.0
    """Standard deviation, Nm."""
    torque_offset_nm: NotNegative = 0.0
    """Largest offset, Nm."""
    torque_gain_error: NotNegative = Field(default=0.0, lt=1)
    """Largest error of gain, as a share."""
    torque_ripple_nm: NotNegative = 0.0
    """Largest ripple over the joint's angle, Nm."""
    ripple_per_turn: int = Field(default=2, ge=1)
    """Waves of the ripple a turn."""
    position_noise_rad: NotNegative = 0.0
    """Standard deviation, rad."""
    velocity_noise_rad_s: NotNegative = 0.0
    """Standard deviation, rad/s."""
    delay_cycles: int = Field(default=0, ge=0, le=100)
    """Age of a reading when it is sent, cycles."""


class FaultTable(Described):
    """Something that goes wrong with a sensor or its frames."""

    joint: int = Field(ge=1)
    """Which joint, from 1."""
    kind: FaultKind
    """offset: `value` Nm added; gain: torque times `value`; stuck: the torque reading stays; status: SensorStatus
    is `value`; silent: no frames; crc: frames with a broken CRC.
    """
    start_s: NotNegative
    """From when on, s of the run."""
    end_s: Positive = 1e9
    """Until when, s."""
    value: float = 0.0
    """As `kind` says."""


class PlantTable(Described):
    """How the simulated arm differs from what everybody believes it to be."""

    model_error: NotNegative = Field(default=0.0, le=0.5)
    """Largest error of each link's mass and inertia, as a share."""
    substeps: int = Field(default=2, ge=1, le=100)
    """Steps of the physics in one cycle."""
    rotor_inertia_kg_m2: list[NotNegative] = []
    """One a joint, seen at the joint. What is neither given nor in the robot's file is estimated."""
    rotor_kg_m2: list[NotNegative] = []
    """Or the rotors' own inertia, one a joint, with `gear_ratio`."""
    gear_ratio: list[Positive] = []
    """One a joint."""

    @model_validator(mode="after")
    def _one_rotor(self) -> "PlantTable":
        if bool(self.rotor_kg_m2) != bool(self.gear_ratio) or len(self.rotor_kg_m2) != len(self.gear_ratio):
            raise ValueError("rotor_kg_m2 and gear_ratio belong together, one value a joint each")
        if self.rotor_kg_m2 and self.rotor_inertia_kg_m2:
            raise ValueError("must have either rotor_inertia_kg_m2 or rotor_kg_m2 with gear_ratio")
        return self

    @property
    def reflected_kg_m2(self) -> list[float] | None:
        """Rotor inertia seen at each joint; None if it is not given."""
        own = [rotor * gear**2 for rotor, gear in zip(self.rotor_kg_m2, self.gear_ratio, strict=True)]
        return self.rotor_inertia_kg_m2 or own or None


class LimitTable(Described):
    """Of moves."""

    speed_m_s: Positive = 0.5
    """Of the end-effector, m/s."""
    acceleration_m_s2: Positive = 2.0
    """Of the end-effector, m/s2."""
    turn_rad_s: Positive = 1.0
    """Of its orientation, rad/s."""
    joint_speed_rad_s: Positive = 0.8
    """Of a move joint by joint, rad/s."""
    joint_acceleration_rad_s2: Positive = 3.0
    """Of a move joint by joint, rad/s2."""


class ImpedanceTable(Described):
    """The spring and damper that hold the end-effector while it yields."""

    stiffness_n_m: Positive = 500.0
    """Of the position, N/m."""
    stiffness_nm_rad: Positive = 50.0
    """Of the orientation, Nm/rad."""
    damping_ratio: Positive = 1.0
    """1 is critical."""
    posture_nm_rad: NotNegative = 20.0
    """Spring of the joints in what the pose leaves free, Nm/rad."""


class RecoveryTable(Described):
    """How the robot stops and comes back."""

    deceleration_rad_s2: Positive = 6.0
    """Of the fastest joint in a stop of category 1 or 2, rad/s2."""
    pause_s: NotNegative = 0.4
    """Standing, for the person to take the hand away, s."""
    retreat_m: NotNegative = 0.05
    """Back along the way it came after a collision, m."""


class ScenarioTable(Described):
    """A scenario: robot, guard, what it is to do, who touches it, which sensors fail."""

    robot: str = Field(default="ku_dex", min_length=1)
    """A shipped name, or a URDF or MJCF file beside the scenario."""
    config: str = "default"
    """The guard's preset, or a TOML file beside the scenario."""
    seed: int = Field(default=1, ge=0)
    """Of sensors and model errors."""
    time_limit_s: Positive = 120.0
    """The run ends then, s."""
    start_rad: list[float] | None = None
    """Joints at the start, rad; by default a posture far from singular ones."""
    guard: dict[str, Any] = {}
    """Single keys of the guard's configuration over `config`."""
    point: dict[str, PointTable] = {}
    """Places to move to, by name: `[point.NAME]`."""
    phase: list[PhaseTable] = Field(min_length=1)
    """What happens, part by part."""
    limits: LimitTable = LimitTable()
    """Speeds and accelerations of moves."""
    impedance: ImpedanceTable = ImpedanceTable()
    """Control while it yields."""
    recovery: RecoveryTable = RecoveryTable()
    """Stopping and coming back."""
    sensors: SensorTable = SensorTable()
    """Errors of the joint sensors."""
    plant: PlantTable = PlantTable()
    """How the simulated arm differs from its description."""
    fault: list[FaultTable] = []
    """Faults of sensors and their frames."""
