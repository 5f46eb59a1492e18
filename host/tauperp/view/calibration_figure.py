"""A calibration as one figure: block maxima and thresholds of each task, and the coverage of the data."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tauperp.calibrate.calibration import Calibration, TaskCalibration
from tauperp.plot import INK, MUTED, dress, png_of

FITTED, HELD, LIMIT = "#9fb8cf", "#e07b1a", "#c8352b"
DPI = 130
REST_COLOUR = "#f3f5f7"


def calibration_figure(calibration: Calibration) -> bytes:
    """PNG."""
    tasks = calibration.tasks
    figure = Figure(figsize=(15, 2.4 + 2.9 * len(tasks)), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(len(tasks) + 1, 2, height_ratios=[1.0] * len(tasks) + [1.1])
    for row, task in enumerate(tasks):
        _maxima(figure.add_subplot(grid[row, :]), task, row == 0)
    _speeds(figure.add_subplot(grid[len(tasks), 0]), calibration)
    _ranges(figure.add_subplot(grid[len(tasks), 1]), calibration)
    names = ", ".join(motion.name for motion in calibration.motions)
    figure.suptitle(
        f"{calibration.configuration.robot.name}: thresholds from {names}, {3600 * calibration.hours:.0f} s",
        fontsize=13,
        color=INK,
        x=0.01,
        ha="left",
    )
    return png_of(figure)


def _maxima(axis: Axes, task: TaskCalibration, with_legend: bool) -> None:
    low, high = task.expected_interval
    dress(
        axis,
        f"task {task.task} ({task.index}): largest |index| in each half second; expected {task.expected_per_hour:.2g} "
        f"({low:.2g}-{high:.2g}) alarms per hour, held out {task.held_alarms} in {3600 * task.held_hours:.0f} s",
        grid="y",
    )
    rng = np.random.default_rng(0)
    channels, joints = task.threshold_nm.shape
    for column in range(channels * joints):
        joint, channel = column // channels, column % channels
        limit = float(task.threshold_nm[channel, joint])
        for values, colour, shift, name in (
            (task.fitted_maxima[:, channel, joint], FITTED, -0.17, "fitted"),
            (task.held_maxima[:, channel, joint], HELD, 0.17, "held out"),
        ):
            spread = column + 1 + shift + 0.13 * rng.uniform(-1, 1, len(values))
            axis.plot(spread, values, ".", color=colour, markersize=4, alpha=0.7, label=None if column else name)
        label = None if column else "threshold"
        axis.plot([column + 0.6, column + 1.4], [limit, limit], color=LIMIT, linewidth=1.8, label=label)
        axis.annotate(f"{limit:.2f}", (column + 1.0, 1.03 * limit), fontsize=8, color=LIMIT, ha="center", va="bottom")
    axis.set_ylabel("Nm", fontsize=9)
    axis.set_ylim(0, 1.2 * max(float(task.threshold_nm.max()), float(task.held_maxima.max(initial=0.0))))
    names = [f"joint {k + 1}" for k in range(joints)]
    axis.set_xticks([k * channels + (channels + 1) / 2 for k in range(joints)], names)
    if with_legend:
        axis.legend(fontsize=8.5, frameon=False, loc="upper right", ncols=3)


def _speeds(axis: Axes, calibration: Calibration) -> None:
    dress(axis, "seconds in each band of speed (share of the joint's limit)", grid="y")
    bands = calibration.coverage["speed_bands"]
    names = ["rest"] + [f"{100 * a:.0f}-{100 * b:.0f} %" for a, b in pairwise(bands)]
    seconds = np.array([one["seconds_in_speed_band"] for one in calibration.coverage["joints"]])
    shown = np.log10(np.maximum(seconds, 0.05))
    axis.imshow(shown, cmap="YlGn", aspect="auto", vmin=-1.3, vmax=2)
    axis.grid(visible=False)
    for joint in range(seconds.shape[0]):
        for band in range(seconds.shape[1]):
            value = seconds[joint, band]
            axis.text(band, joint, f"{value:.1f}", ha="center", va="center", fontsize=8.5, color=INK)
    axis.set_xticks(range(len(names)), names)
    axis.set_yticks(range(seconds.shape[0]), [f"joint {k + 1}" for k in range(seconds.shape[0])])


def _ranges(axis: Axes, calibration: Calibration) -> None:
    dress(axis, "poses seen, of each joint's range; number of reversals", grid="y")
    for joint, (one, limits) in enumerate(
        zip(calibration.coverage["joints"], calibration.configuration.robot.joints, strict=True)
    ):
        low, high = limits.position_min, limits.position_max
        axis.barh(joint, high - low, left=low, color=REST_COLOUR, edgecolor=MUTED, height=0.6, linewidth=0.6)
        seen = one["range_rad"]
        axis.barh(joint, seen[1] - seen[0], left=seen[0], color="#8cc9a1", height=0.6)
        axis.text(high + 0.1, joint, str(one["reversals"]), va="center", fontsize=9, color=INK)
    axis.set_yticks(
        range(len(calibration.coverage["joints"])),
        [f"joint {k + 1}" for k in range(len(calibration.coverage["joints"]))],
    )
    axis.invert_yaxis()
    axis.set_xlabel("rad", fontsize=9)
