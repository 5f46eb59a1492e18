"""One installation: its settings together with its robot and its wire, checked against each other."""

import dataclasses
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from tauperp.busload import worst_case_load
from tauperp.config.block import MAX_JOINTS, Numeric, block_crc, block_dtype, observer_constants, pack
from tauperp.config.settings import TASKS, Settings, TaskName
from tauperp.errors import InputError
from tauperp.toml import validate
from tauperp.wire import Wire

if TYPE_CHECKING:
    from tauperp.robot import Robot

_INDEXES = {"off": 0, "r": 1, "d_p": 2, "d_e": 3}
_BASES = {"instantaneous": 1, "filtered": 2}
_TORQUE_SAMPLES = {"interval": 1, "instant": 2}
_FORMATS = {"classic": 1, "fd": 2}

LOAD_LIMIT = 0.9  # of the bus at worst; above, a burst of errors has no room left to be repeated in

# Dimensions that the task explains (columns of eqs. 7 and 20): an arm needs more joints for anything to be left over.
_EXPLAINED = {"off": 0, "r": 0, "d_p": 5, "d_e": 6}


def is_blind(index: str, joints: int) -> bool:
    """True if the task explains every direction that an arm of so many joints has."""
    return index not in ("off", "r") and joints <= _EXPLAINED[index]


@dataclasses.dataclass(frozen=True)
class Configuration:
    """What the guard is built on. Made by `load_configuration`; `source` names it in messages.

    Construction raises InputError, with the key's place, for settings that do not fit each other or the robot.
    """

    settings: Settings
    robot: "Robot"
    wire: Wire
    source: str

    def __post_init__(self) -> None:
        settings, n = self.settings, self.robot.n
        if n > MAX_JOINTS:
            self._refuse("robot", f"{self.robot.name} has {n} joints, the firmware holds {MAX_JOINTS}")
        if settings.observer.gain_per_s * self.period_us * 1e-6 >= 1:
            self._refuse("observer.gain_per_s", f"gain times period must be below 1 at {settings.wire.rate_hz:g} Hz")
        load = worst_case_load(self.wire, joints=n, rate_hz=settings.wire.rate_hz, fd=settings.wire.format == "fd")
        if load > LOAD_LIMIT:
            self._refuse("wire.rate_hz", f"{n} joints would fill the {settings.wire.format} bus to {load:.0%}")
        if self.tick_budget_us > self.period_us:
            self._refuse("deadline.tick_budget_us", f"longer than the period of {self.period_us} us")
        if settings.reset.healthy_ms * 1000 < self.period_us:
            self._refuse("reset.healthy_ms", f"shorter than the period of {self.period_us} us")
        for key, values in (("offset_nm", settings.sensor.offset_nm), ("friction_nm", settings.sensor.friction_nm)):
            if len(values) not in (1, n):
                self._refuse(f"sensor.{key}", f"{len(values)} values for the {n} joints of {self.robot.name}")
        for name in TASKS:
            self._check_task(name)

    def _check_task(self, name: TaskName) -> None:
        task, n = self.settings.task[name], self.robot.n
        place = f"task.{name}.threshold_nm"
        if is_blind(task.index, n):
            self._refuse(
                f"task.{name}.index",
                f"{task.index} explains {_EXPLAINED[task.index]} directions, "
                f"so with the {n} joints of {self.robot.name} it would see nothing; use 'r' or 'off'",
            )
        if task.index == "off":
            return
        if len(task.threshold_nm) not in (1, n):
            self._refuse(place, f"{len(task.threshold_nm)} values for the {n} joints of {self.robot.name}")
        for joint, threshold in zip(self.robot.joints, self.threshold_nm(name), strict=True):
            if threshold >= joint.torque_max:
                limit = f"the torque limit of {joint.torque_max:g} Nm of joint {joint.name}"
                self._refuse(place, f"{threshold:g} Nm is not below {limit}")

    def _refuse(self, place: str, message: str) -> None:
        raise InputError(f"{self.source}: {place}: {message}")

    @property
    def period_us(self) -> int:
        """One cycle, in whole microseconds."""
        return round(1e6 / self.settings.wire.rate_hz)

    @property
    def tick_budget_us(self) -> int:
        budget = self.settings.deadline.tick_budget_us
        return self.period_us // 2 if budget is None else budget

    def threshold_nm(self, task: TaskName) -> npt.NDArray[np.float64]:
        """Thresholds of a task, (n,) Nm; zeros where its index is off."""
        settings = self.settings.task[task]
        if settings.index == "off":
            return np.zeros(self.robot.n)
        return self._by_joint(settings.threshold_nm)

    def _by_joint(self, values: list[float]) -> npt.NDArray[np.float64]:
        return np.broadcast_to(np.array(values, float), self.robot.n).copy()

    def timeout_cycles(self, kind: Literal["sync", "joint", "task"]) -> int:
        """Cycles after which an input is too old: the file's own number, else the DBC's TimeoutCycles."""
        own = {
            "sync": self.settings.deadline.sync_cycles,
            "joint": self.settings.deadline.joint_cycles,
            "task": self.settings.deadline.task_cycles,
        }[kind]
        if own is not None:
            return own
        message = {"sync": "Sync", "joint": "JointState1", "task": "TaskCommand"}[kind]
        return self.wire.message(message).timeout_cycles

    def changed(self, **tables: Mapping[str, Any]) -> "Configuration":
        """The same installation with some keys of some tables replaced, e.g. changed(wire={"rate_hz": 200}).

        Raises InputError as a file with these keys would.
        """
        old = self.settings.model_dump()
        new = {name: {**old.get(name, {}), **keys} for name, keys in tables.items()}
        return dataclasses.replace(self, settings=validate(Settings, {**old, **new}, self.source))

    def block(self, numeric: Numeric = "float32") -> bytes:
        """The bytes of guard_config_t. Raises InputError for a number that its numeric type cannot hold."""
        try:
            return self._blocks[numeric]
        except KeyError:
            pass
        try:
            block = pack(self._values(), numeric)
        except InputError as error:
            raise InputError(f"{self.source}: {error}") from error
        self._blocks[numeric] = block
        return block

    def crc(self, numeric: Numeric = "float32") -> int:
        """The CRC-32 inside the block: the configuration's name in every report."""
        return block_crc(self.block(numeric))

    @cached_property
    def _blocks(self) -> dict[Numeric, bytes]:
        return {}

    def _values(self) -> dict[str, Any]:
        """Field values by the names of guard_config_t."""
        settings, period = self.settings, self.period_us
        table = self.robot.table()
        robot = {name: getattr(table, name) for name in block_dtype("float32")["robot"].names or () if name != "joint"}
        joint_fields = block_dtype("float32")["robot"]["joint"].base.names or ()
        robot["joint"] = [{name: getattr(joint, name) for name in joint_fields} for joint in table.joint]
        observer = observer_constants(settings.observer.gain_per_s, period * 1e-6)
        return {
            "wire": self.wire.crc,
            "format": _FORMATS[settings.wire.format],
            "period_us": period,
            "sync_deadline_us": self.timeout_cycles("sync") * period,
            "joint_deadline_us": self.timeout_cycles("joint") * period,
            "task_deadline_us": self.timeout_cycles("task") * period,
            "tick_deadline_us": settings.deadline.tick_cycles * period,
            "tick_budget_us": self.tick_budget_us,
            "reset_healthy_us": round(settings.reset.healthy_ms * 1000),
            "stop_collision": settings.stop.collision,
            "stop_input": settings.stop.input,
            "stop_fault": settings.stop.fault,
            "observer": {**observer, "torque_sample": _TORQUE_SAMPLES[settings.observer.torque_sample]},
            "subspace": {
                "basis": _BASES[settings.subspace.basis],
                "tolerance": settings.subspace.tolerance_nm_per_n,
                "lever_m": settings.subspace.lever_m,
            },
            "sensor": {
                "offset_nm": self._by_joint(settings.sensor.offset_nm),
                "friction_nm": self._by_joint(settings.sensor.friction_nm),
            },
            "task": [{}, *(self._task_values(name) for name in TASKS)],
            "robot": robot,
        }

    def _task_values(self, name: TaskName) -> dict[str, Any]:
        task = self.settings.task[name]
        if task.index == "off":
            return {}
        return {
            "index": _INDEXES[task.index],
            "debounce_ticks": task.debounce_ticks,
            "threshold_nm": self.threshold_nm(name),
        }
