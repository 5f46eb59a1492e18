"""One picture for every time series of the guard: an experiment, a run, a replayed log, a recording.

    above     r of every joint
    middle    the index of the active task, with its threshold
    below     forces, if they are known
    a strip   under each: green while motion is permitted, red while it is not, grey before the first permission

A joint is coloured if it stopped the robot; if none did, the one nearest to its threshold is. All others are grey. Red
is a stop, orange a contact, a cross an unusable reading.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tauperp.plot import INK, MUTED, dress, png_of

Array = NDArray[np.float64]

OTHERS = "#c9d0d8"
JOINTS = ("#1f6fb2", "#7b4fb3", "#9a6a00", "#0b7a8a")  # of the joints that stopped the robot, in that order
PERMITTED, STOPPED, NOT_YET = "#2e9e5b", "#c8352b", "#c9d0d8"
ALARM, CONTACT, BAND = "#c8352b", "#e07b1a", "#fdece0"
VERDICTS = {"passed": "#2e9e5b", "failed": "#c8352b", "incomplete": "#b07d00"}
PHASE_BANDS = ("#ffffff", "#f5f7f9")
SIZE_IN, DPI = (11.0, 7.6), 150
MAX_POINTS = 6000  # most grey lines; more are not visible
STRIP = 0.035  # of a panel's height
LEVELS, LEVEL = 3, 0.125  # rows of labels in a panel, and the height of one
LETTER = 0.0066  # width of a letter of a label, as a share of the panel's
PHASE_LINES = 3


@dataclass(frozen=True)
class Mark:
    """Something at a moment, with a label. `joint` from 1, 0 for none."""

    time_s: float
    text: str
    joint: int = 0
    colour: str = ALARM


@dataclass(frozen=True)
class Span:
    """From one moment to another, s."""

    begin_s: float
    end_s: float
    name: str = ""


@dataclass(frozen=True, eq=False)
class Timeline:
    """N ticks of n joints, Nm."""

    title: str
    time_s: Array  # (N,)
    residual_nm: Array  # (N, n)
    index_nm: Array  # (N, n)
    threshold_nm: Array  # (N, n); 0, infinite or not a number where no task is in force
    permitted: NDArray[np.bool_]  # (N,)
    symbol: str = "d"  # of the index
    verdict: str = ""  # passed, failed, incomplete; empty: there is none
    why: tuple[str, ...] = ()
    stops: tuple[Mark, ...] = ()
    touches: tuple[Span, ...] = ()  # while a person touched the arm
    forces: tuple[Mark, ...] = ()  # labels of the contact force
    phases: tuple[Span, ...] = ()
    contact_n: Array | None = None  # (N,)
    guiding_n: Array | None = None  # (N,)
    unusable: NDArray[np.bool_] | None = None  # (N, n) readings that cannot be used: frozen, out of range, not sent
    says: tuple[str, str] = ("", "")  # a line in the upper and in the middle panel
    coloured: tuple[int, ...] = field(init=False, default=())

    def __post_init__(self) -> None:
        known = np.isfinite(self.threshold_nm) & (self.threshold_nm > 0)
        object.__setattr__(self, "threshold_nm", np.where(known, self.threshold_nm, np.nan))
        joints = tuple(dict.fromkeys(stop.joint for stop in self.stops if stop.joint))[: len(JOINTS)]
        if not joints:
            with np.errstate(divide="ignore", invalid="ignore"):
                near = np.nan_to_num(np.abs(self.index_nm) / self.threshold_nm, nan=0.0, posinf=0.0)
            joints = (int(near.max(axis=0).argmax()) + 1,)
        object.__setattr__(self, "coloured", joints)

    def colour(self, joint: int) -> str:
        """Of a joint (from 1) that has one."""
        return JOINTS[self.coloured.index(joint)]


def draw(timeline: Timeline) -> bytes:
    """The picture as PNG."""
    figure = Figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    rows = (4, 4, 1.8) if timeline.contact_n is not None else (4, 4)
    axes = list(figure.subplots(len(rows), 1, sharex=True, height_ratios=rows))
    one = _one_threshold(timeline)
    scale = np.ones_like(timeline.threshold_nm) if one else timeline.threshold_nm
    for axis, values in ((axes[0], timeline.residual_nm), (axes[1], timeline.index_nm / scale)):
        _dress(axis, timeline)
        _lines(axis, timeline, values)
    for axis in axes[: 2 if one else 0] or [axes[1]]:
        _thresholds(axis, timeline, scale)
    for axis, values in ((axes[0], timeline.residual_nm), (axes[1], timeline.index_nm / scale)):
        limit = _largest(timeline.threshold_nm / scale) if one or axis is axes[1] else 0.0
        reach = max(1.1 * _largest(np.abs(values)), 1.5 * limit, 1e-3)
        axis.set_ylim(-1.15 * reach, reach * (1.9 if axis is axes[1] and timeline.stops else 1.3))
    axes[0].set_ylabel("external torque r  [Nm]")
    axes[1].set_ylabel(f"index ${timeline.symbol}$  [Nm]" if one else f"index ${timeline.symbol}$ / threshold")
    for axis, text in zip(axes[:2], timeline.says, strict=True):
        _say(axis, text)
    _unusable(axes[0], timeline)
    _stop_lines(axes, timeline)
    if timeline.contact_n is not None:
        _forces(axes[2], timeline)
    _legend(axes[0], timeline)
    _phase_names(axes[0], timeline)
    axes[-1].set_xlabel("time  [s]")
    axes[-1].set_xlim(timeline.time_s[0], timeline.time_s[-1])
    _head(figure, timeline)
    return png_of(figure)


def _one_threshold(timeline: Timeline) -> bool:
    """Whether one line in Nm is everybody's threshold: else the index is drawn as a share of it."""
    limits = timeline.threshold_nm[np.isfinite(timeline.threshold_nm).all(axis=1)]
    return len(limits) == 0 or bool(np.ptp(limits, axis=1).max() < 1e-6)


def _largest(values: Array) -> float:
    """Of the numbers among them; 0 if there is none."""
    return float(np.nanmax(values)) if np.isfinite(values).any() else 0.0


def _dress(axis: Axes, timeline: Timeline) -> None:
    dress(axis, grid="y")
    for number, phase in enumerate(timeline.phases):
        axis.axvspan(phase.begin_s, phase.end_s, color=PHASE_BANDS[number % 2], zorder=0, linewidth=0)
    for touch in timeline.touches:
        axis.axvspan(touch.begin_s, touch.end_s, color=BAND, zorder=1, linewidth=0)
    time, permitted = timeline.time_s, timeline.permitted
    begun = np.maximum.accumulate(permitted)
    for where, colour in ((permitted, PERMITTED), (~permitted & begun, STOPPED), (~begun, NOT_YET)):
        axis.fill_between(time, 0.0, STRIP, where=where.tolist(), step="post", color=colour, linewidth=0,
                          transform=axis.get_xaxis_transform(), zorder=7)  # fmt: skip


def _lines(axis: Axes, timeline: Timeline, values: Array) -> None:
    every = max(1, len(timeline.time_s) // MAX_POINTS)
    others = [joint for joint in range(values.shape[1]) if joint + 1 not in timeline.coloured]
    axis.plot(timeline.time_s[::every], values[::every][:, others], color=OTHERS, linewidth=0.6, zorder=2)
    for joint in timeline.coloured:
        axis.plot(timeline.time_s, values[:, joint - 1], color=timeline.colour(joint), linewidth=1.3, zorder=4)


def _thresholds(axis: Axes, timeline: Timeline, scale: Array) -> None:
    every = max(1, len(timeline.time_s) // MAX_POINTS)
    limit = (timeline.threshold_nm / scale)[::every]
    limit = np.where(np.isnan(limit).any(axis=1), np.nan, limit.max(axis=1))
    for sign in (-1, 1):
        axis.plot(timeline.time_s[::every], sign * limit, color=ALARM, linewidth=1, dashes=(5, 3), zorder=3)


def _say(axis: Axes, text: str) -> None:
    axis.text(0.008, STRIP + 0.02, text, transform=axis.transAxes, fontsize=9, color=INK, va="bottom", zorder=6,
              bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1.5})  # fmt: skip


def _unusable(axis: Axes, timeline: Timeline) -> None:
    """A row of crosses for every joint that has such readings, at the panel's top."""
    if timeline.unusable is None or not timeline.unusable.any():
        return
    for row, joint in enumerate(np.flatnonzero(timeline.unusable.any(axis=0))):
        times = timeline.time_s[timeline.unusable[:, joint]]
        times = times[:: max(1, len(times) // 60)]
        height = 0.84 - 0.075 * row
        axis.plot(times, np.full(len(times), height), "x", color=INK, markersize=4,
                  transform=axis.get_xaxis_transform(), zorder=8)  # fmt: skip
        late = times[-1] > 0.75 * timeline.time_s[-1] + 0.25 * timeline.time_s[0]
        axis.annotate(f"unusable readings of joint {joint + 1}", (times[0 if late else -1], height), xycoords=(
            "data", "axes fraction"), xytext=(-6 if late else 6, 0), textcoords="offset points", fontsize=8.5,
            ha="right" if late else "left", va="center", color=INK, zorder=8)  # fmt: skip


def _stop_lines(axes: Sequence[Axes], timeline: Timeline) -> None:
    for stop in timeline.stops:
        for axis in axes:
            axis.axvline(stop.time_s, color=stop.colour, linewidth=1.0, zorder=5)
    _labels(axes[1], timeline.stops, timeline.time_s)


def _labels(axis: Axes, marks: Sequence[Mark], time_s: Array, levels: int = LEVELS, level: float = LEVEL) -> None:
    """Place each label next to its time, on the first row without an overlap; on the left side near the end."""
    begin, length = float(time_s[0]), max(float(time_s[-1] - time_s[0]), 1e-9)
    taken: list[list[tuple[float, float]]] = [[] for _ in range(levels)]
    for mark in sorted(marks, key=lambda one: one.time_s):
        width = LETTER * max(len(line) for line in mark.text.splitlines()) + 0.012
        at = (mark.time_s - begin) / length
        left = at + width > 1.0
        room = (at - width, at) if left else (at, at + width)
        free = [level for level in range(levels) if all(room[1] <= a or room[0] >= b for a, b in taken[level])]
        if not free:
            continue  # its line is there; a label on another one would hide both
        taken[free[0]].append(room)
        axis.annotate(mark.text, (mark.time_s, 0.98 - level * free[0]), xycoords=("data", "axes fraction"),
                      xytext=(-5 if left else 5, 0), textcoords="offset points", ha="right" if left else "left",
                      va="top", fontsize=8.5, color=mark.colour, zorder=8,
                      bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 0.8})  # fmt: skip


def _legend(axis: Axes, timeline: Timeline) -> None:
    handles = [
        axis.plot([], [], color=timeline.colour(joint), linewidth=1.4, label=f"joint {joint}")[0]
        for joint in timeline.coloured
    ]
    if len(timeline.coloured) < timeline.residual_nm.shape[1]:
        handles.append(axis.plot([], [], color=OTHERS, linewidth=1, label="other joints")[0])
    handles.append(axis.plot([], [], color=ALARM, linewidth=1, dashes=(5, 3), label="threshold")[0])
    patches = [(BAND, "touched")] if timeline.touches else []
    patches += [(PERMITTED, "motion permitted"), (STOPPED, "not permitted")]
    fills = [axis.fill_between([], [], color=colour, label=label) for colour, label in patches]
    axis.legend(handles=[*handles, *fills], loc="upper left", ncols=len(handles) + len(fills), fontsize=8,
                frameon=False, labelcolor=INK, columnspacing=1.2, handlelength=1.6)  # fmt: skip


def _phase_names(axis: Axes, timeline: Timeline) -> None:
    length = max(float(timeline.time_s[-1] - timeline.time_s[0]), 1e-9)
    for phase in timeline.phases:
        letters = int((phase.end_s - phase.begin_s) / length / LETTER)
        if letters < 3 or not phase.name:
            continue
        lines = textwrap.wrap(phase.name, letters) or [""]
        if len(lines) > PHASE_LINES:
            lines = [
                *lines[: PHASE_LINES - 1],
                textwrap.shorten(" ".join(lines[PHASE_LINES - 1 :]), letters, placeholder="…"),
            ]
        axis.annotate("\n".join(lines), ((phase.begin_s + phase.end_s) / 2, 1.0), xycoords=("data", "axes fraction"),
                      xytext=(0, 4), textcoords="offset points", ha="center", fontsize=9, color=INK)  # fmt: skip


def _forces(axis: Axes, timeline: Timeline) -> None:
    assert timeline.contact_n is not None
    _dress(axis, timeline)
    time, force = timeline.time_s, timeline.contact_n
    axis.fill_between(time, force, color=CONTACT, alpha=0.35, linewidth=0, zorder=3)
    axis.plot(time, force, color=CONTACT, linewidth=1.0, zorder=4)
    top = max(float(force.max()), 1.0)
    marks = list(timeline.forces)
    if timeline.guiding_n is not None and timeline.guiding_n.any():
        guiding = timeline.guiding_n
        axis.plot(time, guiding, color=MUTED, linewidth=1.3, zorder=3)
        top = max(top, float(guiding.max()))
        marks.append(Mark(float(time[int(np.argmax(guiding > 0.1 * guiding.max()))]), "guiding", colour=MUTED))
    _labels(axis, marks, time, levels=2, level=0.2)
    axis.set_ylim(-0.08 * top, 1.5 * top)
    axis.set_ylabel("force  [N]")


def _head(figure: Figure, timeline: Timeline) -> None:
    """The title; right of it the verdict, below it why."""
    figure.suptitle(timeline.title, fontsize=13, color=INK, x=0.01, ha="left")
    if timeline.verdict:
        word = timeline.verdict.upper() if timeline.verdict != "passed" else "passed"
        colour = VERDICTS[timeline.verdict]
        figure.text(0.99, 0.985, word, fontsize=13, fontweight="bold", color="white", ha="right", va="top",
                    bbox={"facecolor": colour, "edgecolor": "none", "boxstyle": "round,pad=0.3"})  # fmt: skip
    if timeline.why:
        more = f" (and {len(timeline.why) - 1} more)" if len(timeline.why) > 1 else ""
        line = textwrap.shorten(timeline.why[0], 130 - len(more), placeholder=" …") + more
        figure.supxlabel(line, fontsize=10, color=VERDICTS.get(timeline.verdict, ALARM), x=0.01, ha="left")
