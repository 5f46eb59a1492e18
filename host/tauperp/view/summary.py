"""Output of the simulating commands: progress while they run, and one table at the end."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from tauperp.experiment import Outcome
from tauperp.judge.judge import NOT_TESTED
from tauperp.provenance import provenance_line
from tauperp.run.lockstep import Progress as Report
from tauperp.words import spoken

_CAUSES = {
    "collision": "after a collision",
    "fault": "after a fault",
    "guard": "no guard answered",
    "none": "a false stop",
}
PLAIN_WIDTH = 110  # interval of the lines without a terminal
TABLE_WIDTH = 80


@contextmanager
def shown_progress(name: str) -> Iterator[Report]:
    """Progress on standard error, because standard output is for the result: a bar, or one line per phase without a
    terminal. Nothing is shown before the run has started."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _lines_reporter(name)
        return
    bar = Progress(
        TextColumn("{task.description:<52}"),
        BarColumn(bar_width=24),
        TextColumn("{task.percentage:>3.0f}%"),
        TimeElapsedColumn(),
        console=console,
    )
    task = bar.add_task(name, total=1.0)

    def report(share: float, phase: str) -> None:
        bar.start()
        bar.update(task, completed=share, description=f"{name}: {phase}" if phase else name)

    try:
        yield report
    finally:
        bar.stop()


def _lines_reporter(name: str) -> Report:
    said = ""

    def report(share: float, phase: str) -> None:
        nonlocal said
        if phase and phase != said:
            print(f"{name}: {phase}", file=sys.stderr, flush=True)
        said = phase

    return report


def print_outcomes(outcomes: Sequence[Outcome], written: str | None = None) -> None:
    """One table over all runs. Then, one line each: what r alone would have done, and the hashes of the result."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=PLAIN_WIDTH)
    elif console.width < TABLE_WIDTH:
        console = Console(
            width=TABLE_WIDTH
        )  # a narrow terminal wraps lines; a table that fits it would lose its figures
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for heading in ("run", "collision", "force", "contact", "stop", "latency", "found by"):
        table.add_column(heading, justify="left" if heading in ("run", "collision", "found by") else "right")
    for outcome in outcomes:
        report = outcome.report
        for number, collision in enumerate(report["collisions"]):
            table.add_row(_name(report) if number == 0 else "", *_row(collision))
    if table.row_count:
        console.print(table)
    for outcome in outcomes:
        for line in _lines(outcome.report):
            console.print(line, highlight=False, soft_wrap=True)
    if written:
        console.print(f"written: {written}", highlight=False, soft_wrap=True)


def _name(report: dict[str, Any]) -> str:
    return str(report.get("experiment", report["scenario"]))


def _row(collision: dict[str, Any]) -> tuple[str, ...]:
    where = f"link {collision['link']}, {collision['part']}"
    if collision["contact_s"] is None:
        return where, "", "never", "", "", "[yellow]not tested[/yellow]"
    force, contact = (f"{collision['peak_force_n']:.0f} N", f"{collision['contact_s']:.3f} s")
    if not collision["detected"]:
        colour = "yellow" if collision["verdict"] == NOT_TESTED else "red"
        return where, force, contact, "", "", f"[{colour}]{collision['verdict']}[/{colour}]"
    stop, latency = f"{collision['stop_s']:.3f} s", f"{collision['latency_ms']:.1f} ms"
    return where, force, contact, stop, latency, found_by(collision)


def found_by(collision: dict[str, Any]) -> str:
    """The joint whose index found it, or the reason if no joint did."""
    return f"joint {collision['joint']}" if collision["joint"] else spoken(collision["reason"])


def _lines(report: dict[str, Any]) -> Iterator[str]:
    name, alone, hashes = _name(report), report["residual_alone"], report["hashes"]
    colour = {"passed": "green", "failed": "red", "incomplete": "yellow"}[report["verdict"]]
    yield ""
    yield (
        f"[bold]{name}[/bold] [{colour}]{report['verdict']}[/{colour}]: {report['false_stops']} false stops; without a "
        f"collision the index stayed below {report['peak_index_free_nm']:.2f} Nm, r reached "
        f"{report['peak_residual_free_nm']:.2f} Nm"
    )
    for reason in report["why"]:
        yield f"  [{colour}]{reason}[/{colour}]" + ("; the robot stopped by itself" if report["ended"] else "")
    limit = report["threshold_nm"]
    if alone["false_stops"]:
        yield (
            f"  the same threshold of {limit} Nm on r alone would have stopped the robot {alone['false_stops']} times "
            f"without a collision, first at {alone['first_s']:.3f} s"
        )
    else:
        yield f"  the same threshold of {limit} Nm on r alone would not have stopped the robot without a collision"
    for fault in report["faults"]:
        stopped = f"stopped after {fault['latency_ms'] or 0.0:.0f} ms by {spoken(fault['reason'] or '')}"
        done = stopped if fault["verdict"] == "stopped" else fault["verdict"]
        yield f"  fault '{fault['kind']}' of joint {fault['joint']} at {fault['start_s']:.3f} s: {done}"
    for stop in report["stops"]:
        again = stop["permitted_again_s"]
        back = "did not come back" if again is None else f"came back at {again:.3f} s"
        joint = f", joint {stop['joint']}" if stop["joint"] else ""
        why = f"{spoken(stop['reason'])}{joint}; {_CAUSES[stop['cause']]}"
        yield f"  permission ended at {stop['time_s']:.3f} s ({why}) and {back}"
    for line in report["assumed"]:
        yield f"  assumed: {line}"
    if "real_time" in report:
        yield f"  {_real_time(report['real_time'])}"
    if report["guard"]["whose"] == "bus":
        yield "  the guard is the bus's: " + "; ".join(report["guard"]["differences"] or ["configured as the scenario"])
    about = f"{report['robot']}, {report['rate_hz']:g} Hz {report['format']}, seed {report['seed']}"
    yield f"  {about}; {provenance_line(hashes)}"


def _real_time(kept: dict[str, Any]) -> str:
    """How well the pace was kept, with deviations in red."""
    late, silent = kept["late_cycles"], kept["permission_not_in_time"]
    slower = kept["times_slower_than_real"]
    return (
        f"real time, {kept['period_us']} us: {_red(late)} of {kept['cycles']} cycles began late by more than half a "
        f"period (p99 {kept['p99_lateness_us']:.0f} us, at most {kept['largest_lateness_us']:.0f} us), "
        f"{_red(kept['skipped_periods'])} periods skipped, {_red(silent)} times no permission in time; "
        f"took {1.0 if slower is None else slower:.3f} of its time"
    )


def _red(count: int) -> str:
    return f"[red]{count}[/red]" if count else "0"
