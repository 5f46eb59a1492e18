"""The report of a run as one self-contained HTML file: verdict, figure, film of a stop, tables, provenance."""

import base64
import html
from collections.abc import Sequence
from typing import Any

from tauperp.errors import InputError
from tauperp.experiment import Outcome
from tauperp.page import figure, heading, note, page, table
from tauperp.provenance import provenance_line
from tauperp.view.experiment_figure import run_figure
from tauperp.view.film import Camera
from tauperp.words import spoken

_COLOURS = {"passed": "#2e9e5b", "failed": "#c8352b", "incomplete": "#b07d00"}


def run_page(outcome: Outcome, camera: Camera | None = None) -> str:
    """The page. Without a camera, a stop or an off-screen renderer it has no film, and states that."""
    report = outcome.report
    name = report.get("experiment", report["scenario"])
    parts = [_verdict(report), figure(run_figure(outcome), f"torques, index and permission of {name}")]
    parts += [*_film(report, camera), *_tables(report), *_assumptions(report)]
    parts.append(note(f"{report['robot']}, {report['rate_hz']:g} Hz {report['format']}, seed {report['seed']}; "
                      f"{provenance_line(report['hashes'])}"))  # fmt: skip
    return page(f"{name}: {report['verdict']}", parts)


def _verdict(report: dict[str, Any]) -> str:
    word = report["verdict"] if report["verdict"] == "passed" else report["verdict"].upper()
    badge = (
        f'<p><span style="background:{_COLOURS[report["verdict"]]};color:#fff;padding:.25em .7em;border-radius:.3em;'
        f'font-weight:600">{word}</span></p>'
    )
    return badge + _list(report["why"])


def _film(report: dict[str, Any], camera: Camera | None) -> list[str]:
    stop = next((one for one in report["stops"] if one["cause"] == "collision"), None)
    stop = stop or next(iter(report["stops"]), None)
    if stop is None or camera is None:
        return []
    title = heading(f"The stop at {stop['time_s']:.3f} s, four times slower")
    try:
        film = camera.film(stop["time_s"])
    except InputError as error:
        return [title, note(f"There is no film: {error}.")]
    data = base64.b64encode(film).decode()
    return [title, f'<p><img alt="film of the stop" src="data:image/webp;base64,{data}"></p>']


def _tables(report: dict[str, Any]) -> list[str]:
    parts: list[str] = []
    rows: Sequence[tuple[object, ...]]
    if report["collisions"]:
        rows = [
            (f"link {one['link']}, {one['part']}", _number(one["contact_s"], 3), f"{one['peak_force_n']:.0f}",
             _number(one["stop_s"], 3), _number(one["latency_ms"], 1), one["verdict"], one.get("joint") or "",
             one["why"] or spoken(one.get("reason") or ""))
            for one in report["collisions"]
        ]  # fmt: skip
        struck = ("collision", "contact s", "force N", "stop s", "latency ms", "verdict", "joint", "why")
        parts += [heading("Collisions"), table(struck, rows)]
    if report["faults"]:
        rows = [
            (f"{one['kind']}, joint {one['joint']}", _number(one["start_s"], 3), _number(one["end_s"], 3),
             one["verdict"], _number(one["latency_ms"], 1), one["why"] or spoken(one["reason"] or ""))
            for one in report["faults"]
        ]  # fmt: skip
        parts += [heading("Faults"), table(("fault", "from s", "to s", "verdict", "latency ms", "why"), rows)]
    if report["stops"]:
        rows = [
            (f"{one['time_s']:.3f} s", spoken(one["reason"]), one["joint"] or "", one["cause"], one["trip"] or "",
             _number(one["permitted_again_s"], 3))
            for one in report["stops"]
        ]  # fmt: skip
        head = ("permission ended", "reason", "joint", "cause", "trip", "permitted again s")
        parts += [heading("Stops"), table(head, rows)]
    peaks = zip(report["peak_index_free_by_joint_nm"], report["peak_residual_free_by_joint_nm"], strict=True)
    rows = [(f"joint {joint}", f"{index:.3f}", f"{residual:.3f}") for joint, (index, residual) in enumerate(peaks, 1)]
    parts += [heading("Largest torques while motion was permitted and nothing was wrong"),
              table(("joint", "index Nm", "r Nm"), rows)]  # fmt: skip
    rows = [
        (one["name"], one["task"], f"{one['payload_kg']:g}", f"{one['peak_index_free_nm']:.3f}",
         f"{one['peak_residual_free_nm']:.3f}", f"{one['peak_tip_speed_m_s']:.2f}")
        for one in report["phases"]
    ]  # fmt: skip
    return [*parts, heading("Phases"), table(("phase", "task", "payload kg", "index Nm", "r Nm", "tip m/s"), rows)]


def _assumptions(report: dict[str, Any]) -> list[str]:
    return [heading("Assumed of the arm"), _list(report["assumed"])] if report["assumed"] else []


def _list(lines: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{html.escape(line)}</li>" for line in lines) + "</ul>" if lines else ""


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
