"""A run as a picture: the experiments like the paper's figures, and any other scenario in the same way."""

import numpy as np

from tauperp.config import TASKS
from tauperp.experiment import Outcome
from tauperp.judge.result import Collision, Judgement, Loss, reason_name
from tauperp.plot import MUTED
from tauperp.run.trace import Trace
from tauperp.view.timeline import ALARM, CONTACT, Mark, Span, Timeline, draw
from tauperp.words import spoken

TITLES = {
    "payload": "Handling a payload that the guard does not know",
    "contact": "Guided by hand, struck on the body",
}
SYMBOLS = {"off": "d", "r": "r", "d_p": "d_p", "d_e": "d_e"}


def run_figure(outcome: Outcome) -> bytes:
    """The run as PNG."""
    return draw(timeline_of(outcome))


def timeline_of(outcome: Outcome) -> Timeline:
    """The run in the format of the picture."""
    trace, judgement, about = outcome.trace, outcome.judgement, outcome.judgement.installation
    name = TITLES.get(judgement.experiment or "", about.scenario.removesuffix(".toml"))
    return Timeline(
        title=f"{name}  ·  {about.robot}, seed {about.seed}",
        time_s=trace.time_s,
        residual_nm=trace.residual_nm,
        index_nm=trace.index_nm,
        threshold_nm=trace.threshold_nm,
        permitted=trace.permitted,
        symbol=_symbol(outcome),
        verdict=judgement.verdict,
        why=judgement.why,
        stops=tuple(_stop(loss, judgement.collisions) for loss in judgement.losses) + tuple(_missed(judgement)),
        touches=tuple(_touches(trace)),
        forces=tuple(
            Mark(one.contact_s, f"{one.peak_force_n:.0f} N, {one.part}", colour=CONTACT)
            for one in judgement.collisions
            if one.contact_s is not None
        ),
        phases=tuple(_phases(outcome)),
        contact_n=trace.contact_n,
        guiding_n=trace.guiding_n,
        unusable=trace.unusable,
        says=(
            f"r: up to {judgement.peaks.largest_residual_nm:.2f} Nm while nothing was wrong",
            f"index: up to {judgement.peaks.largest_index_nm:.2f} Nm while nothing was wrong",
        ),
    )


def _symbol(outcome: Outcome) -> str:
    settings = outcome.scenario.configuration.settings
    used = {settings.task[name].index for name, wire in TASKS.items() if wire in outcome.trace.task}
    return SYMBOLS.get(used.pop(), "d") if len(used) == 1 else "d"


def _stop(loss: Loss, collisions: tuple[Collision, ...]) -> Mark:
    stop = loss.stop
    who = f"joint {stop.joint}" if stop.joint else ""
    reason = spoken(reason_name(stop))
    if loss.cause == "none":
        return Mark(stop.time_s, f"FALSE STOP: {reason}\n{who}", stop.joint)
    found = next((one.latency_ms for one in collisions if one.stop is stop), None)
    if found is not None:
        return Mark(stop.time_s, f"stop after {found:.0f} ms\n{who or reason}", stop.joint)
    return Mark(stop.time_s, f"{reason}\n{who}", stop.joint)


def _missed(judgement: Judgement) -> list[Mark]:
    marks = []
    for one in judgement.collisions:
        if one.contact_s is not None and one.stop is None:
            missed = one.verdict == "missed"
            text = f"MISSED: link {one.link}" if missed else f"not tested:\nlink {one.link}"
            marks.append(Mark(one.contact_s, text, colour=ALARM if missed else MUTED))
    return marks


def _touches(trace: Trace) -> list[Span]:
    spans = []
    for contact in trace.contacts:
        begin, end = contact.record.contact_s, contact.record.release_s
        if begin is not None and end is not None:
            spans.append(Span(begin, end))
    return spans


def _phases(outcome: Outcome) -> list[Span]:
    spans, trace = [], outcome.trace
    for number, phase in enumerate(outcome.scenario.phases):
        rows = np.flatnonzero(trace.phase == number)
        if len(rows):
            spans.append(Span(float(trace.time_s[rows[0]]), float(trace.time_s[rows[-1]]), phase.name))
    return spans
