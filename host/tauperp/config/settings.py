"""The TOML file of one installation: its tables, keys and units, and the range of each single number.

`tauperp.config.configuration` checks what depends on the robot or on several numbers together.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from tauperp.config.block import MAX_CHANNELS, MAX_GAP, MAX_JOINTS
from tauperp.config.indexes import Component, IndexName
from tauperp.toml import Table

TaskName = Literal["none", "payload", "contact"]
SensorPreset = Literal["harsh", "panda"]  # of tauperp.sim.sensors; their thresholds are in presets/sensors
StopCategory = Literal[0, 1, 2]
EarlyStop = Literal[0, 1]  # holding under power is for a collision only

MAX_INPUT_CYCLES = 15  # the E2E counter of Sync and TaskCommand cannot distinguish more

TASKS: dict[TaskName, int] = {"none": 1, "payload": 2, "contact": 3}  # numbers as on the wire
MAX_MORE = 3  # the installation's own tasks, with the numbers 4, 5 and 6


def _one_or_many(value: Any) -> Any:
    """A single number applies to every joint."""
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def _numbers(value: list[Any]) -> list[Any]:
    """Numbers, or lists of numbers: thresholds of one channel, or of each."""
    for entry in value:
        for number in entry if isinstance(entry, list) else [entry]:
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise ValueError(f"{number!r} is not a number")
    return value


def _name_or_table(value: Any) -> Any:
    """`robot = "panda"` is short for `[robot] model = "panda"`."""
    return {"model": value} if isinstance(value, str) else value


class RobotChoice(Table):
    """The arm: a shipped name, or the path of a URDF or MJCF file relative to this file."""

    model: str = Field(min_length=1)
    base: str | None = None  # first body of the chain, where the file holds more than one arm
    tip: str | None = None  # last body of the chain
    tool: list[float] | None = Field(default=None, min_length=3, max_length=3)  # end-effector point in it, m
    accept_inertia: bool = False  # inertias that no body has become the nearest possible ones


class Wire(Table):
    rate_hz: float = Field(ge=20, le=4000)  # cycles a second
    format: Literal["classic", "fd"]


class Observer(Table):
    gain_per_s: float = Field(ge=10, le=500)
    torque_sample: Literal["interval", "instant"]  # joints report the mean since the last Sync, or the value at it


class Channel(Table):
    """One linear filter of the bank: a low-pass, followed by an optional high-pass."""

    low_pass_per_s: float = Field(gt=0, le=500)  # corner, rad/s
    order: Literal[1, 2] = 1
    damping: float = Field(default=0.7, gt=0.3, lt=1)  # of order 2
    high_pass_hz: float = Field(default=0.0, ge=0, le=10)  # 0: none
    of: Literal["unexplained", "sudden"] = "unexplained"  # sudden: what only a task's fast components leave


class Bank(Table):
    """The filters of the unexplained torque. Empty: one first-order low-pass with the observer's gain."""

    channel: list[Channel] = Field(default=[], max_length=MAX_CHANNELS)


class Subspace(Table):
    order: Literal["project_first", "filter_first"]  # of projection and filter; filter_first is the paper's
    projector: Literal["hard", "soft"]  # soft: continuous at singularities, with the tolerance as its s
    tolerance_nm_per_n: float = Field(gt=0, le=0.1)
    lever_m: float = Field(gt=0, le=1)
    softness_nm_per_n: float = Field(gt=0, le=0.2)  # softness of the estimate for the limits


class Acceleration(Table):
    """When the payload task may explain the commanded acceleration."""

    force_floor_n: float = Field(gt=0, le=20)  # below: mass_max_kg times the acceleration cannot matter
    error_max_m_s2: float = Field(gt=0, le=10)  # between commanded and measured; beyond, the commanded one is not used


class Regressor(Table):
    """The low-pass in front of the payload's regressor (d_r), of second order."""

    low_pass_per_s: float = Field(default=400.0, gt=0, le=500)
    damping: float = Field(default=0.7, gt=0.3, lt=1)


class Limits(Table):
    """Limits of what the task explains. Beyond them is a stop with its own reason."""

    mass_max_kg: float = Field(gt=0, le=50)  # payload
    arm_max_m: float = Field(ge=0, le=1)  # payload: distance of its centre of mass from the tip
    force_slack_n: float = Field(gt=0, le=60)  # payload: for model error and noise
    moment_slack_nm: float = Field(gt=0, le=20)
    force_max_n: float = Field(gt=0, le=400)  # contact
    moment_max_nm: float = Field(gt=0, le=100)
    residual_max_nm: Annotated[list[Annotated[float, Field(gt=0)]], BeforeValidator(_one_or_many)] = Field(
        default=[], max_length=MAX_JOINTS
    )  # |r| of a joint; empty: the joint's torque limit


class Sensor(Table):
    """Offset and friction of the joints' torque sensors (`tauperp calibrate`), Nm."""

    preset: SensorPreset | None = None  # its thresholds (presets/sensors) apply unless a file contains its own

    offset_nm: Annotated[list[Annotated[float, Field(ge=-64, le=64)]], BeforeValidator(_one_or_many)] = Field(
        default=[0.0], min_length=1, max_length=MAX_JOINTS
    )  # one for all joints, or one per joint
    friction_nm: Annotated[list[Annotated[float, Field(ge=0, le=64)]], BeforeValidator(_one_or_many)] = Field(
        default=[0.0], min_length=1, max_length=MAX_JOINTS
    )  # Coulomb friction between sensor and link


class Sight(Table):
    """Which links count as seen, and the reaction to a blind one (firmware/core/sight.h)."""

    force_n: float = Field(default=500.0, gt=0, le=500)  # along one axis: a link is seen if it reaches a threshold
    reaction: Literal["report", "slow", "withdraw"] = (
        "report"  # while the task in force does not detect a force on a link that it must protect
    )


class Task(Table):
    """Index and thresholds of one task."""

    index: IndexName
    threshold_nm: Annotated[list[Any], BeforeValidator(_one_or_many), AfterValidator(_numbers)] = Field(
        default=[], max_length=MAX_JOINTS
    )  # one for all joints, or one per joint; or a list of these for each channel
    debounce_ticks: int = Field(ge=1, le=1000)
    components: list[Component] = Field(default=[], max_length=6)  # d_f: what the contact can transmit
    fast: list[Component] = Field(default=[], max_length=6)  # those of them that may change fast
    frame: Literal["base", "tool"] = "base"  # of the components' axes
    point_m: Annotated[list[Annotated[float, Field(ge=-1, le=1)]], Field(min_length=3, max_length=3)] = [0.0, 0.0, 0.0]
    needed_links: list[Annotated[int, Field(ge=1, le=MAX_JOINTS)]] = []  # links on which it must detect a force, from 1
    limits: Limits


class OwnTask(Task):
    """A task beyond the three usual ones."""

    name: str = Field(pattern="^[a-z][a-z0-9_]{0,15}$")


class Tasks(Table):
    none: Task
    payload: Task
    contact: Task
    more: list[OwnTask] = Field(default=[], max_length=MAX_MORE)  # the wire's tasks 4, 5 and 6

    @property
    def numbers(self) -> dict[str, int]:
        """All tasks of the file, with their numbers on the wire."""
        numbers: dict[str, int] = dict(TASKS.items())
        return numbers | {task.name: len(TASKS) + 1 + place for place, task in enumerate(self.more)}

    def __getitem__(self, name: str) -> Task:
        rows: dict[str, Task] = {"none": self.none, "payload": self.payload, "contact": self.contact}
        return {**rows, **{task.name: task for task in self.more}}[name]


class Deadline(Table):
    """Ages at which an input is too old, in cycles. Unset: the DBC's TimeoutCycles."""

    sync_cycles: int | None = Field(default=None, ge=1, le=MAX_INPUT_CYCLES)
    joint_cycles: int | None = Field(default=None, ge=1, le=MAX_GAP)
    task_cycles: int | None = Field(default=None, ge=1, le=MAX_INPUT_CYCLES)
    tick_cycles: int = Field(ge=1, le=8)
    tick_budget_us: int | None = Field(default=None, ge=1)  # unset: half a period


class Reset(Table):
    healthy_ms: float | None = Field(default=None, gt=0, le=60_000)  # unset: 5 / observer.gain_per_s


class Stop(Table):
    """Stop categories of IEC 60204-1: 0 power off, 1 controlled then power off, 2 controlled and held."""

    collision: StopCategory
    input: EarlyStop
    fault: EarlyStop


class Settings(Table):
    """One installation, complete: the file's own keys over those of its preset."""

    robot: Annotated[RobotChoice | None, BeforeValidator(_name_or_table)] = None
    preset: str = "default"
    wire: Wire
    observer: Observer
    bank: Bank = Bank()
    subspace: Subspace
    sensor: Sensor = Sensor()
    sight: Sight = Sight()
    acceleration: Acceleration
    regressor: Regressor = Regressor()
    task: Tasks
    deadline: Deadline
    reset: Reset = Reset()
    stop: Stop
