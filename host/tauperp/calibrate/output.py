"""Results of a calibration: a TOML file for `tauperp config`, JSON, and a page for the records."""

import datetime
import json
from collections.abc import Mapping
from typing import Any

from tauperp import page
from tauperp.calibrate import explained, tail
from tauperp.calibrate.calibration import Calibration
from tauperp.config.write import changes, toml_lines
from tauperp.firmware import load_library
from tauperp.provenance import provenance, provenance_line


def robot_key(model: str, chain: Mapping[str, Any]) -> str:
    """The key `robot` of a configuration: a name or path, and the part of the file that is the arm, if it was given."""
    words = {"model": model, **chain}
    if not chain:
        return f"robot = {_word(model)}"
    return "robot = { " + ", ".join(f"{key} = {_word(value)}" for key, value in words.items()) + " }"


def _word(value: Any) -> str:
    """A string, number, list or truth value as TOML, which here is JSON."""
    return json.dumps(value, ensure_ascii=False)


def toml(calibration: Calibration, robot: str, preset: str, chain: Mapping[str, Any]) -> str:
    """The TOML file of the installation; `robot`, `chain` and `preset` as the command got them."""
    names = ", ".join(motion.name for motion in calibration.motions)
    lines = [
        f"# Thresholds by `tauperp calibrate` from {names}: {3600 * calibration.hours:.0f} s of motion.",
        f"# Wanted: {calibration.wanted_per_hour:g} false alarms per hour and task. The data promise no less than "
        f"{calibration.promised_per_hour:.3g} at 95 %.",
        *(f"# Not covered: {sentence}" for sentence in calibration.coverage["missing"]),
        "",
        robot_key(robot, chain),
        f'preset = "{preset}"',
        *toml_lines(changes(calibration.configuration, preset)),
    ]
    return "\n".join(lines) + "\n"


def report(calibration: Calibration) -> dict[str, Any]:
    """For calibration.json."""
    return {
        "robot": calibration.configuration.robot.name,
        "recordings": [
            {"name": motion.name, "seconds": round(motion.duration_s, 2), "period_us": motion.period_us}
            for motion in calibration.motions
        ],
        "hours": round(calibration.hours, 5),
        "held_out_share": calibration.held_out,
        "wanted_alarms_per_hour": calibration.wanted_per_hour,
        "promised_alarms_per_hour": round(calibration.promised_per_hour, 3),
        "offset_from": calibration.offset_from,
        "offset_nm": [round(float(value), 3) for value in calibration.correction.offset_nm],
        "friction_nm": [round(float(value), 3) for value in calibration.correction.friction_nm],
        "viscous_gain": [round(float(value), 3) for value in calibration.correction.viscous_gain],
        "tasks": [task.report() for task in calibration.tasks],
        "coverage": calibration.coverage,
        "checks": calibration.checks,
        "notes": calibration.notes,
        "hashes": provenance(load_library("float32"), calibration.configuration),
    }


def lines(calibration: Calibration) -> list[str]:
    """For a terminal."""
    text = [
        f"{'task':<9}{'index':<7}{'expected per hour':<26}{'held out':<34}thresholds Nm",
    ]
    for one in calibration.tasks:
        low, high = one.expected_interval
        expected = f"{one.expected_per_hour:.2g} ({low:.2g}-{high:.2g})"
        held = f"{one.held_alarms} in {3600 * one.held_hours:.0f} s: up to {one.held_interval[1]:.0f} per hour"
        values = " | ".join(" ".join(f"{value:.2f}" for value in row) for row in one.threshold_nm)
        text.append(f"{one.task:<9}{one.index:<7}{expected:<26}{held:<34}{values}")
        for name, share in one.others.items():
            text.append(f"         {name}: {100 * share:.0f} % of it above thresholds from the other recordings")
    text.append(
        f"offsets from {calibration.offset_from}: "
        + " ".join(f"{value:+.2f}" for value in calibration.correction.offset_nm)
        + " Nm; friction "
        + " ".join(f"{value:.2f}" for value in calibration.correction.friction_nm)
        + " Nm"
    )
    supported = tail.supported_rate(min((one.held_hours for one in calibration.tasks), default=0.0))
    text.append(
        f"{3600 * calibration.hours:.0f} s of motion: without an alarm the held-out part would promise "
        f"{supported:.3g} per hour at 95 % (3 / T), even if the tail suggests less"
    )
    for one in calibration.tasks:
        if one.explained is not None:
            text += explained.lines(one.task, one.explained, written=calibration.writes_limits)
    text += calibration.notes
    missing = calibration.coverage["missing"]
    text += ["not covered:", *(f"  {sentence}" for sentence in missing)] if missing else ["covered: speed and poses"]
    return text


def html(calibration: Calibration, png: bytes) -> str:
    """The page."""
    content = report(calibration)
    joints = calibration.configuration.robot.joints
    parts = [
        page.note(
            f"{', '.join(motion.name for motion in calibration.motions)}: {3600 * calibration.hours:.0f} s of motion, "
            f"the last {100 * calibration.held_out:.0f} % of each held out. "
            f"Made {datetime.datetime.now(datetime.UTC).date().isoformat()}."
        ),
        page.figure(png, "Block maxima, thresholds and coverage"),
        page.heading("Thresholds, Nm"),
        page.table(
            ("task", *(joint.name for joint in joints)),
            [
                [f"{one.task} ({one.index}), channel {number + 1}", *(f"{value:.2f}" for value in row)]
                for one in calibration.tasks
                for number, row in enumerate(one.threshold_nm)
            ]
            + [
                ["sensor offset", *(f"{value:+.2f}" for value in calibration.correction.offset_nm)],
                ["Coulomb friction", *(f"{value:.2f}" for value in calibration.correction.friction_nm)],
            ],
        ),
        page.heading("False alarms per hour"),
        page.table(
            ("task", "wanted", "expected by the tail (95 %)", "held out", "held-out rate (95 %)"),
            [
                [
                    one.task,
                    f"{calibration.wanted_per_hour:g}",
                    f"{one.expected_per_hour:.2g} ({one.expected_interval[0]:.2g}-{one.expected_interval[1]:.2g})",
                    f"{one.held_alarms} in {3600 * one.held_hours:.0f} s",
                    f"{one.held_interval[0]:.1f}-{one.held_interval[1]:.0f}",
                ]
                for one in calibration.tasks
            ],
        ),
        page.note(
            "Thresholds are the quantiles of a generalised extreme-value tail of the largest |index| in each half "
            f"second. The held-out part without an alarm would promise {calibration.promised_per_hour:.3g} per hour "
            "at 95 % (3 / T): the rest is the tail's extrapolation."
        ),
        page.heading("What the data do not cover"),
        page.table(("joint", "not seen"), [sentence.split(": ", 1) for sentence in content["coverage"]["missing"]]),
        page.heading("Checks"),
        page.table(("joint", "against the model"), [sentence.split(": ", 1) for sentence in calibration.checks]),
        page.heading("What tasks explain of untouched motion"),
        page.table(
            ("task", "force, N", "moment, Nm", f"limits with a margin of {explained.MARGIN:g}"),
            [
                [
                    one.task,
                    f"{one.explained.force_n:.1f}",
                    f"{one.explained.moment_nm:.1f}",
                    ", ".join(f"{key} = {value:g}" for key, value in one.explained.proposed.items())
                    + (": written" if calibration.writes_limits else ": proposed"),
                ]
                for one in calibration.tasks
                if one.explained is not None
            ],
        ),
        *(page.note(sentence) for sentence in calibration.notes),
        page.note(provenance_line(content["hashes"])),
    ]
    return page.page(f"Calibration of {content['robot']}", parts)
