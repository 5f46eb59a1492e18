"""A played recording as one figure: what the observer saw, and the index in force against its thresholds."""

import io
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tauperp.recording import Playback, Score

_SIZE_INCH = (11.0, 6.0)
_DPI = 110
_TOUCH = "#d9d9d9"
_STOP = "#b2182b"


def replay_figure(playback: Playback, score: Score) -> bytes:
    """A PNG: above r of every joint in Nm, below |index| as a share of its joint's threshold.

    Labelled touches are shaded. Triangles are the guard's stops: filled for a touch found, open for an alarm.
    """
    figure = Figure(figsize=_SIZE_INCH, dpi=_DPI, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    recording = playback.recording
    time = recording.time_s
    thresholds = playback.configuration.threshold_nm(playback.task)
    share = np.abs(playback.index) / thresholds
    for joint, threshold in enumerate(thresholds):
        colour, label = f"C{joint}", f"{joint + 1}: {threshold:g} Nm"
        above.plot(time, playback.residual[:, joint], color=colour, linewidth=0.9, label=label)
        below.plot(time, share[:, joint], color=colour, linewidth=0.9)
    for axes in (above, below):
        for touch in recording.touches:
            axes.axvspan(touch.start_s, touch.end_s, color=_TOUCH, linewidth=0)
        axes.margins(x=0.01)
        axes.spines[["top", "right"]].set_visible(False)
    below.axhline(1.0, color=_STOP, linewidth=1.0, linestyle="--")
    top = max(2.0, 1.1 * float(share.max()))
    below.set_ylim(0.0, top)
    _mark(below, [trip.time_s for _, trip in score.found], top, "full", "stop in a touch")
    _mark(below, [trip.time_s for trip in (*score.alarms, *score.input_stops)], top, "none", "any other stop")

    index = playback.configuration.settings.task[playback.task].index
    above.set_ylabel("r [Nm]")
    above.legend(title="joint: threshold", fontsize=8, title_fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    below.set_ylabel(f"|{index}| / threshold")
    below.set_xlabel("time [s]; touches shaded")
    if below.get_legend_handles_labels()[0]:
        below.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    above.set_title(
        f"{recording.name}, {playback.configuration.robot.name}: {len(score.found)} of {score.touches} touches found, "
        f"{len(score.alarms)} alarms in {score.idle_s:.1f} s idle",
        loc="left",
        fontsize=10,
    )
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _mark(axes: Any, times: list[float], height: float, fill: str, label: str) -> None:
    if times:
        axes.plot(
            times,
            [0.96 * height] * len(times),
            "v",
            color=_STOP,
            markersize=6,
            fillstyle=fill,
            label=label,
            clip_on=False,
        )
