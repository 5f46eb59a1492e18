"""The tables of a scenario file: every key with its type, bounds and default. tauperp.scenario reads them."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

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
    rotor_inertia_kg_m2: list[NotNegative] = []  # one a joint, seen at the joint: the rotor's times gear ratio squared
    rotor_kg_m2: list[NotNegative] = []  # or the rotors' own, one a joint, with
    gear_ratio: list[Positive] = []  # one a joint

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
