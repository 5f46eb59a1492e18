"""One recorded trip as a figure: r and the index of every joint around it, and which channel and task decided."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tauperp.config import TASKS
from tauperp.monitor.events import Event
from tauperp.plot import INK, png_of

STOP = "#b2182b"


def event_figure(event: Event, reason: str) -> bytes:
    """PNG. Time in ms from the trip on; the joint that tripped is drawn thick."""
    figure = Figure(figsize=(9.0, 6.6), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    above, middle, below = figure.subplots(3, 1, sharex=True, height_ratios=(3, 3, 1))
    time_ms = 1e3 * event.time_s
    for joint in range(event.residual.shape[1]):
        width = 2.4 if joint + 1 == event.joint else 0.9
        above.plot(time_ms, event.residual[:, joint], color=f"C{joint}", linewidth=width, label=f"joint {joint + 1}")
        middle.plot(time_ms, event.index[:, joint], color=f"C{joint}", linewidth=width)
    below.step(time_ms, event.channel + 1, where="post", color=INK, linewidth=1.2, label="channel")
    below.step(time_ms, event.task, where="post", color="C1", linewidth=1.2, linestyle="--", label="task")
    names = {number: name for name, number in TASKS.items()}
    below.set_ylim(0.5, 4.5)
    below.set_xlabel(f"ms from the trip; task at the trip: {names.get(int(event.task[event.before]), 'not in force')}")
    for axis in (above, middle, below):
        axis.axvline(0.0, color=STOP, linewidth=1.0, linestyle="--")
        axis.spines[["top", "right"]].set_visible(False)
        axis.margins(x=0.01)
    above.set_ylabel("r [Nm]")
    middle.set_ylabel("index [Nm]")
    above.legend(fontsize=8, frameon=False, ncols=2, loc="center left", bbox_to_anchor=(1.0, 0.5))
    below.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    where = f", joint {event.joint}" if event.joint else ""
    above.set_title(f"trip {event.trip}: {reason}{where}", loc="left", fontsize=11, color=INK)
    return png_of(figure)
