"""The smallest detectable force, drawn on the arm: one picture per task, and the covered body regions."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from tauperp.plot import INK, png_of
from tauperp.robot import Robot
from tauperp.sensitivity.analysis import BLIND_N, Levers, TaskForces
from tauperp.sensitivity.regions import REGIONS

BLIND = "#4b4f57"
BLIND_RGBA = (0.29, 0.31, 0.34, 1.0)
DPI = 130
LOWEST_N, HIGHEST_N = 5.0, BLIND_N
ARROW_M = 0.22


def sensitivity_figure(robot: Robot, posture: np.ndarray, tasks: list[TaskForces], content: dict[str, Any]) -> bytes:
    """PNG. The arm is drawn in `posture` (n,); colours are medians over all postures."""
    figure = Figure(figsize=(5.4 * len(tasks) + 0.8, 9.4), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, len(tasks), height_ratios=(1.5, 1.0))
    levers = Levers(robot)
    levers.place(posture)
    norm, colours = LogNorm(LOWEST_N, HIGHEST_N), colormaps["RdYlGn_r"]
    for column, task in enumerate(tasks):
        axis = figure.add_subplot(grid[0, column], projection="3d")
        assert isinstance(axis, Axes3D)
        _arm(axis, levers, robot, task, norm, colours)
        _regions(figure.add_subplot(grid[1, column]), content["tasks"][column])
    figure.suptitle(
        f"{robot.name}: median of the smallest detected static force, N; arrows: the hardest direction to detect",
        fontsize=13,
        color=INK,
        x=0.01,
        ha="left",
    )
    return png_of(figure)


def _arm(axis: Axes3D, levers: Levers, robot: Robot, task: TaskForces, norm: LogNorm, colours: Any) -> None:
    axis.set_title(f"task {task.task} ({task.index})", fontsize=11, color=INK)
    points = [np.zeros(3)]
    for link in range(robot.n):
        low, high, radius = levers.capsule(link)
        median = float(np.median(task.links[link].static_n))
        colour = BLIND if median > BLIND_N else colours(norm(max(median, LOWEST_N)))
        axis.plot(*np.stack([low, high]).T, color=colour, linewidth=120 * radius, solid_capstyle="round", zorder=2)
        middle = (low + high) / 2
        points += [low, high]
        text = f"{link + 1}: " + (f">{BLIND_N:.0f}" if median > BLIND_N else f"{median:.0f}")
        axis.text(*(middle + np.array([0.09, 0.0, 0.02])), text, fontsize=9.5, color=INK, zorder=5)
        arrow = ARROW_M * task.blindest[link]
        axis.quiver(*(middle - arrow), *arrow, color=INK, linewidth=1.0, arrow_length_ratio=0.25, zorder=4)
    cloud = np.array(points)
    centre, span = (cloud.max(axis=0) + cloud.min(axis=0)) / 2, float(np.ptp(cloud, axis=0).max()) / 2 + 0.12
    axis.set_xlim(centre[0] - span, centre[0] + span)
    axis.set_ylim(centre[1] - span, centre[1] + span)
    axis.set_zlim(centre[2] - span, centre[2] + span)
    axis.set_box_aspect((1, 1, 1), zoom=1.2)
    axis.view_init(elev=16, azim=-62)
    axis.tick_params(labelsize=7)


def text_colour(percent: float) -> str:
    """A text colour that is readable on the map's dark ends."""
    return "white" if percent < 12 or percent > 93 else INK


def _regions(axis: Axes, task: dict[str, Any]) -> None:
    """Share of cases in which a region's quasi-static limit is detected, and below it the transient one."""
    shares = np.array(
        [[100 * link["regions"][region.name]["quasi_static"] for region in REGIONS] for link in task["links"]]
    )
    transient = np.array(
        [[100 * link["regions"][region.name]["transient"] for region in REGIONS] for link in task["links"]]
    )
    axis.imshow(shares, cmap="RdYlGn", vmin=0, vmax=100, aspect="auto")
    for i in range(shares.shape[0]):
        for j in range(shares.shape[1]):
            text = f"{shares[i, j]:.0f} | {transient[i, j]:.0f}"
            axis.text(j, i, text, ha="center", va="center", fontsize=7.5, color=text_colour(shares[i, j]))
    axis.set_xticks(range(len(REGIONS)), [f"{region.name}\n{region.limit_n:.0f} N" for region in REGIONS], fontsize=7.5)
    axis.set_yticks(range(shares.shape[0]), [f"link {link['link']}" for link in task["links"]], fontsize=9)
    axis.set_title("seen, % of cases: quasi-static | 50 ms, twice the limit", fontsize=9.5, color=INK, loc="left")
