"""Output of the simulating commands: progress while they run, and one table at the end."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from tauperp.experiment import Outcome
from tauperp.judge.report import threshold_of
from tauperp.judge.result import NOT_TESTED, Collision, FaultEffect, Judgement, Loss, reason_name
from tauperp.provenance import provenance_line
from tauperp.run.lockstep import Progress as Report
from tauperp.run.pace import Kept
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
        judgement = outcome.judgement
        for number, collision in enumerate(judgement.collisions):
            table.add_row(judgement.name if number == 0 else "", *_row(collision))
    if table.row_count:
        console.print(table)
    for outcome in outcomes:
        for line in _lines(outcome.judgement):
            console.print(line, highlight=False, soft_wrap=True)
    if written:
        console.print(f"written: {written}", highlight=False, soft_wrap=True)


def _row(collision: Collision) -> tuple[str, ...]:
    where = f"link {collision.link}, {collision.part}"
    if collision.contact_s is None:
        return where, "", "never", "", "", "[yellow]not tested[/yellow]"
    force, contact = (f"{collision.peak_force_n:.0f} N", f"{collision.contact_s:.3f} s")
    if collision.stop is None or collision.latency_ms is None:
        colour = "yellow" if collision.verdict == NOT_TESTED else "red"
        return where, force, contact, "", "", f"[{colour}]{collision.verdict}[/{colour}]"
    stop, latency = f"{collision.stop.time_s:.3f} s", f"{collision.latency_ms:.1f} ms"
    return where, force, contact, stop, latency, _found_by(collision)


def _found_by(collision: Collision) -> str:
    """The joint whose index detected it, the reason if no joint did, or nothing if it was not detected."""
    if collision.stop is None:
        return ""
    return f"joint {collision.stop.joint}" if collision.stop.joint else spoken(reason_name(collision.stop))


def _lines(judgement: Judgement) -> Iterator[str]:
    alone, about = judgement.residual_alone, judgement.installation
    colour = {"passed": "green", "failed": "red", "incomplete": "yellow"}[judgement.verdict]
    yield ""
    yield (
        f"[bold]{judgement.name}[/bold] [{colour}]{judgement.verdict}[/{colour}]: {judgement.false_stops} false stops; "
        f"without a collision the index stayed below {judgement.peaks.largest_index_nm:.2f} Nm, r reached "
        f"{judgement.peaks.largest_residual_nm:.2f} Nm"
    )
    for reason in judgement.why:
        yield f"  [{colour}]{reason}[/{colour}]" + ("; the robot stopped without the guard" if judgement.ended else "")
    limit = threshold_of(judgement)
    if alone.first_s is not None:
        yield (
            f"  the same threshold of {limit} Nm on r alone would have stopped the robot {alone.false_stops} times "
            f"without a collision, first at {alone.first_s:.3f} s"
        )
    else:
        yield f"  the same threshold of {limit} Nm on r alone would not have stopped the robot without a collision"
    yield from map(_fault_line, judgement.faults)
    yield from map(_loss_line, judgement.losses)
    for line in about.assumed:
        yield f"  assumed: {line}"
    if judgement.real_time is not None:
        yield f"  {_real_time(judgement.real_time)}"
    if about.guard is not None:
        yield "  the guard is the bus's: " + "; ".join(about.differences or ["configured as the scenario"])
    run = f"{about.robot}, {about.rate_hz:g} Hz {about.format}, seed {about.seed}"
    yield f"  {run}; {provenance_line(about.hashes)}"


def _fault_line(effect: FaultEffect) -> str:
    done: str = effect.verdict
    if effect.stop is not None and effect.latency_ms is not None:
        done = f"stopped after {effect.latency_ms:.0f} ms by {spoken(reason_name(effect.stop))}"
    fault = effect.fault
    return f"  fault '{fault.kind}' of joint {fault.joint} at {fault.start_s:.3f} s: {done}"


def _loss_line(loss: Loss) -> str:
    again, stop = loss.permitted_again_s, loss.stop
    back = "did not return" if again is None else f"returned at {again:.3f} s"
    joint = f", joint {stop.joint}" if stop.joint else ""
    why = f"{spoken(reason_name(stop))}{joint}; {_CAUSES[loss.cause]}"
    return f"  permission ended at {stop.time_s:.3f} s ({why}) and {back}"


def _real_time(kept: Kept) -> str:
    """How well the pace was kept, with deviations in red."""
    slower = kept.times_slower_than_real
    return (
        f"real time, {kept.period_us} us: {_red(kept.late_cycles)} of {kept.cycles} cycles began late by more than "
        f"half a period (p99 {kept.p99_lateness_s * 1e6:.0f} us, at most {kept.largest_lateness_s * 1e6:.0f} us), "
        f"{_red(kept.skipped_periods)} periods skipped, {_red(kept.permission_not_in_time)} times no permission in "
        f"time; took {1.0 if slower is None else slower:.3f} of its time"
    )


def _red(count: int) -> str:
    return f"[red]{count}[/red]" if count else "0"
