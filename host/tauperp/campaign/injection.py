"""Pushes through the transposed Jacobian into recordings of a real arm in free motion.

Noise, friction and model error are real; only the collision is computed. The first part of each recording calibrates
(offsets, friction, thresholds of every detector). The second part is judged and pushed.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tauperp.calibrate.calibration import WARM_UP_S, at_rate_of, calibrate
from tauperp.calibrate.sources import Motion, read_motion
from tauperp.campaign.draw import surface_point, unit
from tauperp.campaign.plan import Plan
from tauperp.campaign.store import BY_JOINT
from tauperp.campaign.work import SMALLEST_THRESHOLD_NM, Comparison, comparison
from tauperp.config import TASKS, Configuration, TaskName
from tauperp.errors import InputError
from tauperp.kernel import layout
from tauperp.kernel.bench import Bench, Rows, cycles_of

FloatArray = npt.NDArray[np.float64]

AFTER_S = 0.3  # s observed after a push


@dataclasses.dataclass(frozen=True, eq=False)
class Injected:
    """Results of one task: the judged pass without pushes, one row per recording, and the pushes."""

    task: TaskName
    free: Rows
    pushed: Rows
    injections: Rows
    compared: Comparison


def inject(plan: Plan, progress: Callable[[float, str], None]) -> list[Injected]:
    """Every task of the plan on its recordings.

    Raises InputError for a recording that is touched, too short, or does not fit the robot.
    """
    recording = plan.file.recording
    assert recording is not None
    joints = plan.configuration.robot.n
    folder = plan.path.parent
    motions = []
    for name in recording.files:
        path = folder / name
        map_file = None if recording.map is None else folder / recording.map
        motions.append(read_motion(path if path.exists() else name, joints, map_file))
        motions[-1].refuse_touches()
    progress(0.0, "calibrating")
    found = calibrate(
        motions,
        plan.configuration,
        alarms_per_hour=recording.alarms_per_hour,
        held_out=1 - recording.calibrate,
        numeric=plan.file.numeric,
    )
    own_rate = at_rate_of(motions, plan.configuration)
    corrected = [found.correction.apply(motion) for motion in motions]
    cut = [round(recording.calibrate * len(motion.time_s)) for motion in corrected]
    results = []
    for number, task in enumerate(plan.file.tasks):
        progress((number + 0.2) / len(plan.file.tasks), f"pushes, task {task}")
        threshold = next(one.threshold_nm for one in found.tasks if one.task == task)
        results.append(_one_task(plan, task, corrected, cut, own_rate, threshold))
    return results


def _one_task(
    plan: Plan,
    task: TaskName,
    motions: Sequence[Motion],
    cut: Sequence[int],
    configuration: Configuration,
    threshold: FloatArray,
) -> Injected:
    own = plan.on(configuration)
    first = [motion.part(0, at) for motion, at in zip(motions, cut, strict=True)]
    second = [motion.part(at, len(motion.time_s)) for motion, at in zip(motions, cut, strict=True)]
    unknown = comparison(own, task, {})
    nothing = [_still(motion) for motion in first]
    quiet = [_simulate(plan, unknown, motion, task, rows)[-1] for motion, rows in zip(first, nothing, strict=True)]
    n, channels = configuration.robot.n, configuration.channels
    maxima = np.stack([one["free_max"] for one in quiet]).max(axis=0)[:, :n]
    own_maxima = np.stack([one["channel_max"] for one in quiet]).max(axis=0)[:channels, :n]
    factor = threshold / np.maximum(own_maxima, SMALLEST_THRESHOLD_NM)
    margin = float(np.median(factor))  # the same margin above its own signal for every detector
    names = [detector.name for detector in unknown.detectors]
    limits = {
        name: np.maximum(margin * maxima[k], SMALLEST_THRESHOLD_NM).tolist() for k, name in enumerate(names) if k > 0
    }
    limits[names[0]] = threshold.tolist()
    compared = comparison(own, task, {task: limits})
    free, pushed, planned = [], [], []
    for number, motion in enumerate(second):
        count = plan.file.collisions // len(second) + (number < plan.file.collisions % len(second))
        injections = _draw(plan, task, motion, number, count)
        results = _simulate(plan, compared, motion, task, np.concatenate([injections, _still(motion)]))
        free.append(results[-1:])
        pushed.append(results[:-1])
        planned.append(injections)
    return Injected(task, np.concatenate(free), np.concatenate(pushed), np.concatenate(planned), compared)


def _still(motion: Motion) -> Rows:
    """A row without a push, at the last row but one: its result is that of the recording alone."""
    rows = np.zeros(1, layout.INJECTION)
    rows["row"], rows["push_s"], rows["direction"][:, 0] = len(motion.time_s) - 1, 1.0, 1.0
    return rows


def _simulate(plan: Plan, compared: Comparison, motion: Motion, task: TaskName, injections: Rows) -> Rows:
    bench = Bench(compared.configurations, compared.detectors, numeric=plan.file.numeric)
    cycles = cycles_of(motion.time_s, compared.configurations[0].period_us)
    window_s = plan.file.collision.push_ms[1] * 1e-3 + AFTER_S
    results = bench.inject((motion.q, motion.qd, motion.tau), cycles, TASKS[task], injections, window_s)
    if len(results) < len(injections):
        raise InputError(f"{motion.name}: the guard went to FAULT, or a reading is beyond the wire")
    return results


def _draw(plan: Plan, task: TaskName, motion: Motion, number: int, count: int) -> Rows:
    """Pushes at random moments of a motion, sorted by row."""
    collision, robot = plan.file.collision, plan.configuration.robot
    rows = np.zeros(count, layout.INJECTION)
    latest = motion.duration_s - collision.push_ms[1] * 1e-3 - AFTER_S
    if latest <= 2 * WARM_UP_S:
        raise InputError(f"{motion.name}: its judged part of {motion.duration_s:.1f} s is too short for pushes")
    for k in range(count):
        rng = np.random.Generator(np.random.Philox(key=plan.file.seed, counter=[1, TASKS[task], number, k]))
        link = int(rng.integers(plan.links[0], plan.links[1] + 1)) - 1
        one = rows[k]
        one["link"], one["number"] = link, k
        one["point"] = surface_point(robot, link, rng.uniform(0, 1), rng)
        one["direction"] = unit(rng)
        one["force_n"], one["push_s"] = rng.uniform(*collision.force_n), rng.uniform(*collision.push_ms) * 1e-3
        one["row"] = int(np.searchsorted(motion.time_s, rng.uniform(1.5 * WARM_UP_S, latest)))
    return rows[np.argsort(rows["row"], kind="stable")]


def as_hits(injected: Injected, row: np.dtype[Any]) -> Rows:
    """The pushes in the format of the summary: each planned push with its result."""
    hits = np.zeros(len(injected.pushed), row)
    for name in hits.dtype.names or ():
        if name in BY_JOINT:
            hits[name] = injected.pushed[name][:, :, : hits[name].shape[2]]
        elif name in (injected.pushed.dtype.names or ()):
            hits[name] = injected.pushed[name]
    hits["stops"], hits["input_stops"], hits["free_s"] = 0, 0, 0.0  # the recording's, which its own row counts once
    hits["early_s"] = np.nan
    hits["task"], hits["push"] = TASKS[injected.task], layout.PULSE
    hits["planned_link"] = injected.injections["link"]
    hits["force_n"], hits["push_s"] = injected.injections["force_n"], injected.injections["push_s"]
    return hits
