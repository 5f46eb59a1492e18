"""The live view's picture: a Snapshot as lines of text that fit a terminal of 80 columns and 24 rows, or larger.

    title                       bus, format, rate, load, time
    verdict (3)                 in large letters: MOVE, STOP
    guard (2)                   state, task, singular value; times, or advice while it is stopped
    joints (1 + n)              r and d as bars; the upright line is each joint's own threshold
    stops | frames | errors     side by side
    remaining counters, versions

Green is permission only, red is no permission, grey is an old or a missing value.
"""

import datetime
from collections.abc import Sequence

from rich.text import Text

from tauperp.monitor.advice import advice, singular
from tauperp.monitor.contact import blind_words, contact_words
from tauperp.monitor.joints import joint_lines
from tauperp.monitor.snapshot import Snapshot, Stop, Traffic, spoken
from tauperp.monitor.style import ALARM, HEADING, STALE, beside, big_word, dotted, fit, room_beside

WAITING = ("SelfTest", "Waiting")  # states without permission that are not an error
CATEGORY = {"RemovePower": "0", "StopThenRemovePower": "1", "StopAndHold": "2"}  # IEC 60204-1
HELD = 65535  # saturated 16-bit counter: this much or more
NEWEST_STOPS = 6  # shown where the height is not limited


def compose(snapshot: Snapshot, source: str, width: int, height: int | None = None) -> list[Text]:
    """At most `height` lines of at most `width` columns. Without `height` all lines. Lines that do not fit are cut at
    the bottom.

    `source` names the bus.
    """
    fixed = [
        [_title(snapshot, source, width)],
        _verdict(snapshot, width),
        _guard(snapshot),
        joint_lines(snapshot, width),
    ]
    last = [_counters(snapshot), _versions(snapshot)]
    used = sum(len(block) for block in fixed) + len(last)
    frames, errors = _frames(snapshot, height is not None and height < used + 9), _errors(snapshot)
    rows = max(len(frames), len(errors), NEWEST_STOPS + 1)
    gaps = len(fixed) if height is None else max(0, min(len(fixed), height - used - rows))
    if height is not None:
        rows = max(rows, height - used - gaps)
    stops = _stops(snapshot, rows, room_beside(frames, errors, width=width))
    blocks = [*fixed, beside(stops, frames, errors, width=width), last]
    lines: list[Text] = []
    for number, block in enumerate(blocks):
        if 0 < number <= gaps:
            lines.append(Text())
        lines.extend(block)
    return [fit(line, width) for line in lines[:height]]


def _title(snapshot: Snapshot, source: str, width: int) -> Text:
    left = dotted(
        Text("tauperp monitor" if width >= 100 else "tauperp", "bold"),
        source,
        {"classic": "classic CAN", "fd": "CAN FD", None: ""}[snapshot.format],
        f"{snapshot.rate_hz:g} Hz" if snapshot.format else "",
        Text(f"bus load {snapshot.load:.0%}", ALARM if snapshot.load > 0.9 else ""),
    )
    time = datetime.datetime.fromtimestamp(snapshot.time_s).strftime("%H:%M:%S")
    left.truncate(width - len(time) - 2, overflow="ellipsis", pad=True)
    return left.append(f" {time}", STALE)


def _verdict(snapshot: Snapshot, width: int) -> list[Text]:
    """Three rows: the word, with its details on the right."""
    head, *details = _words(snapshot)
    waiting = snapshot.heard and snapshot.live("State") in WAITING
    style = "bold white on dark_green" if snapshot.permitted else "bold white on red3"
    if waiting and not snapshot.permitted:
        style = "bold white on dark_orange3"
    word = big_word("MOVE" if snapshot.permitted else "STOP")
    lines = []
    for row, text in zip(word, [head, *details, ""], strict=False):
        lines.append(Text(f"  {row}   {text}"[: max(0, width)].ljust(width), style))
    return lines


def _words(snapshot: Snapshot) -> tuple[str, str, str]:
    """State, reason, and stop category or motion."""
    if not snapshot.heard or snapshot.verdict is None:
        last = (
            "none was received yet" if snapshot.verdict is None else f"the last one {_ago(snapshot.verdict.age_s)} ago"
        )
        return "no StopCommand: silence means stop", last, ""
    verdict = snapshot.verdict.value
    state = spoken(str(snapshot.live("State") or "state not received"))
    if verdict.permitted:
        trips = f"trip {verdict.trip_number} was the last" if verdict.trip_number else "no trip so far"
        speed = "" if verdict.full_speed else " at reduced speed"
        return f"{state}: motion is permitted{speed}", f"largest index {verdict.index_nm:.2f} Nm", trips
    where = _cause(spoken(verdict.reason), verdict.joint)
    if verdict.collided:
        where += f", index {verdict.index_nm:+.2f} Nm, channel {verdict.channel + 1}"
    category = f"stop category {CATEGORY.get(verdict.category, '?')} ({spoken(verdict.category)})"
    trip = f"trip {verdict.trip_number}, {category}" if verdict.trip_number else category
    return f"{state}: motion is not permitted", where, trip


def _cause(reason: str, joint: int) -> str:
    reason = reason.replace("waiting ", "waiting for ")
    if not joint:
        return reason
    return f"{reason} {joint}" if reason.endswith("joint") else f"{reason}, joint {joint}"


def _guard(snapshot: Snapshot) -> list[Text]:
    """State, task and singular value; the times of a tick, or what to do while motion is not permitted."""
    zero, next_step = singular(snapshot), advice(snapshot)
    smallest = _known(snapshot, "SmallestSingular", "smallest singular value", "Nm/N", "{:.4f}")
    if zero:
        smallest = Text("singular value ", STALE).append(zero, "bold")
    contact = contact_words(snapshot) if snapshot.heard and not snapshot.permitted else ""
    last = contact or blind_words(snapshot)
    first = dotted(_known(snapshot, "State", "state"), _known(snapshot, "Task", "task"), smallest, last)
    if next_step:
        return [first, Text(next_step, "bold")]
    return [
        first,
        dotted(
            _known(snapshot, "TickTime", "tick", "us"),
            _known(snapshot, "WorstTickTime", "worst", "us"),
            _known(snapshot, "DeadlineMargin", "deadline margin", "us"),
        ),
    ]


def _known(snapshot: Snapshot, signal: str, name: str, unit: str = "", layout: str = "{:.0f}") -> Text:
    """A signal of GuardStatus with its name; grey when old, a dash if never received."""
    reading = snapshot.status.get(signal)
    if reading is None:
        return Text(f"{name} -", STALE)
    value = reading.value
    words = spoken(value) if isinstance(value, str) else layout.format(value)
    if value == HELD:
        words = f">= {HELD}"
    return Text(f"{name} ", STALE).append(f"{words} {unit}".rstrip(), "bold" if reading.live else STALE)


def _stops(snapshot: Snapshot, rows: int, width: int) -> list[Text]:
    """The newest stops, as many as there are rows for, below a heading."""
    wide = width >= 46
    lines = [Text(f"{'stopped':<{12 if wide else 7}} trip reason", HEADING)]
    if not snapshot.stops:
        return [*lines, Text("no stop was seen", STALE)]
    return lines + [_stop(stop, width, wide) for stop in snapshot.stops[: rows - 1]]


def _stop(stop: Stop, width: int, wide: bool) -> Text:
    time = datetime.datetime.fromtimestamp(stop.time_s)
    when = "before" if stop.earlier else time.strftime("%H:%M:%S.%f")[: 12 if wide else 8]
    where = f" J{stop.joint}" if stop.joint else ""
    value = "" if stop.index_nm is None else f" {stop.index_nm:+.2f} Nm"
    number = "-" if stop.trip_number is None else f"{stop.trip_number}"
    times = f" x{stop.times}" if stop.times > 1 else ""
    line = Text(f"{when:<{12 if wide else 8}} {number:>{4 if wide else 3}} {spoken(stop.reason)}{where}{value}{times}")
    if wide:
        line.append("  now" if stop.lasted_s is None else f"  for {_ago(stop.lasted_s)}", STALE)
    line.stylize(ALARM if stop.lasted_s is None else "")
    line.truncate(width, overflow="ellipsis")
    return line


def _frames(snapshot: Snapshot, short: bool) -> list[Text]:
    """Frames per second of each message, compared with the DBC; the joints are one row while all of them send."""
    lines = [Text("frame         Hz   of", HEADING)]
    joints = [one for one in snapshot.traffic if one.joint]
    expected = [one for one in joints if one.expected_hz is not None]
    missing = [one for one in expected if one.missing]
    for one in snapshot.traffic:
        if one.joint == 0 and (one.expected_hz is not None or not short):
            lines.append(_rate(one.name, one))
        elif one.joint == 1 and not missing:
            name = f"Joint 1..{len(expected)}" if expected else "Joint 1..8"
            lines.append(_rate(name, min(expected, key=lambda each: each.rate_hz, default=one)))
        elif one.joint == 1 and short and len(missing) > 1:
            numbers = f"{len(missing)} joints" if len(missing) == len(expected) else _numbers(missing)
            lines.append(_rate(numbers, min(missing, key=lambda each: each.rate_hz)))
        elif one in missing and (not short or len(missing) == 1):
            lines.append(_rate(f"Joint {one.joint}", one))
    return lines


def _numbers(missing: Sequence[Traffic]) -> str:
    return "Joint " + ",".join(str(one.joint) for one in missing)


def _rate(name: str, one: Traffic) -> Text:
    expected = "" if one.expected_hz is None else f"{one.expected_hz:.0f}"
    line = Text(f"{name[:11]:<11} {one.rate_hz:>4.0f} {expected:>4}")
    if one.missing:
        line.stylize(ALARM)
    elif one.rate_hz == 0:
        line.stylize(STALE)
    return line


def _errors(snapshot: Snapshot) -> list[Text]:
    """The guard's counters from GuardStatus, next to the monitor's own."""
    here = {
        "CrcErrors": snapshot.total("crc_errors"),
        "SequenceErrors": snapshot.total("sequence_errors"),
        "LostFrames": snapshot.total("lost_frames"),
        "RangeErrors": snapshot.total("range_errors"),
        "FormatErrors": snapshot.format_errors,
        "LateFrames": None,  # only the guard's own clock can detect late frames
    }
    lines = [Text("errors    guard  here", HEADING)]
    for signal, own in here.items():
        reading = snapshot.status.get(signal)
        line = Text(f"{spoken(signal).split()[0]:<9}")
        told = None if reading is None else int(reading.value)
        line.append(f"{'-' if told is None else told:>6}", _count_style(told, reading is not None and reading.live))
        line.append(f"{'-' if own is None else own:>6}", _count_style(own, True))
        lines.append(line)
    return lines


def _count_style(count: int | None, live: bool) -> str:
    if not live or not count:
        return STALE
    return "yellow"


def _counters(snapshot: Snapshot) -> Text:
    down = [Text("the interface is down", ALARM)] if snapshot.interface_down else []
    return dotted(
        *down,
        _known(snapshot, "TripCount", "trips"),
        _known(snapshot, "ResetsRefused", "resets refused"),
        _known(snapshot, "Saturations", "saturations"),
        Text(f"bus errors {snapshot.error_frames}", ALARM if snapshot.error_frames else STALE),
        Text(f"foreign frames {snapshot.foreign_frames}", STALE),
    )


def _versions(snapshot: Snapshot) -> Text:
    def raw(name: str) -> int | None:
        reading = snapshot.status.get(name)
        return None if reading is None else int(reading.value)

    version, build, crc = raw("FirmwareVersion"), raw("BuildId"), raw("ConfigCrc")
    numeric = snapshot.status.get("Numeric")
    firmware = "-" if version is None else f"{version >> 8}.{version & 0xFF}"
    if numeric is not None:
        firmware += f" {str(numeric.value).lower().replace('_', '.')}"
    return dotted(
        Text(f"firmware {firmware}", STALE),
        Text(f"build {'-' if build is None else f'{build:04x}'}", STALE),
        _known(snapshot, "WireVersion", "wire"),
        _known(snapshot, "ConfigSchema", "schema"),
        Text(f"configuration {'-' if crc is None else f'{crc:08x}'}", STALE),
    )


def _ago(seconds: float) -> str:
    """A duration in words."""
    if seconds < 10:
        return f"{seconds:.2f} s" if seconds < 1 else f"{seconds:.1f} s"
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.0f} h"
