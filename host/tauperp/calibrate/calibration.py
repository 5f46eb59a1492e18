"""From motions without touches to thresholds, with their evidence and what the data do not cover."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tauperp.busload import worst_case_load
from tauperp.calibrate import tail
from tauperp.calibrate.correction import Correction, apparent_payload, fit_correction, offset_at_rest
from tauperp.calibrate.coverage import coverage
from tauperp.calibrate.explained import Explained, explained
from tauperp.calibrate.joints import check_joints
from tauperp.calibrate.sources import Motion
from tauperp.config import LOAD_LIMIT, TASKS, Configuration, Numeric
from tauperp.config.configuration import SETTLING, THRESHOLD_SHARE
from tauperp.errors import InputError
from tauperp.intervals import poisson
from tauperp.kernel.bench import Bench, cycles_of
from tauperp.recording.offsets import refuse_payload

FloatArray = npt.NDArray[np.float64]

WARM_UP_S = 1.0  # of each motion, in which the observer finds the sensors' offsets
BLOCK_S = 0.5  # longer than the memory of any filter here
FEWEST_BLOCKS = 16  # in the part that is fitted
SPEED_PAYS = 0.15  # a term in speed is reported if it lowers a threshold by this share
MOST_OF_LIMIT = 0.99  # of the allowed maximum


@dataclasses.dataclass(frozen=True, eq=False)
class TaskCalibration:
    """Thresholds of one task. `signal`: the index over all motions. `held_out`: marks where it was not fitted."""

    task: str
    index: str
    threshold_nm: FloatArray  # (channels, n)
    fitted_maxima: FloatArray  # (blocks, channels, n)
    held_maxima: FloatArray  # (blocks, channels, n)
    expected_per_hour: float
    expected_interval: tuple[float, float]
    held_alarms: int  # blocks of the held-out part above a threshold
    held_hours: float
    held_interval: tuple[float, float]
    others: dict[str, float]  # per recording: share of its blocks above the thresholds from all other recordings
    # (n,) in the first channel: share of the block maxima's variance explained by the block's speed
    speed_share: FloatArray
    speed_gain: FloatArray  # (channels, n) by which thresholds that grow with speed would be lower on held-out data
    explained: Explained | None  # of all motions, where the task explains something

    def report(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "task": self.task,
            "index": self.index,
            "threshold_nm": self.threshold_nm.round(3).tolist(),
            "expected_alarms_per_hour": _number(self.expected_per_hour),
            "expected_interval": [_number(value) for value in self.expected_interval],
            "held_out_alarms": self.held_alarms,
            "held_out_hours": round(self.held_hours, 5),
            "held_out_alarms_per_hour_interval": [_number(value) for value in self.held_interval],
            "share_above_when_calibrated_on_the_others": {name: round(value, 4) for name, value in self.others.items()},
            "share_by_which_a_speed_term_would_lower_thresholds": self.speed_gain.round(3).tolist(),
            "explained": None if self.explained is None else self.explained.report(),
            "share_of_variance_that_speed_explains": [round(float(value), 3) for value in self.speed_share],
        }


@dataclasses.dataclass(frozen=True, eq=False)
class Calibration:
    """All results of the command."""

    configuration: Configuration  # at the recordings' rate, with the correction and the thresholds
    motions: tuple[Motion, ...]
    correction: Correction
    offset_from: str
    tasks: tuple[TaskCalibration, ...]
    coverage: dict[str, Any]
    checks: list[str]
    notes: list[str]
    wanted_per_hour: float
    hours: float  # of motion after the warm-up
    held_out: float
    writes_limits: bool  # the proposed limits are the configuration's

    @property
    def promised_per_hour(self) -> float:
        """The wanted rate, or 3 / T of the held-out part if that is higher: the data support no lower rate."""
        held = min((task.held_hours for task in self.tasks), default=0.0)
        return max(self.wanted_per_hour, tail.supported_rate(held))


def calibrate(
    motions: Sequence[Motion],
    configuration: Configuration,
    *,
    alarms_per_hour: float,
    held_out: float,
    rest: Motion | None = None,
    limits: bool = False,
    numeric: Numeric = "float32",
    progress: Callable[[float, str], None] = lambda share, phase: None,
) -> Calibration:
    """Calibrate every task that the configuration has on.

    motions         all at one rate; labelled touches are cut out
    held_out        share at the end of each motion for the judgement, 0.1 to 0.9
    rest            an arm at rest and unloaded, for the offsets; without it they come from the motions
    limits          the proposed limits of what tasks explain become the configuration's

    Raises InputError for motions that are too short, touched, or do not fit the robot.
    """
    progress(0.0, "checking the joints")
    notes: list[str] = []
    motions = _without_touches(motions, notes)
    checks = check_joints([*motions, *([rest] if rest else [])], configuration.robot)
    if rest is not None:
        rest.refuse_touches()
    at_rate = at_rate_of(motions, configuration)
    progress(0.1, "offsets and friction")
    correction, offset_from = _correct(motions, rest, at_rate, held_out, numeric, notes)
    corrected = [correction.apply(motion) for motion in motions]
    tasks = []
    numbers = at_rate.settings.task.numbers
    active = [task for task in numbers if at_rate.settings.task[task].index != "off"]
    for number, task in enumerate(active):
        progress(0.2 + 0.7 * number / len(active), f"thresholds of task {task}")
        tasks.append(_calibrate_task(task, corrected, at_rate, alarms_per_hour, held_out, numeric))
    notes += [note for one in tasks if (note := _speed_note(one)) is not None]
    sensor = {
        "offset_nm": [round(float(value), 3) for value in correction.offset_nm],
        "friction_nm": [round(float(value), 3) for value in correction.friction_nm],
    }
    rows = {name: at_rate.settings.task[name].model_dump() for name in numbers}
    for one in tasks:
        rows[one.task]["threshold_nm"] = _for_file(one.threshold_nm)
        if limits and one.explained is not None:
            rows[one.task]["limits"] |= one.explained.proposed
    own = [row for name, row in rows.items() if name not in TASKS]
    values: dict[str, Any] = {**{name: rows[name] for name in TASKS}, "more": own}
    progress(1.0, "done")
    return Calibration(
        at_rate.changed(sensor=sensor, task=values),
        tuple(motions),
        correction,
        offset_from,
        tuple(tasks),
        coverage(motions, configuration.robot),
        checks,
        notes,
        alarms_per_hour,
        sum(max(0.0, motion.duration_s - WARM_UP_S) for motion in motions) / 3600,
        held_out,
        limits,
    )


def _without_touches(motions: Sequence[Motion], notes: list[str]) -> list[Motion]:
    """The parts of the motions in which nobody touches the arm."""
    found = []
    for motion in motions:
        parts = motion.untouched_parts()
        found += parts
        if motion.touched is not None:
            left = sum(part.duration_s for part in parts)
            notes.append(
                f"{motion.name}: {left:.1f} of {motion.duration_s:.1f} s are clear of touches and used, "
                f"in {len(parts)} parts"
            )
    return found


def at_rate_of(motions: Sequence[Motion], configuration: Configuration) -> Configuration:
    """The configuration at the motions' rate, for which the thresholds hold. Uses CAN FD if a classic bus would be too
    full."""
    first = motions[0]
    for motion in motions:
        if abs(motion.period_us - first.period_us) > 0.02 * first.period_us:
            raise InputError(
                f"{motion.name}: {motion.period_us} us a row, and {first.name} has {first.period_us}: "
                "calibrate them apart"
            )
        if motion.is_mean_torque != first.is_mean_torque:
            raise InputError(f"{motion.name}: bus logs and tables of samples are not calibrated together")
    rate_hz = 1e6 / first.period_us
    form = configuration.settings.wire.format
    if worst_case_load(configuration.wire, joints=configuration.robot.n, rate_hz=rate_hz, fd=False) > LOAD_LIMIT:
        form = "fd"
    settings = configuration.settings
    healthy_ms = settings.reset.healthy_ms
    settling_ms = 1000 * SETTLING / settings.observer.gain_per_s + first.period_us / 1000  # rounded up to cycles
    sample = "interval" if first.is_mean_torque else "instant"
    return configuration.changed(
        wire={"rate_hz": rate_hz, "format": form},
        observer={"torque_sample": sample},
        sensor={"offset_nm": [0.0], "friction_nm": [0.0]},
        reset={"healthy_ms": None if healthy_ms is None else max(healthy_ms, settling_ms)},
    )


def _listen(
    motion: Motion, configuration: Configuration, task: str, numeric: Numeric
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """For each row after the warm-up: r (m, n), the index (m, channels n), coefficients of the explained part (m,
    6)."""
    bench, number = Bench([configuration], [], numeric=numeric), configuration.settings.task.numbers[task]
    heard = bench.listen((motion.q, motion.qd, motion.tau), cycles_of(motion.time_s, configuration.period_us), number)
    if heard.rows < len(motion.time_s):
        raise InputError(f"{motion.name}: row {heard.rows + 1}: a reading beyond what the wire carries")
    first = int(np.searchsorted(motion.time_s, WARM_UP_S))
    return heard.residual[first:], heard.index[first:].reshape(len(heard.index) - first, -1), heard.explained[first:]


def _behind_warm_up(motion: Motion) -> Motion:
    return motion.part(int(np.searchsorted(motion.time_s, WARM_UP_S)), len(motion.time_s))


def _correct(
    motions: Sequence[Motion],
    rest: Motion | None,
    configuration: Configuration,
    held_out: float,
    numeric: Numeric,
    notes: list[str],
) -> tuple[Correction, str]:
    task = next(name for name in TASKS if configuration.settings.task[name].index != "off")
    n, gain = configuration.robot.n, configuration.settings.observer.gain_per_s
    offset_from = "the motions"
    start = np.zeros(n)
    if rest is not None:
        own_rate = at_rate_of([rest], configuration)
        start = offset_at_rest(_behind_warm_up(rest), _listen(rest, own_rate, task, numeric)[0])
        refuse_payload(rest.name, start, rest.q.mean(axis=0), configuration.robot)
        offset_from = rest.name
    pairs = []
    for motion in motions:
        residual = _listen(motion.corrected(motion.tau - start), configuration, task, numeric)[0]
        pairs.append((_behind_warm_up(motion), residual))
    _check_length(motions, held_out)
    payload = apparent_payload(pairs, configuration.robot)
    if payload.is_there:
        notes.append(
            f"r looks like a payload of {payload.mass_kg:+.2f} kg ({100 * payload.explained:.0f} % of its variance): "
            "is something in the gripper, or is the hand missing from the model? Its weight was subtracted before the "
            "offsets were fitted; the thresholds of task none still hold it."
        )
        pairs = [(motion, residual - payload.torque(motion, configuration.robot)) for motion, residual in pairs]
    elif not payload.is_told_apart and rest is None:
        notes.append(
            "the postures are too similar to distinguish offsets from a payload: the weight of a load in the gripper "
            "is in the offsets, which are wrong in other postures"
        )
    cut = [round((1 - held_out) * len(residual)) for _, residual in pairs]
    fitted = [(motion.part(0, at), residual[:at]) for (motion, residual), at in zip(pairs, cut, strict=True)]
    judged = [
        (motion.part(at, len(residual)), residual[at:]) for (motion, residual), at in zip(pairs, cut, strict=True)
    ]
    found = fit_correction(fitted, judged, gain)
    if rest is not None:
        found = dataclasses.replace(found, offset_nm=start)
    for joint, gained in enumerate(found.viscous_gain):
        if gained > 0.05:
            notes.append(f"joint {joint + 1}: a viscous term would lower r by {100 * gained:.0f} % on held-out data")
    return found, offset_from


def _check_length(motions: Sequence[Motion], held_out: float) -> None:
    fitted_s = sum(max(0.0, (motion.duration_s - WARM_UP_S) * (1 - held_out)) for motion in motions)
    if fitted_s < FEWEST_BLOCKS * BLOCK_S:
        raise InputError(
            f"{motions[0].name}: {fitted_s:.1f} s to calibrate on are too little; "
            f"{FEWEST_BLOCKS * BLOCK_S:g} s are needed behind the first {WARM_UP_S:g} s and besides what is held out"
        )


def _calibrate_task(
    task: str,
    motions: Sequence[Motion],
    configuration: Configuration,
    alarms_per_hour: float,
    held_out: float,
    numeric: Numeric,
) -> TaskCalibration:
    block_rows = max(1, round(BLOCK_S * 1e6 / configuration.period_us))
    heard = [_listen(motion, configuration, task, numeric) for motion in motions]
    signals = [index for _, index, _ in heard]
    cut = [round((1 - held_out) * len(signal)) for signal in signals]
    fitted = [tail.block_maxima(signal[:at], block_rows) for signal, at in zip(signals, cut, strict=True)]
    judged = [tail.block_maxima(signal[at:], block_rows) for signal, at in zip(signals, cut, strict=True)]
    every = [tail.block_maxima(signal, block_rows) for signal in signals]
    maxima, held = np.concatenate(fitted), np.concatenate(judged)
    channels, n = configuration.channels, configuration.robot.n
    most = [MOST_OF_LIMIT * joint.torque_max / THRESHOLD_SHARE for joint in configuration.robot.joints]
    threshold = np.minimum(tail.thresholds(maxima, BLOCK_S, alarms_per_hour), np.tile(most, channels))
    alarms = int((held > threshold).any(axis=1).sum())
    hours = len(held) * BLOCK_S / 3600
    others = {}
    for number, motion in enumerate(motions):
        rest = [one for k, one in enumerate(every) if k != number]
        if rest:
            foreign = tail.thresholds(np.concatenate(rest), BLOCK_S, alarms_per_hour)
            others[motion.name] = float((every[number] > foreign).any(axis=1).mean())
    moved = [_behind_warm_up(motion).qd for motion in motions]
    speeds = [tail.block_maxima(qd[:at], block_rows) for qd, at in zip(moved, cut, strict=True)]
    later = [tail.block_maxima(qd[at:], block_rows) for qd, at in zip(moved, cut, strict=True)]
    gain = tail.speed_gain(
        maxima, np.tile(np.concatenate(speeds), channels), held, np.tile(np.concatenate(later), channels)
    )
    return TaskCalibration(
        task,
        configuration.settings.task[task].index,
        threshold.reshape(channels, n),
        maxima.reshape(-1, channels, n),
        held.reshape(-1, channels, n),
        tail.expected_rate(maxima, threshold, BLOCK_S),
        tail.rate_interval(maxima, threshold, BLOCK_S),
        alarms,
        hours,
        poisson(alarms, hours),
        others,
        _explained(np.concatenate(speeds), maxima[:, :n]),
        gain.reshape(channels, n),
        explained(np.concatenate([coefficients for _, _, coefficients in heard]), configuration, task),
    )


def _speed_note(one: TaskCalibration) -> str | None:
    """Reports where a velocity-dependent threshold would help. The firmware's thresholds are constant."""
    worth = np.argwhere(one.speed_gain > SPEED_PAYS)
    if not len(worth):
        return None
    joints = sorted({int(joint) + 1 for _, joint in worth})
    return (
        f"task {one.task}: thresholds that grow with speed would be up to {100 * one.speed_gain.max():.0f} % lower on "
        f"held-out data (joint {', '.join(map(str, joints))}); constant ones are written: a slower robot can have "
        "lower ones from recordings of its own"
    )


def _explained(speed: FloatArray, maxima: FloatArray) -> FloatArray:
    """Squared correlation of the block maxima with the joint's largest speed in the block, (n,)."""
    rows = min(len(speed), len(maxima))
    shares = []
    for x, y in zip(speed[:rows].T, maxima[:rows].T, strict=True):
        shares.append(0.0 if np.std(x) < 1e-6 or np.std(y) < 1e-9 else float(np.corrcoef(x, y)[0, 1]) ** 2)
    return np.array(shares)


def _for_file(thresholds: FloatArray) -> list[Any]:
    """As a configuration has them: by joint, or by channel and joint."""
    rows: list[Any] = thresholds.round(3).tolist()
    return rows[0] if len(rows) == 1 else rows


def _number(value: float) -> float | None:
    return None if math.isinf(value) or math.isnan(value) else round(value, 4)
