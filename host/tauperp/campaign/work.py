"""A plan as pieces of work: the guards and detectors, the shards, and the computation of one shard.

The free moves come first and ignore the guard: their maxima give thresholds to every detector that has none. The judged
moves and the collisions follow, with these thresholds.
"""

import functools
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from tauperp.campaign import draw
from tauperp.campaign.plan import Plan
from tauperp.config import Configuration, TaskName, load_configuration
from tauperp.config.configuration import THRESHOLD_SHARE
from tauperp.errors import InputError
from tauperp.kernel import layout
from tauperp.kernel.bench import Bench, Rows, StopFlag
from tauperp.kernel.detectors import Detector, band_pass, other_gain

SMALLEST_THRESHOLD_NM = 0.05
LARGEST_THRESHOLD = 0.99  # of what a configuration may have
PAPER = "paper"
GUARD = "guard"

Stage = Literal["calibrate", "free", "hit"]
Thresholds = Mapping[str, Mapping[str, Any]]  # Nm, by task and detector: (n,) as a list; the guard's (channels, n)
FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Shard:
    """Runs `first` to `first + count` of a task in a stage. `name` is its file's."""

    stage: Stage
    task: TaskName
    first: int
    count: int

    @property
    def name(self) -> str:
        return f"{self.stage}-{self.task}-{self.first:08d}"


def calibrating(plan: Plan) -> int:
    """How many of a task's free moves calibrate. The others are judged."""
    return plan.file.free_moves // 2


def shards(plan: Plan, stages: tuple[Stage, ...]) -> Iterator[Shard]:
    """All shards of these stages in the order of their names."""
    spans = {
        "calibrate": (0, calibrating(plan)),
        "free": (calibrating(plan), plan.file.free_moves),
        "hit": (0, plan.file.collisions),
    }
    for stage in stages:
        for task in plan.file.tasks:
            first, end = spans[stage]
            for start in range(first, end, plan.file.shard_runs):
                yield Shard(stage, task, start, min(plan.file.shard_runs, end - start))


@dataclass(frozen=True, eq=False)
class Comparison:
    """Guards on the same frames, the plan's first, and detectors on their signals, the guard's own index first."""

    configurations: tuple[Configuration, ...]
    detectors: tuple[Detector, ...]


def comparison(plan: Plan, task: TaskName, thresholds: Thresholds) -> Comparison:
    """All detectors of a task's collisions; `thresholds` replaces theirs by name."""
    file, own = plan.file, plan.configuration
    found = {name: np.array(values) for name, values in thresholds.get(task, {}).items()}  # the guard's by channel
    n, period_s = own.robot.n, own.period_us * 1e-6
    if GUARD in found and file.thresholds.source == "free_moves":
        own = own.changed(task=_with_threshold(own, task, found[GUARD]))
    unknown = np.full(n, np.nan)
    debounce = own.settings.task[task].debounce_ticks
    configurations = [own]
    detectors = [Detector(GUARD, "own", own.thresholds_nm(task).ravel(), 0, debounce_ticks=debounce)]
    published = load_configuration(
        PAPER, robot=own.robot, overrides={"wire": {"rate_hz": own.settings.wire.rate_hz, "format": _format(own)}}
    )
    if published.settings.task[task].index == "off":
        published = published.changed(task=_with_index(published, task, "r"))
    configurations.append(published)
    gain = published.settings.observer.gain_per_s
    if file.baselines.paper:
        detectors.append(Detector(f"paper, K = {gain:g}", "own", published.threshold_nm(task), 1))
        detectors.append(Detector(f"paper's index, K = {gain:g}, calibrated", "index", unknown, 1))
    for other in file.baselines.gains_per_s:
        configurations.append(published.changed(observer={"gain_per_s": other}, reset={"healthy_ms": None}))
        name = f"paper's index, K = {other:g}, calibrated"
        detectors.append(Detector(name, "index", unknown, len(configurations) - 1))
    if file.baselines.residual:
        detectors.append(Detector(f"threshold on r, K = {gain:g}", "residual", unknown, 1))
        for other in file.baselines.gains_per_s:
            name = f"threshold on r, K = {other:g}"
            detectors.append(Detector(name, "residual", unknown, 1, other_gain(other, gain, period_s)))
    for low, high in file.baselines.bands_hz:
        sections = band_pass(low, high, period_s)
        detectors.append(Detector(f"r, {low:g} to {high:g} Hz", "residual", unknown, 1, sections))
    detectors = [one if one.is_calibrated else one.at(found.get(one.name, unknown)) for one in detectors]
    return Comparison(tuple(configurations), tuple(detectors))


def _format(configuration: Configuration) -> str:
    return configuration.settings.wire.format


def _with_threshold(configuration: Configuration, task: TaskName, threshold: FloatArray) -> dict[str, object]:
    values = np.minimum(threshold, largest_thresholds(configuration)).tolist()
    return {task: {**configuration.settings.task[task].model_dump(), "threshold_nm": values}}


def largest_thresholds(configuration: Configuration) -> FloatArray:
    """Allowed maximum of a configuration's thresholds, (n,) Nm."""
    return np.array([LARGEST_THRESHOLD * joint.torque_max / THRESHOLD_SHARE for joint in configuration.robot.joints])


def _with_index(configuration: Configuration, task: TaskName, index: str) -> dict[str, object]:
    return {task: {**configuration.settings.task[task].model_dump(), "index": index}}


def thresholds_of(maxima: FloatArray, false_share: float) -> FloatArray:
    """Thresholds (n,) Nm that this share of the moves exceeds, from the largest |signal| of each move (m, n).

    Every joint has the same share of the exceedances; the common factor is that of the moves' worst joint.
    """
    base = np.maximum(np.quantile(maxima, 1 - false_share / 2, axis=0), SMALLEST_THRESHOLD_NM)
    worst = (maxima / base).max(axis=1)
    result: FloatArray = np.maximum(base * np.quantile(worst, 1 - false_share, method="higher"), SMALLEST_THRESHOLD_NM)
    return result


class Worker:
    """Computes shards of one plan. Each calling thread gets its own bench on first use."""

    def __init__(self, plan: Plan, thresholds: Thresholds) -> None:
        self.plan = plan
        self.thresholds = thresholds
        self._local = threading.local()

    def detectors(self, task: TaskName) -> tuple[Detector, ...]:
        return comparison(self.plan, task, self.thresholds).detectors

    def compute(self, shard: Shard, runs: Rows, stop: StopFlag | None = None) -> Rows:
        """Results of some of a shard's rows."""
        return self._bench(shard.task).simulate(runs, stop)

    def rows(self, shard: Shard) -> Rows:
        """The shard's runs."""
        kind = draw.HIT if shard.stage == "hit" else draw.FREE
        runs = draw.draw(self.plan, shard.task, kind, shard.first, shard.count)
        runs["obeys"] = shard.stage != "calibrate"
        return runs

    def _bench(self, task: TaskName) -> Bench:
        benches: dict[str, Bench] = self._local.__dict__.setdefault("benches", {})
        if task not in benches:
            what = comparison(self.plan, task, self.thresholds)
            benches[task] = Bench(
                what.configurations,
                what.detectors,
                numeric=self.plan.file.numeric,
                substeps=self.plan.file.substeps,
            )
        return benches[task]


def calibrated(plan: Plan, results: Mapping[TaskName, Rows]) -> dict[str, dict[str, Any]]:
    """Thresholds of every detector that has none, and of the guard, from the calibrating moves of each task."""
    found: dict[str, dict[str, Any]] = {}
    channels, n = plan.configuration.channels, plan.configuration.robot.n
    for task, rows in results.items():
        good = rows[rows["status"] == layout.DONE]
        if len(good) < calibrating(plan) // 2:
            raise InputError(f"{plan.path}: {len(rows) - len(good)} of {len(rows)} free moves of {task!r} failed")
        names = [detector.name for detector in comparison(plan, task, {}).detectors]
        found[task] = {
            name: [round(float(value), 3) for value in thresholds_of(good["free_max"][:, k, :n], _share(plan))]
            for k, name in enumerate(names)
        }
        own = thresholds_of(good["channel_max"][:, :channels, :n].reshape(len(good), -1), _share(plan))
        found[task][GUARD] = own.reshape(channels, n).round(3).tolist()
    return found


def _share(plan: Plan) -> float:
    return plan.file.thresholds.false_moves


@functools.lru_cache(maxsize=2)
def _worker(plan_bytes: bytes, thresholds: str) -> Worker:
    """The worker of a cluster's process, made once per plan."""
    import json
    import pickle

    return Worker(pickle.loads(plan_bytes), json.loads(thresholds))


def compute_remotely(plan_bytes: bytes, thresholds: str, shard: Shard) -> bytes:
    """A whole shard in a cluster's process: the bytes of its results."""
    worker = _worker(plan_bytes, thresholds)
    results: bytes = worker.compute(shard, worker.rows(shard)).tobytes()
    return results
