"""A run as a recording for rerun's viewer: `--rerun FILE.rrd`.

    joint1 ... jointN / r_nm, d_nm, threshold_nm     every cycle
    permission (1 or 0), contact_n                   every cycle
    robot / links, joints                            the arm as a line with points, 25 times a second, tripped joint red

The timeline is `sim_time`, seconds of the run.
"""

import contextlib
import importlib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from tauperp.errors import InputError
from tauperp.sim.model import TIP
from tauperp.sim.moment import Moment, Watch

TIMELINE = "sim_time"
POSE_S = 1 / 25
_LINK, _TRIPPED = (170, 178, 188), (217, 26, 26)


@contextlib.contextmanager
def rerun_log(path: str | Path) -> Iterator[Watch]:
    """A watch that keeps each cycle and writes the file at the end: complete, or not at all if the run fails.

    Raises InputError without the extra `rerun`; OSError if the file cannot be written.
    """
    path = Path(path)
    rerun = _rerun()
    log = _Log()
    if path.is_dir():
        raise InputError(f"{path}: is a directory")
    path.parent.mkdir(parents=True, exist_ok=True)
    yield log.watch
    beside = path.with_name(f".{path.name}.part")
    try:
        log.write(rerun, beside)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def _rerun() -> ModuleType:
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise InputError("--rerun needs the extra 'rerun' (pip install 'tauperp[rerun]')") from error


class _Log:
    """Columns are kept until the end and sent at once, because a frame per value would take longer than the run."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._torques: list[np.ndarray] = []  # (3, n) each: r, index, threshold
        self._scalars: list[tuple[float, float]] = []
        self._poses: list[tuple[float, np.ndarray, int]] = []  # time, (n + 1, 3) m, tripped joint

    def watch(self, moment: Moment) -> None:
        self._times.append(moment.time_s)
        self._torques.append(np.stack([moment.residual, moment.index, moment.threshold]))
        self._scalars.append((float(moment.permitted), moment.contact_n))
        if not self._poses or moment.time_s >= self._poses[-1][0] + POSE_S - 1e-9:
            self._poses.append((moment.time_s, _points(moment), moment.tripped_joint))

    def write(self, rerun: ModuleType, path: Path) -> None:
        recording = rerun.RecordingStream("tauperp")
        recording.save(path)
        if self._times:
            time = rerun.TimeColumn(TIMELINE, duration=self._times)
            torques, scalars = np.array(self._torques), np.array(self._scalars)
            for joint in range(torques.shape[2]):
                for row, name in enumerate(("r_nm", "d_nm", "threshold_nm")):
                    self._send(rerun, recording, f"joint{joint + 1}/{name}", time, torques[:, row, joint])
            for column, name in enumerate(("permission", "contact_n")):
                self._send(rerun, recording, name, time, scalars[:, column])
        for time_s, points, tripped in self._poses:
            recording.set_time(TIMELINE, duration=time_s)
            colours = [_TRIPPED if joint + 1 == tripped else _LINK for joint in range(len(points))]
            recording.log("robot/links", rerun.LineStrips3D([points], colors=[_LINK]))
            recording.log("robot/joints", rerun.Points3D(points, radii=0.03, colors=colours))
        recording.flush()
        recording.disconnect()

    @staticmethod
    def _send(rerun: ModuleType, recording: Any, name: str, time: Any, values: np.ndarray) -> None:
        rerun.send_columns(name, indexes=[time], columns=rerun.Scalars.columns(scalars=values), recording=recording)


def _points(moment: Moment) -> np.ndarray:
    """(n + 1, 3) m: every joint's origin, and the tip."""
    links = moment.model.jnt_bodyid[: len(moment.index)]
    return np.vstack([moment.data.xpos[links], moment.data.site_xpos[moment.model.site(TIP).id]])
