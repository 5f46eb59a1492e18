"""The compiled kernel (host/kernel): many runs in one call, in as many threads as the caller starts.

A call releases Python's lock, so plain threads use every core. `Bench` is one thread's arm; its results depend on the
rows of the plan and on nothing else.
"""

import copy
import ctypes
import dataclasses
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from tauperp.config import Configuration, Numeric
from tauperp.errors import InputError
from tauperp.files import how_to_build
from tauperp.firmware import load_library
from tauperp.kernel import layout
from tauperp.kernel.detectors import Detector
from tauperp.robot import Robot
from tauperp.sim.contact import Hand, Strike
from tauperp.sim.control import BANDWIDTH_RAD_S
from tauperp.sim.model import PAYLOAD, TIP, build_spec, geom_name
from tauperp.sim.motion import Recovery
from tauperp.wire import WireMessage

Rows = npt.NDArray[Any]  # of a structured type of tauperp.kernel.layout
Readings = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]]  # q, qd, tau: (m, n)

HAND = "hand0"

_SIGNALS = {
    "Sync": ("Cycle",),
    "TaskCommand": ("Task", "AccelX", "AccelY", "AccelZ"),
    "GuardReset": ("Request", "TripNumber"),
    "JointState": ("CycleHigh", "Position", "Velocity", "Torque"),
}  # in the order of host/kernel/frames.c


class StopFlag:
    """Set by another thread or a signal handler: a running call returns after its current run."""

    def __init__(self) -> None:
        self.value = ctypes.c_uint32(0)

    def set(self) -> None:
        self.value.value = 1

    @property
    def is_set(self) -> bool:
        return bool(self.value.value)


@functools.cache
def load_kernel(numeric: Numeric = "float32") -> ctypes.CDLL:
    """The kernel that belongs to the firmware's library of these numbers.

    Raises InputError if it is not built, or was built for another layout or another MuJoCo.
    """
    path = load_library(numeric).path.with_name("libtauperp_kernel.so")
    if not path.is_file():
        raise InputError(f"{path}: the campaign's kernel is missing; {_how_to_build()}")
    try:
        ctypes.CDLL(str(_mujoco_library()), mode=ctypes.RTLD_GLOBAL)
        kernel = ctypes.CDLL(str(path.resolve()))
        described = (ctypes.c_uint32 * 8)()
        kernel.kernel_describe(described)
    except (OSError, AttributeError) as error:
        raise InputError(f"{path}: not a kernel for MuJoCo {mujoco.__version__}: {error}") from error
    types = (layout.SETUP, layout.RUN, layout.RESULT, layout.RECORDING, layout.INJECTION)
    if list(described[:6]) != [layout.ABI, *(kind.itemsize for kind in types)]:
        raise InputError(f"{path}: older than the sources; {_how_to_build()}")
    if described[6] != described[7]:
        raise InputError(f"{path}: built for MuJoCo {described[6]}, and {described[7]} is loaded; {_how_to_build()}")
    for function in (kernel.kernel_simulate, kernel.kernel_inject, kernel.kernel_listen):
        function.restype = ctypes.c_uint32
    return kernel


def _how_to_build() -> str:
    return how_to_build("kernel", in_package=False)


def _mujoco_library() -> Path:
    return next(iter(sorted(Path(mujoco.__file__).parent.glob("libmujoco.so*"))))


@dataclasses.dataclass(frozen=True, eq=False)
class Heard:
    """The guard's output for each row of a recording; Nm. Rows from `rows` on were not sent."""

    residual: npt.NDArray[np.float64]  # (m, n) r
    index: npt.NDArray[np.float64]  # (m, channels, n)
    explained: npt.NDArray[np.float64]  # (m, 6) coefficients of the task's columns (firmware/core/explained.h), N
    permitted: npt.NDArray[np.bool_]  # (m,)
    evaluated: npt.NDArray[np.bool_]  # (m,) a new snapshot went through every stage
    rows: int


class Bench:
    """One thread's arm, guards and detectors.

    configurations  of the guards that receive the same frames; the first one controls the arm
    detectors       compared on the guards' signals
    period_us       one cycle of the first configuration; `substeps` of physics in it
    """

    def __init__(
        self,
        configurations: Sequence[Configuration],
        detectors: Sequence[Detector],
        *,
        numeric: Numeric = "float32",
        substeps: int = 1,
    ) -> None:
        if len(configurations) > layout.GUARDS or len(detectors) > layout.DETECTORS:
            raise InputError(f"at most {layout.GUARDS} guards and {layout.DETECTORS} detectors in one campaign")
        self._kernel = load_kernel(numeric)
        first = configurations[0]
        robot, period_us = first.robot, first.period_us
        timestep = period_us * 1e-6 / substeps
        self.robot = robot
        self.configuration = first
        self.setup = setup = np.zeros((), layout.SETUP)
        self._plant = build_spec(robot, timestep_s=timestep).compile()
        self._nominal = build_spec(robot, timestep_s=timestep).compile()
        payload = self._nominal.body(PAYLOAD).id
        self._nominal.body_mass[payload] = 0.0
        self._nominal.body_inertia[payload] = 0.0
        mujoco.mj_setConst(self._nominal, mujoco.MjData(self._nominal))
        self._contact = _contact_model(robot, timestep)
        self._blocks = [np.frombuffer(one.block(numeric), np.uint8).copy() for one in configurations]
        _check_guards(configurations, numeric)
        n = robot.n
        setup["plant"], setup["nominal"] = self._plant._address, self._nominal._address
        setup["contact"] = self._contact._address
        for number, block in enumerate(self._blocks):
            setup["config"][number] = block.ctypes.data
        setup["config_size"] = len(self._blocks[0])
        setup["guards"], setup["detectors"] = len(configurations), len(detectors)
        setup["period_us"], setup["substeps"], setup["joints"] = period_us, substeps, n
        setup["channels"] = first.channels
        setup["fd"] = first.settings.wire.format == "fd"
        setup["bandwidth_rad_s"], setup["deceleration_rad_s2"] = BANDWIDTH_RAD_S, Recovery.deceleration_rad_s2
        self._name_parts(robot)
        for place, name in (("sync", "Sync"), ("task", "TaskCommand"), ("reset", "GuardReset")):
            _fill_message(setup[place], first.wire.message(name), _SIGNALS[name])
        for joint in range(n):
            _fill_message(setup["joint"][joint], first.wire.message(f"JointState{joint + 1}"), _SIGNALS["JointState"])
        for number, detector in enumerate(detectors):
            detector.fill(setup["detector"][number], n)

    def _name_parts(self, robot: Robot) -> None:
        """MuJoCo's numbers of the kernel's parts. Bodies and tip have the same ones with and without a hand."""
        setup, plant, contact = self.setup, self._plant, self._contact
        for link, joint in enumerate(robot.joints):
            body = plant.body(joint.name).id
            shape = robot.capsules[link]
            setup["body"][link] = body
            setup["mass"][link] = plant.body_mass[body]
            setup["inertia"][link] = plant.body_inertia[body]
            setup["torque_max"][link] = joint.torque_max
            setup["capsule"][link] = [*shape.p0, *shape.p1, shape.radius]
            setup["link_geom"][link] = contact.geom(geom_name(link)).id
            setup["pair"][link] = contact.pair(f"{HAND}_{geom_name(link)}").id
        setup["payload"], setup["tip"] = plant.body(PAYLOAD).id, plant.site(TIP).id
        setup["hand_geom"], setup["hand_body"] = contact.geom(HAND).id, contact.body(HAND).id
        setup["hand_position"] = contact.joint(f"{HAND}_x").qposadr[0]
        setup["hand_speed"] = contact.joint(f"{HAND}_x").dofadr[0]

    def simulate(self, runs: Rows, stop: StopFlag | None = None) -> Rows:
        """Results of these rows (layout.RUN), in their order; fewer if `stop` was set."""
        results = np.zeros(len(runs), layout.RESULT)
        flag = (stop or StopFlag()).value
        runs = np.ascontiguousarray(runs)
        done = self._kernel.kernel_simulate(
            self.setup.ctypes.data_as(ctypes.c_void_p),
            runs.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_uint32(len(runs)),
            results.ctypes.data_as(ctypes.c_void_p),
            ctypes.byref(flag),
        )
        return results[:done]

    def inject(
        self,
        readings: Readings,
        cycles: npt.NDArray[np.uint32],
        task: int,
        injections: Rows,
        window_s: float,
        stop: StopFlag | None = None,
    ) -> Rows:
        """Results of pushes (layout.INJECTION, sorted by row) on a recording: position, velocity, torque (m, n) and
        the cycle of each row (m,)."""
        recording, _kept = _recording(readings, cycles, task)
        injections = np.ascontiguousarray(injections)
        results = np.zeros(len(injections), layout.RESULT)
        flag = (stop or StopFlag()).value
        done = self._kernel.kernel_inject(
            self.setup.ctypes.data_as(ctypes.c_void_p),
            recording.ctypes.data_as(ctypes.c_void_p),
            injections.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_uint32(len(injections)),
            ctypes.c_double(window_s),
            results.ctypes.data_as(ctypes.c_void_p),
            ctypes.byref(flag),
        )
        return results[:done]

    def listen(self, readings: Readings, cycles: npt.NDArray[np.uint32], task: int) -> "Heard":
        """The first guard's output for a recording, row by row."""
        recording, _kept = _recording(readings, cycles, task)
        rows, n = len(cycles), self.robot.n
        residual, index = np.zeros((rows, n)), np.zeros((rows, self.configuration.channels, n))
        explained, verdict = np.zeros((rows, layout.COLUMNS)), np.zeros(rows, np.uint8)
        done = self._kernel.kernel_listen(
            self.setup.ctypes.data_as(ctypes.c_void_p),
            recording.ctypes.data_as(ctypes.c_void_p),
            residual.ctypes.data_as(ctypes.c_void_p),
            index.ctypes.data_as(ctypes.c_void_p),
            explained.ctypes.data_as(ctypes.c_void_p),
            verdict.ctypes.data_as(ctypes.c_void_p),
            ctypes.byref(StopFlag().value),
        )
        return Heard(residual, index, explained, verdict & 1 != 0, verdict & 2 != 0, int(done))

    def twin(self) -> "Bench":
        """The same for another thread, with its own models."""
        other = copy.copy(self)
        other.setup = self.setup.copy()
        other._plant, other._nominal, other._contact = map(copy.copy, (self._plant, self._nominal, self._contact))
        other.setup["plant"], other.setup["nominal"] = other._plant._address, other._nominal._address
        other.setup["contact"] = other._contact._address
        return other


def _recording(readings: Readings, cycles: npt.NDArray[np.uint32], task: int) -> tuple[Any, list[Any]]:
    """A layout.RECORDING, and the arrays that it points into."""
    arrays = [np.ascontiguousarray(values, np.float64) for values in readings]
    numbers = np.ascontiguousarray(cycles, np.uint32)
    recording = np.zeros((), layout.RECORDING)
    for name, values in zip(("position", "velocity", "torque"), arrays, strict=True):
        recording[name] = values.ctypes.data
    recording["cycle"], recording["rows"], recording["task"] = numbers.ctypes.data, len(numbers), task
    return recording, [*arrays, numbers]


def _contact_model(robot: Robot, timestep: float) -> Any:
    """The arm together with a striking part, whose mass and size each run sets."""
    spec = build_spec(robot, timestep_s=timestep)
    Hand(Strike(link=1, direction=(1.0, 0.0, 0.0)), 0).add_to(spec)
    return spec.compile()


def _check_guards(configurations: Sequence[Configuration], numeric: Numeric) -> None:
    """Refuses blocks that the firmware refuses, and guards on the same frames with different formats or cycles."""
    from tauperp.firmware import Guard

    first = configurations[0]
    for one in configurations:
        Guard(one.block(numeric))
        if one.period_us != first.period_us or one.settings.wire.format != first.settings.wire.format:
            raise InputError(f"{one.source}: its cycle or frame format is not that of {first.source}")


def _fill_message(target: Any, message: WireMessage, names: Sequence[str]) -> None:
    target["id"], target["length"] = message.id, message.length
    target["counter_is_cycle"] = message.counter_is_cycle
    target["data_ids"] = np.frombuffer(message.data_ids, np.uint8)
    for place, name in zip(target["signal"], names, strict=False):
        signal = message.definition.get_signal_by_name(name)
        factor = float(signal.scale)
        place["per_unit"], place["shift"], place["mask"] = 1.0 / factor, signal.start, (1 << signal.length) - 1
        low, high = float(signal.minimum or 0.0), float(signal.maximum or 0.0)
        place["min"], place["max"] = round(low / factor), round(high / factor)


def cycles_of(time_s: npt.NDArray[np.float64], period_us: int) -> npt.NDArray[np.uint32]:
    """The cycle of each row of a recording: its time in periods, at least one after the previous row, from 1."""
    wanted = np.rint(time_s * 1e6 / period_us).astype(np.int64)
    steps = np.arange(len(wanted))
    return (np.maximum.accumulate(wanted - steps) + steps + 1).astype(np.uint32)
