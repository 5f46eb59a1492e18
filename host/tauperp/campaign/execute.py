"""Runs the shards of a plan, in threads of this process or as tasks of a Dask cluster. Both resume after an
interruption."""

import concurrent.futures
import json
import os
import pickle
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tauperp.campaign.plan import Plan
from tauperp.campaign.store import Store
from tauperp.campaign.work import Shard, Thresholds, Worker, calibrated, compute_remotely, shards
from tauperp.errors import InputError
from tauperp.kernel import layout
from tauperp.kernel.bench import Rows, StopFlag

SLICE_RUNS = 20  # s between two checks for Ctrl-C
CONNECT_S = 10
IN_FLIGHT = 64  # tasks that a cluster queues at a time

_STAGES = {"calibrate": "free moves that calibrate", "free": "free moves that are judged", "hit": "collisions"}

Report = Callable[[float, str], None]


@dataclass
class Effort:
    """Number and time of the runs of this process."""

    simulated_s: float = 0.0
    wall_s: float = 0.0
    cpu_s: float = 0.0
    runs: int = 0
    workers: int = 1

    def as_dict(self) -> dict[str, float | int | None]:
        speed = self.simulated_s / self.cpu_s if self.cpu_s > 0 else None
        return {
            "runs_of_this_process": self.runs,
            "simulated_s": round(self.simulated_s, 3),
            "wall_s": round(self.wall_s, 3),
            "cpu_s": round(self.cpu_s, 3),
            "workers": self.workers,
            "times_real_time_per_core": None if speed is None else round(speed, 1),
        }


@dataclass
class Campaign:
    """One plan and its folder."""

    plan: Plan
    store: Store
    effort: Effort = field(default_factory=Effort)

    def run(self, report: Report, *, jobs: int | None = None, scheduler: str | None = None) -> Thresholds:
        """Compute everything that is missing. Returns the thresholds of the collisions.

        Raises InputError if the cluster does not answer, and OSError if the disk is full.
        """
        first = list(shards(self.plan, ("calibrate",)))
        rest = list(shards(self.plan, ("free", "hit")))
        total = sum(shard.count for shard in (*first, *rest))
        executor = _Cluster(scheduler) if scheduler else _Threads(jobs or os.cpu_count() or 1)
        self.effort.workers = executor.workers
        try:
            self.store.claim()
            self._stage(executor, first, {}, report, 0, total)
            thresholds = self.store.thresholds()
            if thresholds is None:
                thresholds = self._calibrate(first)
            self._stage(executor, rest, thresholds, report, sum(shard.count for shard in first), total)
        finally:
            executor.close()
        return thresholds

    def _calibrate(self, first: list[Shard]) -> Thresholds:
        by_task = {
            task: self.store.read([shard for shard in first if shard.task == task])
            for task in self.plan.file.tasks
            if first
        }
        thresholds = calibrated(self.plan, by_task)
        self.store.keep_thresholds(thresholds)
        return thresholds

    def _stage(
        self, executor: Any, work: list[Shard], thresholds: Thresholds, report: Report, done: int, total: int
    ) -> None:
        missing = [shard for shard in work if not self.store.has(shard)]
        done += sum(shard.count for shard in work) - sum(shard.count for shard in missing)
        worker = Worker(self.plan, thresholds)
        began, cpu = time.monotonic(), time.process_time()

        def advance(count: int, shard: Shard) -> None:
            nonlocal done
            done += count
            report(done / total, f"{_STAGES[shard.stage]}, task {shard.task}")

        for shard, runs, results in executor.run(worker, missing, advance):
            self.store.write(shard, runs, results)
            self.effort.simulated_s += float(results["simulated_s"].sum())
            self.effort.runs += len(results)
        self.effort.wall_s += time.monotonic() - began
        self.effort.cpu_s += time.process_time() - cpu


class _Threads:
    """Slices of a shard in the threads of this process. The kernel releases Python's lock."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._pool = concurrent.futures.ThreadPoolExecutor(workers)
        self._stop = StopFlag()

    def run(
        self, worker: Worker, work: Iterable[Shard], advance: Callable[[int, Shard], None]
    ) -> Iterable[tuple[Shard, Rows, Rows]]:
        for shard in work:
            runs = worker.rows(shard)
            starts = range(0, len(runs), SLICE_RUNS)
            futures = {
                self._pool.submit(worker.compute, shard, runs[at : at + SLICE_RUNS], self._stop): at for at in starts
            }
            results = np.zeros(len(runs), layout.RESULT)
            for future in concurrent.futures.as_completed(futures):
                part, at = future.result(), futures[future]
                if len(part) != len(runs[at : at + SLICE_RUNS]):
                    raise InputError("a guard of the campaign refuses its configuration")
                results[at : at + len(part)] = part
                advance(len(part), shard)
            yield shard, runs, results

    def close(self) -> None:
        self._stop.set()
        self._pool.shutdown(wait=True, cancel_futures=True)


class _Cluster:
    """Each shard is a task of a Dask scheduler. If a worker fails, another runs its tasks again."""

    def __init__(self, address: str) -> None:
        from distributed import Client

        try:
            self._client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(f"--scheduler {address}: no Dask scheduler answers there: {error}") from error
        self.workers = max(1, len(self._client.nthreads()))

    def run(
        self, worker: Worker, work: Iterable[Shard], advance: Callable[[int, Shard], None]
    ) -> Iterable[tuple[Shard, Rows, Rows]]:
        from distributed import as_completed

        plan, thresholds = pickle.dumps(worker.plan), json.dumps(worker.thresholds, sort_keys=True)
        waiting = list(reversed(list(work)))
        futures = as_completed(loop=self._client.loop)
        shard_of: dict[Any, Shard] = {}

        def submit() -> None:
            shard = waiting.pop()
            future = self._client.submit(compute_remotely, plan, thresholds, shard, pure=False, retries=5)
            shard_of[future.key] = shard
            futures.add(future)

        for _ in range(min(IN_FLIGHT, len(waiting))):
            submit()
        for future in futures:
            shard = shard_of.pop(future.key)
            results = np.frombuffer(future.result(), layout.RESULT)
            if len(results) != shard.count:
                raise InputError("a guard of the campaign refuses its configuration on the cluster")
            if waiting:
                submit()
            advance(shard.count, shard)
            yield shard, worker.rows(shard), results

    def close(self) -> None:
        self._client.close()
