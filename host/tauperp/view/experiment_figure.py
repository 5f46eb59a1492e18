"""The experiments as the paper draws them: r of one joint above, the index of the same joint below, over time."""

import io
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tauperp.experiment import Outcome

INK = "#22272e"
MUTED = "#8a939e"
OTHERS = "#c9d0d8"
RESIDUAL = "#1f6fb2"
INDEX = "#0b8a6a"
ALARM = "#c8352b"
CONTACT = "#e07b1a"
BAND = "#fdece0"
PHASE_BANDS = ("#ffffff", "#f5f7f9")
DPI = 150
MAX_POINTS = 6000  # of a line; more cannot be seen


@dataclass(frozen=True)
class Panel:
    """What a figure of one experiment shows: joint (from 1), symbol of its index, and the paper's figure."""

    joint: int
    symbol: str
    title: str


PANELS = {
    "payload": Panel(4, "d_p", "Handling a payload nobody told the guard about"),
    "contact": Panel(2, "d_e", "Guided by hand, struck on the body"),
}


def experiment_figure(outcome: Outcome) -> bytes:
    """The figure as PNG. The joint drawn is the paper's, or the last one of a shorter arm."""
    panel = PANELS[outcome.report["experiment"]]
    trace = outcome.trace
    joint = min(panel.joint, outcome.scenario.robot.n)
    figure = Figure(figsize=(11, 7.6), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(3, 1, sharex=True, height_ratios=(4, 4, 1.7))
    every = max(1, len(trace.time_s) // MAX_POINTS)
    rows = slice(None, None, every)
    time = trace.time_s[rows]

    for axis, values, colour in ((axes[0], trace.residual_nm, RESIDUAL), (axes[1], trace.index_nm, INDEX)):
        _dress(axis, outcome)
        others = [number for number in range(values.shape[1]) if number != joint - 1]
        axis.plot(time, values[rows][:, others], color=OTHERS, linewidth=0.6, zorder=2)
        axis.plot(time, values[rows, joint - 1], color=colour, linewidth=1.4, zorder=4)
        for sign in (-1, 1):
            axis.plot(
                time, sign * trace.threshold_nm[rows, joint - 1], color=ALARM, linewidth=1, dashes=(5, 3), zorder=3
            )
        reach = max(1.15 * np.abs(values).max(), 1.6 * trace.threshold_nm.max())
        axis.set_ylim(-reach, reach)
    axes[0].set_ylabel(f"r, joint {joint}  [Nm]")
    axes[1].set_ylabel(f"${panel.symbol}$, joint {joint}  [Nm]")
    report = outcome.report
    _say(axes[0], f"external torque: up to {report['peak_residual_free_nm']:.1f} Nm without a collision")
    _say(axes[1], f"collision index: up to {report['peak_index_free_nm']:.2f} Nm without a collision")
    _stops(axes[1], report["collisions"])
    _legend(axes[0], joint, RESIDUAL)
    _forces(axes[2], outcome, rows)
    axes[2].set_xlabel("time  [s]")
    axes[2].set_xlim(0, trace.time_s[-1])
    _phases(axes[0], outcome)
    threshold = report["threshold_nm"]
    figure.suptitle(
        f"{panel.title}  ·  {report['robot']}, threshold {threshold} Nm, seed {report['seed']}",
        fontsize=13,
        color=INK,
        x=0.01,
        ha="left",
    )
    png = io.BytesIO()
    figure.savefig(png, format="png", metadata={"Software": None})
    return png.getvalue()


def _dress(axis: Axes, outcome: Outcome) -> None:
    axis.grid(axis="y", color="#e6eaee", linewidth=0.7)
    axis.set_axisbelow(True)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axis.spines[side].set_color(MUTED)
    axis.tick_params(colors=INK, labelsize=9)
    trace = outcome.trace
    for number in range(len(outcome.scenario.phases)):
        rows = np.flatnonzero(trace.phase == number)
        if len(rows):
            begin, end = trace.time_s[rows[0]], trace.time_s[rows[-1]]
            axis.axvspan(begin, end, color=PHASE_BANDS[number % 2], zorder=0, linewidth=0)
    for contact in trace.contacts:
        if contact.record.contact_s is not None and contact.record.release_s is not None:
            axis.axvspan(contact.record.contact_s, contact.record.release_s, color=BAND, zorder=1, linewidth=0)


def _say(axis: Axes, text: str) -> None:
    axis.text(0.008, 0.04, text, transform=axis.transAxes, fontsize=9.5, color=INK, va="bottom", zorder=6)


def _phases(axis: Axes, outcome: Outcome) -> None:
    for number, phase in enumerate(outcome.scenario.phases):
        rows = np.flatnonzero(outcome.trace.phase == number)
        if len(rows):
            middle = (outcome.trace.time_s[rows[0]] + outcome.trace.time_s[rows[-1]]) / 2
            axis.annotate(
                phase.name,
                (middle, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 5),
                textcoords="offset points",
                ha="center",
                fontsize=9.5,
                color=INK,
            )


def _stops(axis: Axes, collisions: list[dict[str, Any]]) -> None:
    for collision in collisions:
        if not collision["detected"]:
            continue
        stop = collision["stop_s"]
        axis.axvline(stop, color=ALARM, linewidth=1.1, zorder=5)
        axis.annotate(
            f"stop after {collision['latency_ms']:.0f} ms\n(joint {collision['joint']})",
            (stop, 0.97),
            xycoords=("data", "axes fraction"),
            xytext=(6, 0),
            textcoords="offset points",
            va="top",
            fontsize=9,
            color=ALARM,
            zorder=6,
        )


def _legend(axis: Axes, joint: int, colour: str) -> None:
    handles = [
        axis.plot([], [], color=colour, linewidth=1.4, label=f"joint {joint}")[0],
        axis.plot([], [], color=OTHERS, linewidth=1, label="other joints")[0],
        axis.plot([], [], color=ALARM, linewidth=1, dashes=(5, 3), label="threshold")[0],
        axis.fill_between([], [], color=BAND, label="contact"),
    ]
    axis.legend(handles=handles, loc="upper left", ncols=4, fontsize=8.5, frameon=False, labelcolor=INK)


def _forces(axis: Axes, outcome: Outcome, rows: slice) -> None:
    trace = outcome.trace
    _dress(axis, outcome)
    time = trace.time_s[rows]
    axis.fill_between(time, trace.contact_n[rows], color=CONTACT, alpha=0.35, linewidth=0, zorder=3)
    axis.plot(time, trace.contact_n[rows], color=CONTACT, linewidth=1.1, zorder=4)
    if trace.guiding_n.any():
        axis.plot(time, trace.guiding_n[rows], color=MUTED, linewidth=1.3, zorder=3)
        peak = int(np.argmax(trace.guiding_n[rows]))
        axis.annotate("guiding", (time[peak], trace.guiding_n[rows][peak]), xytext=(0, 3), textcoords="offset points",
                      fontsize=9, color=MUTED, va="bottom")  # fmt: skip
    for collision in outcome.report["collisions"]:
        if collision["contact_s"] is not None:
            axis.annotate(
                f"{collision['peak_force_n']:.0f} N, {collision['part']}",
                (collision["contact_s"], collision["peak_force_n"]),
                xytext=(-5, -1),
                textcoords="offset points",
                ha="right",
                va="top",
                fontsize=9,
                color=CONTACT,
            )
    axis.set_ylim(0, 1.15 * max(trace.contact_n.max(), trace.guiding_n.max(), 1.0))
    axis.set_ylabel("force  [N]")
