"""One installation: its settings together with its robot and its wire, checked against each other."""

import dataclasses
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from tauperp.busload import worst_case_load
from tauperp.config.block import (
    MAX_JOINTS,
    Numeric,
    block_crc,
    block_dtype,
    channel_constants,
    observer_constants,
    pack,
    passing_channel,
)
from tauperp.config.indexes import COMPONENTS, INDEXES, components_of, explained_directions, is_blind
from tauperp.config.settings import TASKS, Channel, Settings, Task
from tauperp.errors import InputError
from tauperp.robot.table import make_table
from tauperp.toml import validate
from tauperp.wire import Wire

if TYPE_CHECKING:
    from tauperp.robot import Robot

_ORDERS = {"filter_first": 1, "project_first": 2}
_PROJECTORS = {"hard": 1, "soft": 2}
_CHANNELS_OF = {"unexplained": 0, "sudden": 1}
_FRAMES = {"base": 1, "tool": 2}  # FRAME_BASE, FRAME_TOOL
_REACTIONS = {"report": 0, "slow": 1, "withdraw": 2}  # sight_reaction_t
_TORQUE_SAMPLES = {"interval": 1, "instant": 2}
_FORMATS = {"classic": 1, "fd": 2}

SETTLING = 5.0  # time constants of the observer before a permission
TASK_DWELL_S = 0.25  # shortest time for which a task stays active
THRESHOLD_SHARE = 3  # a threshold is at most the joint's torque limit over this: CONFIG_THRESHOLD_SHARE
SENSOR_SHARE = 4  # offset and friction are at most the torque limit over this: CONFIG_SENSOR_SHARE
RESIDUAL_SHARE = 2  # a limit on |r| is at most the torque limit times this: CONFIG_RESIDUAL_SHARE
FORCE_LIMIT_N = 400.0  # EXPLAINED_FORCE_LIMIT
SOFT_MIN = 0.004  # of a soft projector's tolerance
DEBOUNCE_MAX_S = 0.1

LOAD_LIMIT = 0.9  # largest load of the bus: above it, frames with errors cannot be repeated in time


@dataclasses.dataclass(frozen=True)
class Configuration:
    """All settings of a guard. Made by `load_configuration`; `source` names it in messages.

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
        for key, values in (("offset_nm", settings.sensor.offset_nm), ("friction_nm", settings.sensor.friction_nm)):
            if len(values) not in (1, n):
                self._refuse(f"sensor.{key}", f"{len(values)} values for the {n} joints of {self.robot.name}")
            for joint, value in zip(self.robot.joints, self._by_joint(values), strict=True):
                if abs(value) > joint.torque_max / SENSOR_SHARE:
                    limit = f"1/{SENSOR_SHARE} of the torque limit of {joint.torque_max:g} Nm of joint {joint.name}"
                    self._refuse(f"sensor.{key}", f"{value:g} Nm is beyond {limit}")
        if self.healthy_us < self.settling_us:
            self._refuse(
                "reset.healthy_ms",
                f"shorter than the {self.settling_us / 1000:g} ms (5 / observer.gain_per_s) in which the observer "
                "settles",
            )
        if settings.subspace.softness_nm_per_n < settings.subspace.tolerance_nm_per_n:
            self._refuse("subspace.softness_nm_per_n", "below tolerance_nm_per_n")
        if settings.subspace.order == "filter_first" and settings.bank.channel:
            self._refuse("bank.channel", "order 'filter_first' has the observer as its only filter")
        if settings.subspace.projector == "soft" and settings.subspace.tolerance_nm_per_n < SOFT_MIN:
            self._refuse("subspace.tolerance_nm_per_n", f"a soft projector needs at least {SOFT_MIN:g}")
        channels = settings.bank.channel
        if any(channel.of == "sudden" and channel.high_pass_hz == 0 for channel in channels):
            self._refuse("bank.channel", "a channel of 'sudden' needs a high-pass")
        if channels and all(channel.high_pass_hz > 0 for channel in channels):
            self._refuse("bank.channel", "every channel has a high-pass: the guard would not detect a constant force")
        names = list(self.settings.task.numbers)
        if len(names) != len(TASKS) + len(settings.task.more):
            self._refuse("task.more", "two tasks have the same name")
        for name in names:
            self._check_task(name)

    def _check_components(self, name: str) -> None:
        task, place = self.settings.task[name], f"task.{name}"
        subspace = self.settings.subspace
        if task.index == "d_r" and (subspace.order != "project_first" or subspace.projector != "soft"):
            self._refuse(f"{place}.index", "d_r needs order 'project_first' and the soft projector")
        if task.index == "d_f" and not task.components:
            self._refuse(f"{place}.components", "d_f needs at least one of " + ", ".join(COMPONENTS))
        if task.index != "d_f" and (task.components or task.frame != "base" or any(task.point_m)):
            self._refuse(f"{place}.index", f"components, frame and point_m belong to d_f, not to {task.index}")
        if task.fast:
            if not set(task.fast) <= set(components_of(task.index, task.components)):
                self._refuse(f"{place}.fast", "names a component that the task does not explain")
            if self.settings.subspace.projector != "soft":
                self._refuse(f"{place}.fast", "needs the soft projector")
            if not any(channel.of == "sudden" for channel in self.settings.bank.channel):
                self._refuse(f"{place}.fast", "needs a bank.channel of 'sudden'")

    def _check_task(self, name: str) -> None:
        task, n = self.settings.task[name], self.robot.n
        place = f"task.{name}.threshold_nm"
        self._check_components(name)
        if is_blind(task.index, n, task.components):
            self._refuse(
                f"task.{name}.index",
                f"{task.index} explains {explained_directions(task.index, task.components)} directions, "
                f"so with the {n} joints of {self.robot.name} the guard would detect nothing; use 'r' or 'off'",
            )
        if task.index == "off":
            return
        if task.needed_links and max(task.needed_links) > n:
            self._refuse(f"task.{name}.needed_links", f"{self.robot.name} has links 1 to {n}")
        rows = task.threshold_nm if any(isinstance(row, list) for row in task.threshold_nm) else [task.threshold_nm]
        if len(rows) not in (1, self.channels):
            self._refuse(place, f"{len(rows)} rows for the {self.channels} channels of the bank")
        for row in rows:
            if not isinstance(row, list) or len(row) not in (1, n):
                self._refuse(
                    place, f"{len(row) if isinstance(row, list) else 1} values for the {n} joints of {self.robot.name}"
                )
        for row in self.thresholds_nm(name):
            for joint, threshold in zip(self.robot.joints, row, strict=True):
                if not 0 < threshold <= joint.torque_max / THRESHOLD_SHARE:
                    limit = (
                        f"0 to 1/{THRESHOLD_SHARE} of the torque limit of {joint.torque_max:g} Nm of joint {joint.name}"
                    )
                    self._refuse(place, f"{threshold:g} Nm is beyond {limit}")
        if task.debounce_ticks > 2 and task.debounce_ticks * self.period_us * 1e-6 > DEBOUNCE_MAX_S:
            self._refuse(
                f"task.{name}.debounce_ticks",
                f"{task.debounce_ticks} ticks are longer than {DEBOUNCE_MAX_S:g} s at "
                f"{self.settings.wire.rate_hz:g} Hz",
            )
        moment_most = FORCE_LIMIT_N * self.settings.subspace.lever_m
        if task.limits.moment_max_nm > moment_most + 1e-9:
            self._refuse(
                f"task.{name}.limits.moment_max_nm",
                f"above {moment_most:g} Nm ({FORCE_LIMIT_N:g} N times subspace.lever_m)",
            )
        limits = task.limits.residual_max_nm
        if limits and len(limits) not in (1, n):
            self._refuse(
                f"task.{name}.limits.residual_max_nm", f"{len(limits)} values for the {n} joints of {self.robot.name}"
            )
        for joint, limit in zip(self.robot.joints, self.residual_max_nm(name), strict=True):
            if limit > RESIDUAL_SHARE * joint.torque_max:
                self._refuse(
                    f"task.{name}.limits.residual_max_nm",
                    f"{limit:g} Nm is beyond {RESIDUAL_SHARE} times the torque limit of joint {joint.name}",
                )

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

    @property
    def channels(self) -> int:
        """Number of channels of the bank."""
        return max(1, len(self.settings.bank.channel))

    @property
    def settling_us(self) -> int:
        """How long the observer must run without a restart before a permission: 5 time constants, in whole cycles."""
        cycles = int(np.ceil(SETTLING / self.settings.observer.gain_per_s * 1e6 / self.period_us - 1e-9))
        return max(1, cycles) * self.period_us

    @property
    def healthy_us(self) -> int:
        """How long everything must be good before a permission."""
        own = self.settings.reset.healthy_ms
        return self.settling_us if own is None else round(own * 1000)

    def thresholds_nm(self, task: str) -> npt.NDArray[np.float64]:
        """Thresholds of a task, (channels, n) Nm; zeros where its index is off."""
        settings = self.settings.task[task]
        if settings.index == "off":
            return np.zeros((self.channels, self.robot.n))
        rows = settings.threshold_nm
        if not any(isinstance(row, list) for row in rows):
            rows = [rows]
        return np.stack([np.broadcast_to(np.array(row, float), self.robot.n) for row in rows]) * np.ones(
            (self.channels, 1)
        )

    def threshold_nm(self, task: str) -> npt.NDArray[np.float64]:
        """Thresholds of a task in the bank's first channel, (n,) Nm; zeros where its index is off."""
        return self.thresholds_nm(task)[0]

    def residual_max_nm(self, task: str) -> npt.NDArray[np.float64]:
        """Limits of a task on |r|, (n,) Nm: its own, else each joint's torque limit."""
        own = self.settings.task[task].limits.residual_max_nm
        if own:
            return self._by_joint(own)
        return np.array([joint.torque_max for joint in self.robot.joints])

    def _by_joint(self, values: list[float]) -> npt.NDArray[np.float64]:
        return np.broadcast_to(np.array(values, float), self.robot.n).copy()

    def timeout_cycles(self, kind: Literal["sync", "joint", "task"]) -> int:
        """Cycles after which an input is too old: the file's number, else the DBC's TimeoutCycles."""
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
        """The same installation with some keys of some tables replaced, for example changed(wire={"rate_hz": 200}).

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

    def second_block(self, channels: int) -> bytes | None:
        """The block of the second of two channels; None for a guard of one."""
        return self.block("q9.22") if channels == 2 else None

    def crc(self, numeric: Numeric = "float32") -> int:
        """The CRC-32 inside the block. Reports identify the configuration by it."""
        return block_crc(self.block(numeric))

    @cached_property
    def _blocks(self) -> dict[Numeric, bytes]:
        return {}

    def _values(self) -> dict[str, Any]:
        """Field values by the names of guard_config_t."""
        settings, period = self.settings, self.period_us
        table = make_table(self.robot)
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
            "reset_healthy_us": self.healthy_us,
            "settling_us": self.settling_us,
            "task_dwell_cycles": round(TASK_DWELL_S * 1e6 / period),
            "stop_collision": settings.stop.collision,
            "stop_input": settings.stop.input,
            "stop_fault": settings.stop.fault,
            "observer": {**observer, "torque_sample": _TORQUE_SAMPLES[settings.observer.torque_sample]},
            "bank": {"channels": self.channels, "channel": self._channel_values()},
            "subspace": {
                "order": _ORDERS[settings.subspace.order],
                "projector": _PROJECTORS[settings.subspace.projector],
                "tolerance": settings.subspace.tolerance_nm_per_n,
                "lever_m": settings.subspace.lever_m,
                "softness": settings.subspace.softness_nm_per_n,
            },
            "acceleration": {
                "force_floor_n": settings.acceleration.force_floor_n,
                "error_max": settings.acceleration.error_max_m_s2,
            },
            "regressor": self._regressor_values(),
            "sensor": {
                "offset_nm": self._by_joint(settings.sensor.offset_nm),
                "friction_nm": self._by_joint(settings.sensor.friction_nm),
            },
            "shape": {"middle": _padded(table.middle), "half_m": _padded(table.half_m)},
            "sight": {"reaction": _REACTIONS[settings.sight.reaction], "force_n": settings.sight.force_n},
            "task": [{}, *(self._task_values(name) for name in settings.task.numbers)],
            "robot": robot,
        }

    def _task_values(self, name: str) -> dict[str, Any]:
        task = self.settings.task[name]
        if task.index == "off":
            return {}
        limits = task.limits.model_dump(exclude={"residual_max_nm"})
        return {
            "index": self._index_values(task),
            "detector": {
                "debounce_ticks": task.debounce_ticks,
                "channels": self.watched(name),
                "threshold_nm": self.thresholds_nm(name),
            },
            "limits": {**limits, "residual_max_nm": self.residual_max_nm(name)},
            "needed_links": sum(1 << (link - 1) for link in set(task.needed_links)),
        }

    def watched(self, name: str) -> int:
        """The channels of a task, one bit each. Channels of `sudden` only if the task has fast components."""
        bank, fast = self.settings.bank.channel, self.settings.task[name].fast
        ofs = [channel.of for channel in bank] or ["unexplained"]
        return sum(1 << place for place, of in enumerate(ofs) if of == "unexplained" or fast)

    def _index_values(self, task: Task) -> dict[str, Any]:
        values: dict[str, Any] = {
            "kind": INDEXES[task.index].kind,
            "components": sum(1 << COMPONENTS[name] for name in set(components_of(task.index, task.components))),
            "fast": sum(1 << COMPONENTS[name] for name in set(task.fast)),
        }
        if task.frame == "tool" or any(task.point_m):
            tool = make_table(self.robot).tool
            values["frame"] = _FRAMES[task.frame]
            values["axis"] = tool.T if task.frame == "tool" else np.eye(3)
            values["point"] = tool @ np.array(task.point_m)
        return values

    def _regressor_values(self) -> dict[str, Any]:
        settings = self.settings
        if all(settings.task[name].index != "d_r" for name in settings.task.numbers):
            return {}
        own, gain, period_s = settings.regressor, settings.observer.gain_per_s, self.period_us * 1e-6
        return {"used": 1, "low_pass": channel_constants(own.low_pass_per_s, 2, own.damping, 0.0, gain, period_s)}

    def _channel_values(self) -> list[dict[str, Any]]:
        gain, period_s = self.settings.observer.gain_per_s, self.period_us * 1e-6
        if self.settings.subspace.order == "filter_first":
            return [passing_channel()]
        channels = self.settings.bank.channel or [Channel(low_pass_per_s=gain)]
        return [
            {
                **channel_constants(one.low_pass_per_s, one.order, one.damping, one.high_pass_hz, gain, period_s),
                "of": _CHANNELS_OF[one.of],
            }
            for one in channels
        ]


def _padded(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """With zeros after the last joint."""
    return np.concatenate([values, np.zeros((MAX_JOINTS - len(values), *values.shape[1:]))])
