"""The firmware's mathematics on numpy arrays: the same C functions that the guard runs, one instant or many a call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast, get_args

import numpy as np
import numpy.typing as npt

from tauperp.config import Configuration, Numeric, load_configuration
from tauperp.config.block import MAX_JOINTS
from tauperp.errors import InputError
from tauperp.firmware.library import FloatArray, Library, load_library

if TYPE_CHECKING:
    from tauperp.robot import Robot

MAX_COLUMNS = 6  # SUBSPACE_MAX_COLUMNS
MAX_ENTRY = 64.0  # of a matrix to project on: firmware/core/subspace.h
TWIST_ROWS = 6

Method = Literal["golub-kahan", "jacobi"]


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
    residual: FloatArray  # (n,) r, the external torque by the observer, Nm
    index: FloatArray  # type: ignore[assignment]  # (n,) the task's index in the channel nearest to its threshold, Nm


class CoreTrip(NamedTuple):
    """The index of a joint has been above its threshold for the task's debounce time."""

    row: int  # of the arrays, from 0
    joint: int  # from 1
    index_nm: float
    threshold_nm: float


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
        robot: str | Path | Robot,
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
        self._stages = library.new("tauperp_core_t *")
        self._subspace = library.new("subspace_t *")
        self._jacobi = library.new("jacobi_t *")
        self._tau = _Vector(library, MAX_JOINTS)
        self._columns = _Vector(library, MAX_COLUMNS * MAX_JOINTS)
        self._singular = _Vector(library, MAX_COLUMNS)
        self._links: dict[tuple[int, tuple[float, ...]], Core] = {}  # arms that end at a point of a link
        self.reset()

    def __repr__(self) -> str:
        source = self.configuration.source
        return f"Core({self.robot.name!r}, {self._library.numeric!r}, {source!r}): {self.n} joints"

    def reset(self) -> None:
        """Reset the observer. The next step starts it at its sample, with a residual of zero."""
        self._library.lib.tauperp_core_init(self._stages)

    def terms(self, q: npt.ArrayLike, qd: npt.ArrayLike) -> Terms:
        """Momentum, C^T qd, gravity torque and Jacobian at q (n,) rad and qd (n,) rad/s; or (m, n) for m instants.

        Raises ValueError for wrong shapes, NaN or infinity, and OverflowError if Q9.22 cannot hold a result.
        """
        positions, velocities = np.asarray(q, float), np.asarray(qd, float)
        many = positions.ndim == 2
        if many and velocities.shape != positions.shape:
            raise ValueError(f"qd: shape {velocities.shape}, but q has {positions.shape}")
        rows = _rows("q", positions, self.n)
        places = self._numbers("q", positions, rows), self._numbers("qd", velocities, rows)
        shapes = [(rows, self.n)] * 3 + [(rows, TWIST_ROWS, self.n)]
        results = [np.empty(shape, self._library.scalar) for shape in shapes]
        robot = self._library.ffi.addressof(self._config, "robot")
        done = self._library.lib.tauperp_terms(robot, rows, *map(self._pointer, (*places, *results)))
        self._check_rows(done, rows)
        every = [self._library.from_num(result) for result in results]
        return Terms(*(every if many else [one[0] for one in every]))

    def link_jacobian(self, q: npt.ArrayLike, link: int, point: npt.ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
        """Jacobian (6, n) of a point of link `link` (from 1) at q (n,) rad, as `terms` gives it for the end-effector.

        point   (3,) m in the link's joint frame; by default its origin

        The columns of later joints are zero. The torque of a force f at the point is jacobian[:3].T @ f. Raises
        ValueError for a bad array or a link that the arm does not have.
        """
        if not 1 <= link <= self.n:
            raise ValueError(f"link: {link}, must be 1 to {self.n}")
        position, at = np.asarray(q, float), np.asarray(point, float)
        _check("q", position, self.n)
        _check("point", at, 3)
        key = link, tuple(at.tolist())
        if key not in self._links:
            ends = replace(self.robot, joints=self.robot.joints[:link], capsules=self.robot.capsules[:link], tip=at)
            self._links[key] = Core(ends, self._library.numeric)
        jacobian = np.zeros((TWIST_ROWS, self.n))
        jacobian[:, :link] = self._links[key].terms(position[:link], np.zeros(link)).jacobian
        return jacobian

    def project(
        self, A: npt.ArrayLike, tau: npt.ArrayLike, tolerance: float, method: Method = "golub-kahan"
    ) -> Projection:
        """Reject from tau (n,) what the columns of A (n, k) explain: d = tau - U_r U_r^T tau (eqs. 12 and 18).

        n 1 to 8, k 0 to 6, entries of A below 64 in size. A direction counts as explained if its singular value is
        above `tolerance`, which is not negative and in the unit of A. `method` is the singular value decomposition:
        "golub-kahan" is the first channel's, "jacobi" (one-sided rotations) the second one's. Raises ValueError
        otherwise, and OverflowError if Q9.22 cannot hold a result.
        """
        if method not in get_args(Method):
            raise ValueError(f"method: {method!r} is unknown (there are {', '.join(get_args(Method))})")
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
        if method == "jacobi":
            return self._project_jacobi(n, k, columns, limit)
        library.lib.subspace_init(subspace)
        library.lib.subspace_step(subspace, n, k, columns, limit)
        library.lib.subspace_reject(subspace, self._tau.pointer, self._tau.pointer)
        self._check_saturations(subspace.saturations)
        rank = int(subspace.rank)
        library.lib.subspace_measure(subspace, n, k, columns, limit, self._singular.pointer)
        self._check_saturations(subspace.saturations)
        singular = library.from_num(self._singular.view[: subspace.directions])
        return Projection(library.from_num(self._tau.view[:n]), np.sort(singular)[::-1], rank)

    def _project_jacobi(self, n: int, k: int, columns: Any, limit: Any) -> Projection:
        library, jacobi = self._library, self._jacobi
        library.lib.jacobi_init(jacobi)
        library.lib.jacobi_hard(jacobi, n, k, columns, limit)
        library.lib.jacobi_reject(jacobi, self._tau.pointer, self._tau.pointer)
        self._check_saturations(jacobi.saturations)
        singular = library.from_num(library.view(jacobi.singular)[: jacobi.directions])
        return Projection(library.from_num(self._tau.view[:n]), singular, int(jacobi.rank))

    def step(
        self,
        q: npt.ArrayLike,
        qd: npt.ArrayLike,
        tau: npt.ArrayLike,
        task: str | int | npt.ArrayLike,
        accel: npt.ArrayLike | None = None,
    ) -> Step:
        """One cycle of the observer and of the task's index; cycles follow each other by the configured period.

        q, qd, tau   (n,) rad, rad/s, Nm: link-side joint torque, positive as the drive turns the link; or (m, n) for m
                     cycles in one call, with results (m, n)
        task         "none", "payload", "contact", a name under `task.more`, or its number on the wire; may change with
                     any step; for m cycles also (m,) numbers
        accel        (3,) desired acceleration of the end-effector in the base frame, m/s^2; None is zero; for m cycles
                     also (m, 3). Only the payload's index uses it.

        The first step after `reset` gives a residual of zero. Raises ValueError for a bad array, InputError for a task
        that is unknown or off in the configuration, and OverflowError if Q9.22 cannot hold a result; the rows before
        it are done then.
        """
        residual, index, _, _ = self._run(q, qd, tau, task, accel)
        return Step(residual, index) if np.ndim(q) == 2 else Step(residual[0], index[0])

    def trips(
        self,
        q: npt.ArrayLike,
        qd: npt.ArrayLike,
        tau: npt.ArrayLike,
        task: str | int | npt.ArrayLike,
        accel: npt.ArrayLike | None = None,
    ) -> list[CoreTrip]:
        """Where the index of a recording goes above its threshold for the debounce time, from a `reset` on.

        Arguments as for `step` with (m, n) arrays. One trip per crossing, at its first row. This is only the
        mathematics: no deadlines, no settling, no latch; tauperp.firmware.Guard is the whole guard.
        """
        self.reset()
        _, index, threshold, tripped = self._run(q, qd, tau, task, accel)
        starts = np.flatnonzero((tripped > 0) & np.concatenate([[True], tripped[:-1] == 0]))
        return [
            CoreTrip(row, joint, float(index[row, joint - 1]), float(threshold[row, joint - 1]))
            for row, joint in ((int(row), int(tripped[row])) for row in starts)
        ]

    @property
    def basis(self) -> FloatArray:
        """A (n, k): the columns of torque that the task of the last step explains, Nm per N; k is 0 to 6."""
        index, library = self._stages.index, self._library
        columns = library.from_num(library.view(index.column)).reshape(MAX_COLUMNS, MAX_JOINTS)
        basis: FloatArray = columns[: index.columns, : self.n].T.copy()
        return basis

    def _run(
        self,
        q: npt.ArrayLike,
        qd: npt.ArrayLike,
        tau: npt.ArrayLike,
        task: str | int | npt.ArrayLike,
        accel: npt.ArrayLike | None,
    ) -> tuple[FloatArray, FloatArray, FloatArray, npt.NDArray[np.uint8]]:
        """Residual, index and threshold, (m, n) each, and (m,) the joint that is above its threshold, or 0."""
        library, positions = self._library, np.asarray(q, float)
        rows = _rows("q", positions, self.n)
        tasks = self._tasks(task, rows)
        wanted = np.zeros(3) if accel is None else np.asarray(accel, float)
        if wanted.ndim == 1:
            _check("accel", wanted, 3)
            wanted = np.broadcast_to(wanted, (rows, 3))
        places = [self._numbers("q", positions, rows)]
        places += [self._numbers(name, np.asarray(one, float), rows) for name, one in (("qd", qd), ("tau", tau))]
        places += [self._numbers("accel", wanted, rows, 3)]
        results = [np.empty((rows, self.n), library.scalar) for _ in range(3)]
        tripped = np.zeros(rows, np.uint8)
        bytes_of = library.ffi.from_buffer
        done = library.lib.tauperp_core_steps(
            self._stages, self._config, rows, bytes_of("uint8_t[]", tasks), *map(self._pointer, (*places, *results)),
            bytes_of("uint8_t[]", tripped))  # fmt: skip
        self._check_rows(done, rows)
        residual, index, threshold = (library.from_num(result) for result in results)
        return residual, index, threshold, tripped

    def _tasks(self, task: str | int | npt.ArrayLike, rows: int) -> npt.NDArray[np.uint8]:
        if isinstance(task, str | int):
            return np.full(rows, self._task_number(cast("str | int", task)), np.uint8)
        numbers = np.asarray(task)
        if numbers.shape != (rows,) or numbers.dtype.kind not in "iu":
            raise ValueError(f"task: shape {numbers.shape} of {numbers.dtype}, must be whole numbers ({rows},)")
        for number in np.unique(numbers):
            self._task_number(int(number))
        return numbers.astype(np.uint8)

    def _numbers(self, name: str, values: FloatArray, rows: int, width: int | None = None) -> npt.NDArray[Any]:
        """Checked values as num_t, (rows, width); width n by default. Raises ValueError, naming the argument."""
        width = self.n if width is None else width
        if rows == 1 and values.shape != (1, width):
            _check(name, values, width)
            values = values[None]
        if values.shape != (rows, width):
            raise ValueError(f"{name}: shape {values.shape}, must be ({rows}, {width})")
        bad = ~np.isfinite(values)
        if bad.any():
            row, column = (int(at) for at in np.argwhere(bad)[0])
            raise ValueError(f"{name}[{row}, {column}]: {values[row, column]} is not a finite number")
        try:
            return np.ascontiguousarray(self._library.to_num(values))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error

    def _pointer(self, values: npt.NDArray[Any]) -> Any:
        return self._library.ffi.from_buffer("num_t[]", values)

    def _check_rows(self, done: int, rows: int) -> None:
        if done < rows:
            raise OverflowError(f"row {done}: a result does not fit into {self._library.numeric}")

    def _task_number(self, task: str | int) -> int:
        numbers = self.configuration.settings.task.numbers
        names = {number: name for name, number in numbers.items()}
        name = names.get(task) if isinstance(task, int) else task
        if name not in numbers:
            raise InputError(f"task: {task!r} is unknown (there are {', '.join(numbers)})")
        if self.configuration.settings.task[name].index == "off":
            raise InputError(
                f"task: {name!r} is off for the {self.n} joints of {self.robot.name} in {self.configuration.source}"
            )
        return numbers[name]

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


def _rows(name: str, values: FloatArray, width: int) -> int:
    """How many instants an array is: one for (n,), m for (m, n)."""
    if values.ndim != 2:
        _check(name, values, width)
        return 1
    if len(values) == 0:
        raise ValueError(f"{name}: no rows")
    if values.shape[1] != width:
        raise ValueError(f"{name}: shape {values.shape}, must be (m, {width})")
    return len(values)


def _loaded(robot: str | Path | Robot, chain: Mapping[str, Any]) -> Robot:
    from tauperp import robot as robots

    if not isinstance(robot, robots.Robot):
        return robots.load(robot, **chain)
    if chain:
        raise InputError(f"{', '.join(chain)} applies to a robot's name or file, not to a Robot object")
    return robot
