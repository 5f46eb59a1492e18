"""One row per joint: r and d as bars, scaled so that the thresholds of all joints are in the same column."""

from rich.text import Text

from tauperp.monitor.snapshot import JointIndex, Reading, Snapshot
from tauperp.monitor.style import ALARM, HEADING, STALE, bar

WARN = 0.7  # share of the threshold
LONGEST_BAR = 48
_LABEL, _NUMBER, _THRESHOLD, _GAP = 4, 8, 9, 3


def joint_lines(snapshot: Snapshot, width: int) -> list[Text]:
    """A heading and a row for each joint of the received GuardIndex frames; torques in Nm."""
    length = max(6, min(LONGEST_BAR, (width - _LABEL - _THRESHOLD - 2 * (1 + _NUMBER) - _GAP) // 2))
    column = length + 1 + _NUMBER
    heading = Text(
        f"{'':<{_LABEL}}{'r  external torque, Nm':<{column}}{'':{_GAP}}{'d  index in force, Nm':<{column}}"
        f"{'limit, Nm':>{_THRESHOLD}}",
        HEADING,
    )
    if not snapshot.joints:
        return [heading, Text("no GuardIndex was received", STALE)]
    stopped = 0 if snapshot.permitted or snapshot.verdict is None else snapshot.verdict.value.joint
    return [heading, *(_row(joint, reading, length, joint == stopped) for joint, reading in snapshot.joints.items())]


def _row(joint: int, reading: Reading[JointIndex], length: int, stopped: bool) -> Text:
    value, mark = reading.value, 2 * length // 3
    line = Text(f"J{joint:<{_LABEL - 1}}", STALE if not reading.live else ALARM if stopped else "")
    alarmed = abs(value.index_nm) / value.threshold_nm if value.threshold_nm else 0.0
    index_style = ALARM if alarmed > 1 else "yellow" if alarmed > WARN else "green"
    for number, (torque, style) in enumerate(((value.residual_nm, "blue"), (value.index_nm, index_style))):
        share = abs(torque) / value.threshold_nm if value.threshold_nm else 0.0
        line.append(" " * _GAP if number else "")
        line.append_text(bar(share, length, mark, style if reading.live else STALE))
        line.append(f" {torque:>+{_NUMBER}.2f}", "" if reading.live else STALE)
    return line.append(f"{value.threshold_nm:>{_THRESHOLD}.2f}", STALE)
