"""Results of the sensitivity command: JSON, a page, and a table for the terminal."""

from typing import Any

from tauperp import page
from tauperp.config import Configuration
from tauperp.firmware import load_library
from tauperp.provenance import provenance, provenance_line
from tauperp.sensitivity.analysis import BLIND_N, COVERED, DIRECTIONS, PLACES, TaskForces
from tauperp.sensitivity.regions import REGIONS, SOURCE


def report(configuration: Configuration, where: str, postures: int, tasks: list[TaskForces]) -> dict[str, Any]:
    """For sensitivity.json."""
    return {
        "robot": configuration.robot.name,
        "postures": postures,
        "where": where,
        "directions": DIRECTIONS,
        "places": list(PLACES),
        "blind_above_n": BLIND_N,
        "limits": {region.name: region.limit_n for region in REGIONS},
        "limits_source": SOURCE,
        "tasks": [
            {
                "task": one.task,
                "index": one.index,
                "threshold_nm": configuration.thresholds_nm(one.task).tolist(),
                "links": [link.report() for link in one.links],
                "blindest_direction": one.blindest.round(3).tolist(),
            }
            for one in tasks
        ],
        "hashes": provenance(load_library("float32"), configuration),
    }


def newton(value: float | None) -> str:
    return f"over {BLIND_N:.0f}" if value is None else f"{value:.0f}"


def verdict(share: float) -> str:
    """Whether a region is protected, from the share of directions, places and postures."""
    if share >= COVERED:
        return "yes"
    return "no" if share < 0.05 else f"{100 * share:.0f} %"


def lines(content: dict[str, Any]) -> list[str]:
    """For a terminal."""
    text = [
        f"{content['robot']}, {content['where']}: smallest force that is seen, N (best / median / 95 % of directions)"
    ]
    for task in content["tasks"]:
        text.append(f"task {task['task']} ({task['index']})")
        for link in task["links"]:
            static, pulse = link["static_n"], link["pulse_50ms_n"]
            columns = " / ".join(newton(static[key]) for key in ("best", "median", "p95"))
            pulses = " / ".join(newton(pulse[key]) for key in ("best", "median", "p95"))
            blind = f"blind {100 * link['blind_share']:.0f} %"
            text.append(f"  link {link['link']}  static {columns:<28} 50 ms {pulses:<28} {blind}")
    text.append(f"limits: {content['limits_source']}")
    text.append(provenance_line(content["hashes"]))
    return text


def html(content: dict[str, Any], png: bytes) -> str:
    """The page."""
    parts = [
        page.note(
            f"{content['where']}. Forces act on {len(content['places'])} places of each link from "
            f"{content['directions']} directions. A force above {content['blind_above_n']:.0f} N counts as not seen. "
            "Measured on the compiled firmware: index per torque, at rest, without sensor noise."
        ),
        page.figure(png, "Smallest force that is seen, drawn on the arm"),
    ]
    for task in content["tasks"]:
        parts.append(page.heading(f"Task {task['task']} ({task['index']}): smallest force, N"))
        rows = []
        for link in task["links"]:
            static, pulse = link["static_n"], link["pulse_50ms_n"]
            rows.append(
                [
                    f"link {link['link']}",
                    *(newton(static[key]) for key in ("best", "median", "p95")),
                    f"{100 * link['blind_share']:.0f} %",
                    *(newton(pulse[key]) for key in ("best", "median", "p95")),
                    f"{100 * link['blind_pulse_share']:.0f} %",
                    " ".join(f"{value:+.2f}" for value in task["blindest_direction"][link["link"] - 1]),
                ]
            )
        parts.append(
            page.table(
                ("", "static best", "median", "95 %", "blind", "50 ms best", "median", "95 %", "blind", "blindest way"),
                rows,
            )
        )
        names = [f"{name} {limit:.0f} N" for name, limit in content["limits"].items()]
        parts.append(page.note("Share of directions, places and postures in which the limit of a body region is seen:"))
        for kind, title in (("quasi_static", "quasi-static"), ("transient", "transient (50 ms, twice the limit)")):
            parts.append(
                page.table(
                    (title, *names),
                    [
                        [
                            f"link {link['link']}",
                            *(verdict(link["regions"][name][kind]) for name in content["limits"]),
                        ]
                        for link in task["links"]
                    ],
                )
            )
    parts.append(page.note(f"Limits: {content['limits_source']}. 'yes': {100 * COVERED:.0f} % or more."))
    parts.append(page.note(provenance_line(content["hashes"])))
    return page.page(f"Sensitivity of {content['robot']}", parts)
