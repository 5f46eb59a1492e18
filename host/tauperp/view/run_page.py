"""The report of a run as one self-contained HTML file: verdict, figure, film of a stop, tables, provenance."""

import base64
import html
from collections.abc import Sequence

from tauperp.errors import InputError
from tauperp.experiment import Outcome
from tauperp.judge.result import Judgement, reason_name
from tauperp.page import figure, heading, note, page, table
from tauperp.provenance import provenance_line
from tauperp.run.trace import Stop
from tauperp.view.experiment_figure import run_figure
from tauperp.view.film import Camera
from tauperp.words import spoken

_COLOURS = {"passed": "#2e9e5b", "failed": "#c8352b", "incomplete": "#b07d00"}


def run_page(outcome: Outcome, camera: Camera | None = None) -> str:
    """The page. Without a camera, a stop or an off-screen renderer it has no film, and states that."""
    judgement, about = outcome.judgement, outcome.judgement.installation
    name = judgement.name
    parts = [_verdict(judgement), figure(run_figure(outcome), f"torques, index and permission of {name}")]
    parts += [*_film(judgement, camera), *_tables(judgement), *_assumptions(about.assumed)]
    run = f"{about.robot}, {about.rate_hz:g} Hz {about.format}, seed {about.seed}"
    parts.append(note(f"{run}; {provenance_line(about.hashes)}"))
    return page(f"{name}: {judgement.verdict}", parts)


def _verdict(judgement: Judgement) -> str:
    word = judgement.verdict if judgement.verdict == "passed" else judgement.verdict.upper()
    badge = (
        f'<p><span style="background:{_COLOURS[judgement.verdict]};color:#fff;padding:.25em .7em;border-radius:.3em;'
        f'font-weight:600">{word}</span></p>'
    )
    return badge + _list(judgement.why)


def _film(judgement: Judgement, camera: Camera | None) -> list[str]:
    loss = next((one for one in judgement.losses if one.cause == "collision"), None)
    loss = loss or next(iter(judgement.losses), None)
    if loss is None or camera is None:
        return []
    title = heading(f"The stop at {loss.stop.time_s:.3f} s, four times slower")
    try:
        film = camera.film(loss.stop.time_s)
    except InputError as error:
        return [title, note(f"There is no film: {error}.")]
    data = base64.b64encode(film).decode()
    return [title, f'<p><img alt="film of the stop" src="data:image/webp;base64,{data}"></p>']


def _tables(judgement: Judgement) -> list[str]:
    parts: list[str] = []
    rows: Sequence[tuple[object, ...]]
    if judgement.collisions:
        rows = [
            (f"link {one.link}, {one.part}", _number(one.contact_s, 3), f"{one.peak_force_n:.0f}",
             _time(one.stop), _number(one.latency_ms, 1), one.verdict, one.stop.joint or "" if one.stop else "",
             one.why or _reason(one.stop))
            for one in judgement.collisions
        ]  # fmt: skip
        struck = ("collision", "contact s", "force N", "stop s", "latency ms", "verdict", "joint", "why")
        parts += [heading("Collisions"), table(struck, rows)]
    if judgement.faults:
        rows = [
            (f"{one.fault.kind}, joint {one.fault.joint}", _number(one.fault.start_s, 3), _number(one.end_s, 3),
             one.verdict, _number(one.latency_ms, 1), one.why or _reason(one.stop))
            for one in judgement.faults
        ]  # fmt: skip
        parts += [heading("Faults"), table(("fault", "from s", "to s", "verdict", "latency ms", "why"), rows)]
    if judgement.losses:
        rows = [
            (f"{one.stop.time_s:.3f} s", _reason(one.stop), one.stop.joint or "", one.cause,
             one.stop.trip_number or "", _number(one.permitted_again_s, 3))
            for one in judgement.losses
        ]  # fmt: skip
        head = ("permission ended", "reason", "joint", "cause", "trip", "permitted again s")
        parts += [heading("Stops"), table(head, rows)]
    peaks = zip(judgement.peaks.index_nm, judgement.peaks.residual_nm, strict=True)
    rows = [(f"joint {joint}", f"{index:.3f}", f"{residual:.3f}") for joint, (index, residual) in enumerate(peaks, 1)]
    parts += [heading("Largest torques while motion was permitted and nothing was wrong"),
              table(("joint", "index Nm", "r Nm"), rows)]  # fmt: skip
    rows = [
        (one.name, one.task, f"{one.payload_kg:g}", f"{one.peaks.largest_index_nm:.3f}",
         f"{one.peaks.largest_residual_nm:.3f}", f"{one.peak_tip_speed_m_s:.2f}")
        for one in judgement.phases
    ]  # fmt: skip
    return [*parts, heading("Phases"), table(("phase", "task", "payload kg", "index Nm", "r Nm", "tip m/s"), rows)]


def _assumptions(assumed: Sequence[str]) -> list[str]:
    return [heading("Assumed of the arm"), _list(assumed)] if assumed else []


def _reason(stop: Stop | None) -> str:
    return "" if stop is None else spoken(reason_name(stop))


def _time(stop: Stop | None) -> str:
    return "" if stop is None else f"{stop.time_s:.3f}"


def _list(lines: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{html.escape(line)}</li>" for line in lines) + "</ul>" if lines else ""


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
