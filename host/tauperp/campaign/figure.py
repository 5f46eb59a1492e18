"""A campaign as one figure: for each task the ROC, the latencies, the links, and the heat map over link and force."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tauperp.plot import INK, dress, png_of

GUARD = "#0b8a6a"
OTHERS = ("#c8352b", "#e07b1a", "#1f6fb2", "#7a5aa6", "#8a6d3b", "#5c6b7a", "#b04a86", "#3a9bb2")
DPI = 130
MOST_FALSE = 0.1  # of the ROC's axis


def campaign_figure(summaries: list[dict[str, Any]], delays: dict[str, list[np.ndarray]], title: str) -> bytes:
    """PNG. `delays`: for each task and detector the seconds from onset to excess of the found collisions."""
    figure = Figure(figsize=(18, 0.9 + 4.1 * len(summaries)), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(summaries), 4, squeeze=False, width_ratios=(1.1, 1.1, 0.9, 1.0))
    for row, summary in zip(axes, summaries, strict=True):
        _roc(row[0], summary)
        _latency(row[1], summary, delays[summary["task"]])
        _links(row[2], summary)
        _heat(row[3], summary)
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=9, frameon=False)
    figure.suptitle(title, fontsize=14, color=INK, x=0.01, ha="left")
    return png_of(figure)


def _colour(number: int) -> str:
    return GUARD if number == 0 else OTHERS[(number - 1) % len(OTHERS)]


def _roc(axis: Axes, summary: dict[str, Any]) -> None:
    dress(axis, f"task {summary['task']}: found over false moves, all thresholds scaled")
    for number, one in enumerate(summary["detectors"]):
        curve = one["roc"]
        width, front = (2.4, 5) if number == 0 else (1.1, 3)
        axis.plot(
            curve["false"], curve["found"], color=_colour(number), linewidth=width, zorder=front, label=one["detector"]
        )
        if one["false_share"] is not None and one["rate"] is not None:
            axis.plot(
                min(one["false_share"], MOST_FALSE),
                one["rate"],
                marker="o",
                markersize=6 if number == 0 else 4,
                color=_colour(number),
                zorder=6,
                clip_on=False,
            )
    axis.set_xlim(-0.002, MOST_FALSE)
    axis.set_ylim(0, 1.02)
    axis.set_xlabel("share of free moves stopped (dots: at the thresholds in force)", fontsize=9)
    axis.set_ylabel("share of collisions found", fontsize=9)


def _latency(axis: Axes, summary: dict[str, Any], delays: list[np.ndarray]) -> None:
    dress(axis, "found within this time after the first force")
    for number, (one, found) in enumerate(zip(summary["detectors"], delays, strict=True)):
        if one["of"] == 0:
            continue
        times = np.sort(1000 * found)
        width, front = (2.4, 5) if number == 0 else (1.1, 3)
        share = np.arange(1, len(times) + 1) / one["of"]
        axis.step(times, share, color=_colour(number), linewidth=width, zorder=front, where="post")
    axis.set_xlim(0, 150)
    axis.set_ylim(0, 1.02)
    axis.set_xlabel("ms", fontsize=9)
    axis.set_ylabel("share of collisions", fontsize=9)


def _links(axis: Axes, summary: dict[str, Any]) -> None:
    dress(axis, "found by link, 95 % interval")
    for place, one in enumerate(summary["by_link"]):
        rate = one["rate"] or 0.0
        axis.bar(place, 100 * rate, color="#a9d8cb", width=0.7)
        errors = [[100 * (rate - one["rate_low"])], [100 * (one["rate_high"] - rate)]]
        axis.errorbar(place, 100 * rate, yerr=np.maximum(errors, 0), color=INK, linewidth=1.2, capsize=3)
    axis.set_xticks(range(len(summary["by_link"])), [f"link {one['link']}" for one in summary["by_link"]], rotation=30)
    axis.set_ylim(0, 103)
    axis.set_ylabel("%", fontsize=9)


def _heat(axis: Axes, summary: dict[str, Any]) -> None:
    heat = summary["heat_map"]
    axis.set_title("found, % of n, by link and force", fontsize=10.5, color=INK, loc="left")
    rates = np.array([[np.nan if value is None else value for value in row] for row in heat["rate"]], float)
    if rates.size == 0:
        return
    columns = np.flatnonzero(np.array(heat["count"]).sum(axis=0) > 0)
    rates = rates[:, columns]
    axis.imshow(100 * rates, cmap="RdYlGn", vmin=0, vmax=100, aspect="auto")
    edges = heat["edges_n"]
    names = [f"{edges[c]:g}-{edges[c + 1]:g}" if c + 1 < len(edges) else f"over {edges[c]:g}" for c in columns]
    axis.set_xticks(range(len(columns)), names, fontsize=8.5)
    axis.set_yticks(range(len(heat["links"])), [f"link {link}" for link in heat["links"]], fontsize=9)
    axis.set_xlabel("N", fontsize=9)
    for i in range(rates.shape[0]):
        for j, column in enumerate(columns):
            count = heat["count"][i][column]
            if count:
                percent = 100 * rates[i, j]
                colour = "white" if percent < 12 or percent > 93 else INK
                axis.text(j, i, f"{percent:.0f}\n({count})", ha="center", va="center", fontsize=7.5, color=colour)
