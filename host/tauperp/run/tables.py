"""The tables of a scenario file: every key with its type, bounds, default and meaning.

tauperp.run.scenario reads them, and tauperp.run.describe writes docs/scenario.md from them.
"""

from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, model_validator

from tauperp.config import TaskName
from tauperp.sim.arm import Payload
from tauperp.sim.contact import Strike
from tauperp.sim.control import ImpedanceGains
from tauperp.sim.guiding import GuidingForce
from tauperp.sim.motion import Recovery
from tauperp.sim.sensors import SENSOR_PRESETS, FaultKind, SensorFault, SensorModel, SensorPreset
from tauperp.sim.trajectory import Limits
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
    """A table with documented keys."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class PayloadTable(Described):
    """The load of the gripper during a phase: grasped at its start, released at the start of the next phase."""

    mass_kg: Positive = Field(le=50)
    """Mass, kg."""
    com_m: Vector3 = Payload.com_m
    """Centre of mass from the end-effector point, in the last link's axes, m."""
    radius_m: Positive = Payload.radius_m
    """Radius of a solid ball with the same inertia, m."""


class StrikeTable(Described):
    """A collision: a body part that starts 12 cm away, touches the link and pushes."""

    step: int = Field(default=1, ge=1)
    """Step of `do` during which the hand strikes, from 1."""
    after_s: NotNegative = 0.0
    """Time from the start of the step until the hand starts, s."""
    link: int = Field(ge=1)
    """Link that is struck, from 1."""
    along: Share = Strike.along
    """Where on the link: 0 is the lower end of its axis, 1 the upper."""
    direction: Direction
    """Direction of the hand's motion; its length has no effect."""
    frame: Literal["base", "link"] = Strike.frame
    """Of `direction`: the robot's base, or the link's own axes."""
    part: Literal["hand", "forearm"] = Strike.part
    """Part of the body by ISO/TS 15066: hand 0.6 kg and 75 N/mm, forearm 2 kg and 40 N/mm."""
    speed_m_s: Positive = Field(default=Strike.speed_m_s, le=2)
    """Speed of the hand before the contact, m/s."""
    push_n: Positive = Field(default=Strike.push_n, le=1000)
    """Peak of the push after the touch, half a sine wave, N. The impact may exceed it."""
    duration_s: Positive = Field(default=Strike.duration_s, le=10)
    """Duration of the push, s."""


class GuideTable(Described):
    """An intended force on the end-effector, such as a guiding hand."""

    step: int = Field(default=1, ge=1)
    """Step of `do` during which the force acts, from 1."""
    after_s: NotNegative = GuidingForce.start_s
    """Time from the start of the step until the force starts, s."""
    force_n: Vector3
    """Force at the end-effector point, base frame, N."""
    moment_nm: Vector3 = GuidingForce.moment_nm
    """Moment at the same point, base frame, Nm."""
    rise_s: Positive = GuidingForce.rise_s
    """It rises and falls in this time, s."""
    hold_s: NotNegative = GuidingForce.hold_s
    """It stays for this time, s."""


class StepTable(Described):
    """One step: a move to a point, standing still, or yielding to a person's hand in impedance control."""

    move: str | None = None
    """Name of a point: straight to its `offset_m`, or to its `joints_rad` joint by joint."""
    wait_s: Positive | None = None
    """Stand still in position control, s."""
    yield_s: Positive | None = None
    """Hold the pose in impedance control, so that a hand can push the arm out of it, s."""

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
    """Load of the gripper; none by default."""
    do: list[StepTable] = Field(min_length=1)
    """Steps, one after the other, each with one of `move`, `wait_s` and `yield_s`."""
    strike: list[StrikeTable] = []
    """Collisions during the phase."""
    guide: list[GuideTable] = []
    """Intended forces during the phase."""


class PointTable(Described):
    """A point: the end-effector relative to its start, with the same orientation, or all joints."""

    offset_m: Vector3 | None = None
    """Position of the end-effector relative to its start, base frame, m. The orientation stays."""
    joints_rad: list[float] | None = None
    """Or all joints, rad."""

    @model_validator(mode="after")
    def _one_way(self) -> "PointTable":
        if (self.offset_m is None) == (self.joints_rad is None):
            raise ValueError("must have either offset_m or joints_rad")
        return self


class SensorTable(Described):
    """Errors of the joint sensors, drawn once per run from the seed."""

    preset: SensorPreset = "ideal"
    """Sensors with the values of the keys that this table lacks."""
    torque_noise_nm: NotNegative = SensorModel.torque_noise_nm
    """Standard deviation, Nm."""
    torque_offset_nm: NotNegative = SensorModel.torque_offset_nm
    """Largest offset, Nm."""
    torque_gain_error: NotNegative = Field(default=SensorModel.torque_gain_error, lt=1)
    """Largest relative error of the gain."""
    torque_ripple_nm: NotNegative = SensorModel.torque_ripple_nm
    """Largest ripple over the joint's angle, Nm."""
    ripple_per_turn: int = Field(default=SensorModel.ripple_per_turn, ge=1)
    """Periods of the ripple per turn."""
    position_noise_rad: NotNegative = SensorModel.position_noise_rad
    """Standard deviation, rad."""
    velocity_noise_rad_s: NotNegative = SensorModel.velocity_noise_rad_s
    """Standard deviation, rad/s."""
    torque_quantum_nm: NotNegative = SensorModel.torque_quantum_nm
    """Step of the torque reading, Nm; 0: that of the wire."""
    velocity_quantum_rad_s: NotNegative = SensorModel.velocity_quantum_rad_s
    """Step of the velocity reading, rad/s; 0: that of the wire."""
    torque_friction_nm: NotNegative = SensorModel.torque_friction_nm
    """Largest Coulomb friction between sensor and link, Nm."""
    delay_cycles: int = Field(default=SensorModel.delay_cycles, ge=0, le=100)
    """Age of a reading when it is sent, cycles."""

    @property
    def model(self) -> SensorModel:
        """The preset with this table's keys."""
        return replace(SENSOR_PRESETS[self.preset], **self.model_dump(include=self.model_fields_set - {"preset"}))


class FaultTable(Described):
    """A fault of a sensor or of its frames."""

    joint: int = Field(ge=1)
    """Joint, from 1."""
    kind: FaultKind
    """offset: `value` Nm added; gain: torque times `value`; stuck: the torque reading stays; status: SensorStatus
    is `value`; silent: no frames; crc: frames with a broken CRC.
    """
    start_s: NotNegative
    """Start of the fault, s of the run."""
    end_s: Positive = SensorFault.end_s
    """Until when, s."""
    value: float = SensorFault.value
    """Value for `kind`."""


class PlantTable(Described):
    """Differences between the simulated arm and its description."""

    model_error: NotNegative = Field(default=0.0, le=0.5)
    """Largest error of each link's mass and inertia, as a share."""
    substeps: int = Field(default=2, ge=1, le=100)
    """Steps of the physics in one cycle."""
    rotor_inertia_kg_m2: list[NotNegative] = []
    """Rotor inertia at the joint, one value per joint. Values that the robot's file lacks, too, are estimated."""
    rotor_kg_m2: list[NotNegative] = []
    """Or the inertia of the rotors themselves, one value per joint, with `gear_ratio`."""
    gear_ratio: list[Positive] = []
    """Gear ratio, one value per joint."""

    @model_validator(mode="after")
    def _one_rotor(self) -> "PlantTable":
        if bool(self.rotor_kg_m2) != bool(self.gear_ratio) or len(self.rotor_kg_m2) != len(self.gear_ratio):
            raise ValueError("rotor_kg_m2 and gear_ratio belong together, with one value per joint")
        if self.rotor_kg_m2 and self.rotor_inertia_kg_m2:
            raise ValueError("must have either rotor_inertia_kg_m2 or rotor_kg_m2 with gear_ratio")
        return self

    @property
    def reflected_kg_m2(self) -> list[float] | None:
        """Rotor inertia seen at each joint; None if it is not given."""
        own = [rotor * gear**2 for rotor, gear in zip(self.rotor_kg_m2, self.gear_ratio, strict=True)]
        return self.rotor_inertia_kg_m2 or own or None


class LimitTable(Described):
    """Speeds and accelerations of moves."""

    speed_m_s: Positive = Limits.speed_m_s
    """Speed of the end-effector, m/s."""
    acceleration_m_s2: Positive = Limits.acceleration_m_s2
    """Acceleration of the end-effector, m/s2."""
    turn_rad_s: Positive = Limits.turn_rad_s
    """Angular speed of the end-effector, rad/s."""
    joint_speed_rad_s: Positive = Limits.joint_speed_rad_s
    """Joint speed of a move joint by joint, rad/s."""
    joint_acceleration_rad_s2: Positive = Limits.joint_acceleration_rad_s2
    """Joint acceleration of a move joint by joint, rad/s2."""


class ImpedanceTable(Described):
    """Spring and damper that hold the end-effector while the arm yields."""

    stiffness_n_m: Positive = ImpedanceGains.stiffness_n_m
    """Stiffness of the position, N/m."""
    stiffness_nm_rad: Positive = ImpedanceGains.stiffness_nm_rad
    """Stiffness of the orientation, Nm/rad."""
    damping_ratio: Positive = ImpedanceGains.damping_ratio
    """1 is critical."""
    posture_nm_rad: NotNegative = ImpedanceGains.posture_nm_rad
    """Joint stiffness in the directions that the pose does not determine, Nm/rad."""


class RecoveryTable(Described):
    """How the robot stops and returns."""

    deceleration_rad_s2: Positive = Recovery.deceleration_rad_s2
    """Deceleration of the fastest joint in a stop of category 1 or 2, rad/s2."""
    pause_s: NotNegative = Recovery.pause_s
    """Standstill, in which the person removes the hand, s."""
    retreat_m: NotNegative = Recovery.retreat_m
    """Length of the retreat along the path after a collision, m."""


class ScenarioTable(Described):
    """A scenario: robot, guard, phases, contacts and sensor faults."""

    robot: str = Field(default="ku_dex", min_length=1)
    """A shipped name, or a URDF or MJCF file beside the scenario."""
    config: str = "default"
    """The guard's preset, or a TOML file beside the scenario."""
    seed: int = Field(default=1, ge=0)
    """Random seed of sensors and model errors."""
    time_limit_s: Positive = 120.0
    """Time limit of the run, s."""
    start_rad: list[float] | None = None
    """Joints at the start, rad; by default a posture far from singular ones."""
    guard: dict[str, Any] = {}
    """Single keys of the guard's configuration over `config`."""
    point: dict[str, PointTable] = {}
    """Places to move to, by name: `[point.NAME]`."""
    phase: list[PhaseTable] = Field(min_length=1)
    """Parts of the run, in order."""
    limits: LimitTable = LimitTable()
    """Speeds and accelerations of moves."""
    impedance: ImpedanceTable = ImpedanceTable()
    """Control while the arm yields."""
    recovery: RecoveryTable = RecoveryTable()
    """Stopping and returning."""
    sensors: SensorTable = SensorTable()
    """Errors of the joint sensors."""
    plant: PlantTable = PlantTable()
    """How the simulated arm differs from its description."""
    fault: list[FaultTable] = []
    """Faults of sensors and their frames."""
