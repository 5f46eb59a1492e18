"""The firmware's mathematics on numpy arrays: the same C functions that the guard runs, one at a time."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from tauperp.config import TASKS, Configuration, Numeric, TaskName, load_configuration
from tauperp.config.block import MAX_JOINTS
from tauperp.errors import InputError
from tauperp.firmware.library import FloatArray, Library, load_library

if TYPE_CHECKING:
    from tauperp.robot import Robot

MAX_COLUMNS = 6  # SUBSPACE_MAX_COLUMNS
MAX_ENTRY = 64.0  # of a matrix to project on: firmware/core/subspace.h
TWIST_ROWS = 6


class Terms(NamedTuple):
    """The arm at one instant; with (m, n) inputs every array has m in front."""

    momentum: FloatArray  # (n,) M(q) qd, Nm s
    coriolis: FloatArray  # (n,) C(q, qd)^T qd, Nm
    gravity: FloatArray  # (n,) Nm
    jacobian: FloatArray  # (6, n) of the end-effector point: rows linear x y z (m), angular x y z; base frame


class Projection(NamedTuple):
    index: FloatArray  # type: ignore[assignment]  # (n,) what the columns of A do not explain of tau, in tau's unit
    singular_values: FloatArray  # (min(n, k),) of A, descending
    rank: int  # how many of them are above the tolerance


class Step(NamedTuple):
    residual: FloatArray  # (n,) r, the external torque that the observer sees, Nm
    index: FloatArray  # type: ignore[assignment]  # (n,) the task's index in the channel nearest to its threshold, Nm


class Core:
    """One arm's motion pass, momentum observer and indexes, in the firmware's own numbers.

    robot     a shipped name, the path of a URDF or MJCF file, or a tauperp.robot.Robot
    numeric   "float32" or "q9.22": which build computes
    config    a Configuration, a preset's name or a TOML file for gain, period, basis and tolerance; default "default".
              `robot` replaces the robot of a file.
    base, tip, tool, accept_inertia    which part of a robot's file is the arm, as of tauperp.robot.load

    Arrays are float64, converted to num_t on the way in. Arguments of the wrong shape, with NaN or infinity, or with
    names that are unknown raise ValueError (InputError, which is one, for robots, files and tasks) with the reason.
    """

    def __init__(
        self,
        robot: "str | Path | Robot",
        numeric: Numeric = "float32",
        config: Configuration | str | Path | None = None,
        *,
        base: str | None = None,
        tip: str | None = None,
        tool: Sequence[float] | None = None,
        accept_inertia: bool = False,
    ) -> None:
        self._library = library = load_library(numeric)
        named = {"base": base, "tip": tip, "tool": tool, "accept_inertia": accept_inertia or None}
        chain = {name: value for name, value in named.items() if value is not None}
        if isinstance(config, Configuration):
            config = Configuration(config.settings, _loaded(robot, chain), config.wire, config.source)
        else:
            config = load_configuration("default" if config is None else config, robot=robot, chain=chain)
        self.configuration = config
        self.robot = config.robot
        self.n = self.robot.n
        self._config = library.load_block(config.block(numeric))
        self._motion = library.new("motion_t *")
        self._observer = library.new("observer_t *")
        self._acceleration = library.new("acceleration_t *")
        self._index = library.new("index_t *")
        self._bank = library.new("bank_t *")
        self._detector = library.new("detector_t *")
        self._subspace = library.new("subspace_t *")
        self._q, self._qd, self._tau = (_Vector(library, MAX_JOINTS) for _ in range(3))
        self._columns = _Vector(library, MAX_COLUMNS * MAX_JOINTS)
        self._singular = _Vector(library, MAX_COLUMNS)
        self.reset()

    def reset(self) -> None:
        """Forget every step: the next one starts the observer at its sample, with a residual of zero."""
        lib = self._library.lib
        lib.motion_init(self._motion)
        lib.observer_init(self._observer)
        lib.acceleration_init(self._acceleration)
        lib.index_init(self._index)
        lib.bank_init(self._bank)
        lib.detector_init(self._detector)

    def terms(self, q: npt.ArrayLike, qd: npt.ArrayLike) -> Terms:
        """Momentum, C^T qd, gravity torque and Jacobian at q (n,) rad and qd (n,) rad/s; or (m, n) for m instants.

        Raises ValueError for wrong shapes, NaN or infinity, and OverflowError if Q9.22 cannot hold a result.
        """
        positions, velocities = np.asarray(q, float), np.asarray(qd, float)
        if positions.ndim == 2:
            if velocities.shape != positions.shape:
                raise ValueError(f"qd: shape {velocities.shape}, but q has {positions.shape}")
            if len(positions) == 0:
                raise ValueError("q: no rows")
            rows = [self.terms(*row) for row in zip(positions, velocities, strict=True)]
            return Terms(*(np.stack(column) for column in zip(*rows, strict=True)))
        self._q.set("q", positions, self.n)
        self._qd.set("qd", velocities, self.n)
        self._move()
        motion, n, library = self._motion, self.n, self._library
        jacobian = library.from_num(library.view(motion.jacobian)).reshape(TWIST_ROWS, MAX_JOINTS)[:, :n]
        return Terms(
            library.from_num(library.view(motion.momentum)[:n]),
            library.from_num(library.view(motion.coriolis)[:n]),
            library.from_num(library.view(motion.gravity)[:n]),
            jacobian.copy(),
        )

    def project(self, A: npt.ArrayLike, tau: npt.ArrayLike, tolerance: float) -> Projection:
        """Reject from tau (n,) what the columns of A (n, k) explain: d = tau - U_r U_r^T tau (eqs. 12 and 18).

        n 1 to 8, k 0 to 6, entries of A below 64 in size. A direction counts as explained if its singular value is
        above `tolerance`, which is not negative and in the unit of A. Raises ValueError otherwise, and OverflowError
        if Q9.22 cannot hold a result.
        """
        matrix = np.asarray(A, float)
        if matrix.ndim != 2 or not 1 <= matrix.shape[0] <= MAX_JOINTS or matrix.shape[1] > MAX_COLUMNS:
            raise ValueError(f"A: shape {matrix.shape}, must be (1 to {MAX_JOINTS}, 0 to {MAX_COLUMNS})")
        n, k = matrix.shape
        if not (np.abs(matrix) < MAX_ENTRY).all():
            raise ValueError(f"A: every entry must be a number below {MAX_ENTRY:g} in size")
        if not (np.isfinite(tolerance) and tolerance >= 0):
            raise ValueError(f"tolerance: {tolerance} is not a number from 0 on")
        padded = np.zeros((MAX_COLUMNS, MAX_JOINTS))
        padded[:k, :n] = matrix.T
        self._columns.set("A", padded.ravel(), padded.size)
        self._tau.set("tau", np.asarray(tau, float), n)
        library, subspace = self._library, self._subspace
        limit = library.to_num(np.array([tolerance])).item()
        columns = library.ffi.cast(f"num_t(*)[{MAX_JOINTS}]", self._columns.pointer)
        library.lib.subspace_init(subspace)
        library.lib.subspace_step(subspace, n, k, columns, limit)
        library.lib.subspace_reject(subspace, self._tau.pointer, self._tau.pointer)
        self._check_saturations(subspace.saturations)
        rank = int(subspace.rank)
        library.lib.subspace_measure(subspace, n, k, columns, limit, self._singular.pointer)
        self._check_saturations(subspace.saturations)
        singular = library.from_num(self._singular.view[: subspace.directions])
        return Projection(library.from_num(self._tau.view[:n]), np.sort(singular)[::-1], rank)

    def step(
        self,
        q: npt.ArrayLike,
        qd: npt.ArrayLike,
        tau: npt.ArrayLike,
        task: TaskName | int,
        accel: npt.ArrayLike | None = None,
    ) -> Step:
        """One cycle of the observer and of the task's index; cycles follow each other by the configured period.

        q, qd, tau   (n,) rad, rad/s, Nm: link-side joint torque, positive as the drive turns the link
        task         "none", "payload", "contact", or the wire's 1, 2, 3; may change with any step
        accel        (3,) desired acceleration of the end-effector in the base frame, m/s^2; None is zero. Only the
                     payload's index uses it.

        The first step after `reset` gives a residual of zero. Raises ValueError for a bad array, InputError for a task
        that is unknown or off in the configuration, and OverflowError if Q9.22 cannot hold a result.
        """
        config, lib = self._config, self._library.lib
        number = self._task_number(task)
        acceleration = _vec3(self._library, "accel", np.zeros(3) if accel is None else np.asarray(accel, float))
        self._q.set("q", np.asarray(q, float), self.n)
        self._qd.set("qd", np.asarray(qd, float), self.n)
        self._tau.set("tau", np.asarray(tau, float), self.n)
        self._move()
        stages = (self._observer, self._acceleration, self._index, self._bank)
        before = sum(stage.saturations for stage in stages)
        observer, measured, index, bank = stages
        task_row = config.task[number]
        address = self._library.ffi.addressof
        gains, robot = address(config, "observer"), address(config, "robot")
        lib.observer_step(observer, gains, self.n, self._motion, self._tau.pointer, 1)
        lib.acceleration_step(measured, address(config, "acceleration"), gains, observer, robot, self._motion,
                              self._qd.pointer, acceleration, task_row.limits.mass_max_kg)  # fmt: skip
        lib.index_step(index, address(config, "subspace"), address(task_row, "index"), robot, self._motion, observer,
                       measured)  # fmt: skip
        lib.bank_step(bank, address(config, "bank"), self.n, observer.gap, index.unexplained, 0)
        lib.detector_step(self._detector, address(task_row, "detector"), self.n, bank)
        self._check_saturations(sum(stage.saturations for stage in stages) - before)
        view, n = self._library.view, self.n
        return Step(
            self._library.from_num(view(observer.residual)[:n]),
            self._library.from_num(view(self._detector.value_nm)[:n]),
        )

    def _move(self) -> None:
        """The motion pass over the joint buffers."""
        motion, library = self._motion, self._library
        before = motion.saturations
        robot = library.ffi.addressof(self._config, "robot")
        library.lib.motion_step(motion, robot, self._q.pointer, self._qd.pointer)
        self._check_saturations(motion.saturations - before)

    def _task_number(self, task: TaskName | int) -> int:
        names = {number: name for name, number in TASKS.items()}
        name = names.get(task) if isinstance(task, int) else task
        if name not in TASKS:
            raise InputError(f"task: {task!r} is unknown (there are {', '.join(TASKS)})")
        if self.configuration.settings.task[name].index == "off":
            raise InputError(
                f"task: {name!r} is off for the {self.n} joints of {self.robot.name} in {self.configuration.source}"
            )
        return TASKS[name]

    def _check_saturations(self, count: int) -> None:
        if count:
            raise OverflowError(f"{count} results do not fit into {self._library.numeric}")


class _Vector:
    """num_t[] in C, set from checked numpy arrays."""

    def __init__(self, library: Library, length: int) -> None:
        self._library = library
        self.pointer = library.new(f"num_t[{length}]")
        self.view = library.view(self.pointer)

    def set(self, name: str, values: FloatArray, length: int) -> None:
        """Raises ValueError, naming the argument, unless `values` are `length` finite numbers that num_t holds."""
        _check(name, values, length)
        try:
            self.view[:length] = self._library.to_num(values)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error


def _check(name: str, values: FloatArray, length: int) -> None:
    if values.shape != (length,):
        raise ValueError(f"{name}: shape {values.shape}, must be ({length},)")
    if not np.isfinite(values).all():
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ValueError(f"{name}[{at}]: {values[at]} is not a finite number")


def _vec3(library: Library, name: str, values: FloatArray) -> Any:
    _check(name, values, 3)
    x, y, z = library.to_num(values).tolist()
    return {"x": x, "y": y, "z": z}


def _loaded(robot: "str | Path | Robot", chain: Mapping[str, Any]) -> "Robot":
    from tauperp import robot as robots

    if not isinstance(robot, robots.Robot):
        return robots.load(robot, **chain)
    if chain:
        raise InputError(f"{', '.join(chain)} goes with a robot's name or file, and this one is read already")
    return robot
