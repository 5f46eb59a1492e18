"""Shared parts of all figures: colours, axes and PNG."""

import io
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure

INK, MUTED, GRID = "#22272e", "#8a939e", "#e6eaee"


def dress(axis: Axes, title: str = "", grid: Literal["both", "x", "y"] = "both") -> None:
    """The look of every plot: light grid lines behind the data, no frame at the top and at the right."""
    if title:
        axis.set_title(title, fontsize=10.5, color=INK, loc="left")
    axis.grid(axis=grid, color=GRID, linewidth=0.7)
    axis.set_axisbelow(True)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axis.spines[side].set_color(MUTED)
    axis.tick_params(colors=INK, labelsize=9)


def png_of(figure: Figure) -> bytes:
    """PNG without the name of the software, so that equal figures are equal bytes."""
    png = io.BytesIO()
    figure.savefig(png, format="png", metadata={"Software": None})
    return png.getvalue()
