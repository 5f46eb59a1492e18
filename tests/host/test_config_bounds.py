"""Every bound of a configuration block, by the firmware's own check: the last value inside passes, the next does not.

The rows name the bounds of firmware/guard/config_bounds.h and of config_bounds.c, config_filters.c and config_tasks.c.
A field without a row fails test_every_field_has_a_row.
"""

import dataclasses
import functools
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from plain import one_channel

from tauperp.config import NUMERICS, TASKS, Numeric, load_configuration
from tauperp.config.block import CRC_END, block_dtype, channel_constants
from tauperp.firmware import load_library

NONE, PAYLOAD, CONTACT = 1, 2, 3  # rows of task[]
PERIOD_US = 1000
POINT_M = 1.0  # CONFIG_POINT_MAX_M
JOINT, TASK, CHANNEL = "robot.joint", "task", "bank.channel"
Change = Callable[[Any], None]


@dataclasses.dataclass(frozen=True)
class Row:
    """A bound: the first change keeps it, the second violates it, and the check then returns `status`."""

    field: str
    status: str
    good: Change
    bad: Change


def to(path: str, value: float) -> Change:
    """Sets task.2.detector.threshold_nm.0.3 and the like, in the field's own unit."""

    def change(block: Any) -> None:
        *place, last = path.split(".")
        target = block
        for part in place:
            target = target[int(part)] if part.isdigit() else target[part]
        key: int | str = int(last) if last.isdigit() else last
        kind = target.dtype if isinstance(key, int) else target.dtype[key].base
        target[key] = round(value * 2.0**22) if kind.kind == "i" else value

    return change


def both(*changes: Change) -> Change:
    def change(block: Any) -> None:
        for one in changes:
            one(block)

    return change


def row(path: str, status: str, good: float, bad: float, *first: Change) -> Row:
    return Row(path, status, both(*first, to(path, good)), both(*first, to(path, bad)))


def rows_of_timing() -> list[Row]:
    bad = "BAD_TIMING"
    return [
        row("format", bad, 2, 3),
        row("format", bad, 1, 0),
        Row("period_us", bad, lambda block: None, to("period_us", 249)),
        Row("period_us", bad, lambda block: None, to("period_us", 50001)),
        Row("period_us", "BAD_OBSERVER", lambda block: None, both(to("period_us", 1100), healthy_deadlines(1100))),
        row("sync_deadline_us", bad, PERIOD_US, PERIOD_US - 1),
        row("sync_deadline_us", bad, 15 * PERIOD_US, 15 * PERIOD_US + 1),
        row("joint_deadline_us", bad, PERIOD_US, PERIOD_US - 1),
        row("joint_deadline_us", bad, 4 * PERIOD_US, 4 * PERIOD_US + 1),
        row("task_deadline_us", bad, PERIOD_US, PERIOD_US - 1),
        row("task_deadline_us", bad, 15 * PERIOD_US, 15 * PERIOD_US + 1),
        row("tick_deadline_us", bad, PERIOD_US, PERIOD_US - 1),
        row("tick_deadline_us", bad, 8 * PERIOD_US, 8 * PERIOD_US + 1),
        row("tick_budget_us", bad, 1, 0),
        row("tick_budget_us", bad, PERIOD_US, PERIOD_US + 1),
        row("task_dwell_cycles", bad, 200, 199),
        row("task_dwell_cycles", bad, 300, 301),
        row("task_dwell_cycles", bad, 250, 2**32 - 1),
        row("settling_us", bad, 100_000, PERIOD_US - 1),
        row("settling_us", bad, 100_000, 500_001, to("reset_healthy_us", 1_000_000)),
        row("reset_healthy_us", bad, 100_000, 99_999),
        row("reset_healthy_us", bad, 60_000_000, 60_000_001),
    ]


def healthy_deadlines(period_us: int) -> Change:
    fields = ("sync_deadline_us", "joint_deadline_us", "task_deadline_us", "tick_deadline_us")
    return both(*(to(field, 2 * period_us) for field in fields), to("task_dwell_cycles", 220))


def rows_of_observer() -> list[Row]:
    bad = "BAD_OBSERVER"
    decay = np.exp(-50e-3 * np.arange(1, 5))
    rows = [row("observer.torque_sample", bad, 2, 3), row("observer.torque_sample", bad, 1, 0)]
    rows.append(row("settling_us", bad, 99_000, 96_000))  # five time constants of 20 ms, to exp(-5) + 10 %
    for gap in range(4):
        rows += [
            row(f"observer.decay.{gap}", bad, decay[gap], decay[gap] + 2e-4),
            row(f"observer.decay.{gap}", bad, decay[gap], decay[gap] - 2e-4),
            row(f"observer.gain.{gap}", bad, 1 - decay[gap], 1 - decay[gap] + 1e-4),
            row(f"observer.gain.{gap}", bad, 1 - decay[gap], 0),
            row(f"observer.gain.{gap}", bad, 1 - decay[gap], -0.05),
            row(f"observer.momentum_gain.{gap}", bad, *((1 - decay[gap]) / (gap + 1) * 1e3 * np.array([1.005, 1.015]))),
            row(f"observer.momentum_gain.{gap}", bad, *((1 - decay[gap]) / (gap + 1) * 1e3 * np.array([0.995, 0.985]))),
            row(f"observer.momentum_gain.{gap}", bad, (1 - decay[gap]) / (gap + 1) * 1e3, 0),
        ]
    return rows


def rows_of_bank() -> list[Row]:
    bad = "BAD_BANK"
    rows = [row("bank.channels", bad, 1, 0), row("bank.channels", bad, 1, 5)]
    for name, most in (("own", 1), ("cross", 1), ("back", 1), ("stay", 1), ("in", 16), ("in_back", 16)):
        for gap in range(1, 4):  # the constants of one cycle are bounded by the response
            path = f"bank.channel.0.{name}.{gap}"
            rows += [row(path, bad, most, most + 0.01), row(path, bad, -most, -most - 0.01)]
    for gap in range(1, 4):
        path = f"bank.channel.0.high_pass.{gap}"
        rows += [row(path, bad, 0, -0.01), row(path, bad, 0.99, 1)]
    rows += [row("bank.channel.0.of", bad, 0, 1), row("bank.channel.0.of", bad, 0, 2)]
    first = "bank.channel.0."
    decay = float(np.exp(-0.05))
    rows += [
        row(first + "in.0", bad, 1, 1.05),  # the step response does not settle at 1
        row(first + "in.0", bad, 1, 0.95),
        row(first + "in.0", bad, 1, 0),  # zero gain
        row(first + "in.0", bad, 1, -1),
        row(first + "own.0", bad, decay, 0.999),  # settles at 20 times the step
        row(first + "own.0", bad, decay, 1),
        row(first + "own.0", bad, decay, -1),
        row(first + "high_pass.0", bad, 0, 1e-3),  # the only channel does not detect a constant force
        row(first + "high_pass.0", bad, 0, -1e-3),
    ]
    return rows


def rows_of_regressor() -> list[Row]:
    """d_r instead of d_p, with its filter."""
    bad = "BAD_BANK"
    constants = channel_constants(120.0, order=1, damping=1.0, high_pass_hz=0.0, gain_per_s=50.0, period_s=1e-3)
    place = "regressor.low_pass."
    used = both(
        to(f"task.{PAYLOAD}.index.kind", 4),
        to("regressor.used", 1),
        *(to(f"{place}{name}.{gap}", values[gap]) for name, values in constants.items() for gap in range(4)),
    )
    rows = [
        row("regressor.used", bad, 1, 0, used),  # a task uses it
        row("regressor.used", bad, 1, 2, used),
        row("regressor.used", bad, 0, 1),  # no task uses it
        row(place + "of", bad, 0, 1, used),
        row(place + "high_pass.0", bad, 0, 1e-3, used),
        row(place + "in.0", bad, constants["in"][0], 0, used),
    ]
    for name, most in (("own", 1), ("cross", 1), ("back", 1), ("stay", 1), ("in", 16), ("in_back", 16)):
        path = f"{place}{name}.3"
        rows += [row(path, bad, most, most + 0.01, used), row(path, bad, -most, -most - 0.01, used)]
    return rows


def rows_of_projection_and_stop() -> list[Row]:
    bad = "BAD_SUBSPACE"
    return [
        row("subspace.projector", bad, 2, 0),
        row("subspace.projector", bad, 1, 3),
        row("subspace.order", bad, 2, 0),
        row("subspace.order", bad, 2, 3),
        row("subspace.tolerance", bad, 0.05, 0),
        row("subspace.tolerance", bad, 0.1, 0.101, to("subspace.softness", 0.2)),
        row("subspace.lever_m", bad, 1, 1.01),
        row("subspace.lever_m", bad, 0.01, 0, to(f"task.{CONTACT}.limits.moment_max_nm", 1)),
        row("subspace.softness", bad, 0.2, 0.201),
        row("subspace.softness", bad, 0.02, 0.019),
        row("stop_collision", "BAD_STOP", 2, 3),
        row("stop_collision", "BAD_STOP", 0, 2**32 - 1),
        row("stop_input", "BAD_STOP", 1, 2),
        row("stop_fault", "BAD_STOP", 1, 2),
    ]


def rows_of_limits() -> list[Row]:
    bad = "BAD_LIMITS"
    torque_max = load_configuration("default", robot="panda").robot.joints[3].torque_max
    rows = [
        row("acceleration.force_floor_n", bad, 20, 20.1),
        row("acceleration.force_floor_n", bad, 0.1, 0),
        row("acceleration.error_max", bad, 10, 10.1),
        row("acceleration.error_max", bad, 0.1, 0),
    ]
    for task in (NONE, PAYLOAD, CONTACT):
        place = f"task.{task}.limits.residual_max_nm.3"
        rows += [row(place, bad, 2 * torque_max, 2 * torque_max + 0.1), row(place, bad, 1, 0), row(place, bad, 1, -1)]
    bounds = (
        (PAYLOAD, "mass_max_kg", 50.0, 0.0),
        (PAYLOAD, "arm_max_m", 1.0, -0.01),
        (PAYLOAD, "force_slack_n", 60.0, 0.0),
        (PAYLOAD, "moment_slack_nm", 20.0, 0.0),
        (CONTACT, "force_max_n", 400.0, 0.0),
        (CONTACT, "moment_max_nm", 40.0, 0.0),
    )
    for task, name, most, too_little in bounds:
        place = f"task.{task}.limits.{name}"
        rows += [row(place, bad, most, 1.01 * most), row(place, bad, most / 2, too_little), row(place, bad, 1, -1)]
    for name in ("offset_nm", "friction_nm"):
        place = f"sensor.{name}.3"
        rows += [row(place, "BAD_SENSOR", torque_max / 4, torque_max / 4 + 0.1), row(place, "BAD_SENSOR", 0.1, -50)]
    return rows


def rows_of_tasks() -> list[Row]:
    bad = "BAD_TASK"
    torque_max = load_configuration("default", robot="panda").robot.joints[3].torque_max
    off = [to(f"task.{task}.index.kind", 0) for task in (PAYLOAD, CONTACT)]
    off += [to(f"task.{CONTACT}.index.components", 0)]
    rows = [
        row("task.0.index.kind", bad, 0, 1),  # "invalid" is not a task
        row(f"task.{NONE}.index.kind", bad, 1, 0, *off),  # at least one
        row(f"task.{NONE}.index.kind", bad, 1, 5),
        row(f"task.{NONE}.index.components", bad, 0, 1),
        row(f"task.{CONTACT}.index.components", bad, 1, 0),
        row(f"task.{CONTACT}.index.components", bad, 0x3F, 0x7F),
    ]
    contact = f"task.{CONTACT}.index"
    axes = both(to(f"{contact}.frame", 2), *(to(f"{contact}.axis.{a}.{a}", 1) for a in range(3)))
    rows += [
        row(f"{contact}.frame", bad, 0, 1),  # axes are missing
        row(f"{contact}.frame", bad, 1, 3, axes),
        row(f"{contact}.axis.0.0", bad, 1, 1.1, axes),
        row(f"{contact}.axis.0.0", bad, 1, 0.9, axes),
        row(f"{contact}.axis.0.1", bad, 0, 0.01, axes),
        row(f"{contact}.axis.0.0", bad, 0, 1),  # FRAME_TIP has none
        row(f"{contact}.point.2", bad, POINT_M, POINT_M + 0.1, axes),
        row(f"{contact}.point.2", bad, 0, 0.1),
        row(f"{contact}.fast", bad, 0, 1),  # no channel uses it
        row(f"task.{NONE}.index.fast", bad, 0, 1),
    ]
    for task in (NONE, PAYLOAD, CONTACT):
        detector = f"task.{task}.detector"
        rows += [
            row(f"{detector}.debounce_ticks", bad, 1, 0),
            row(f"{detector}.debounce_ticks", bad, 100, 101),
            row(f"{detector}.debounce_ticks", bad, 100, 2**32 - 1),
            row(f"{detector}.channels", bad, 1, 0),
            row(f"{detector}.channels", bad, 1, 2),
            row(f"{detector}.channels", bad, 1, 3),
            row(f"{detector}.threshold_nm.0.3", bad, torque_max / 3 - 0.01, torque_max / 3 + 0.01),
            row(f"{detector}.threshold_nm.0.3", bad, 0.01, 0),
            row(f"{detector}.threshold_nm.0.3", bad, 0.01, -1),
        ]
    return rows


def rows_of_robot() -> list[Row]:
    bad = "BAD_ROBOT"
    joint = "robot.joint.3."
    return [
        row("robot.joint_count", bad, 7, 0),
        row("robot.joint_count", bad, 7, 9),
        row(joint + "velocity_max_rad_s", bad, 2, 0),
        row(joint + "torque_max_nm", bad, 87, 0),
        row(joint + "position_min_rad", bad, -3, 1),
        row(joint + "cos_twist", bad, 0, 2),
    ]


def rows_of_sight() -> list[Row]:
    bad = "BAD_SIGHT"
    return [
        row("sight.reaction", bad, 2, 3),
        row("sight.force_n", bad, 500, 501),
        row("sight.force_n", bad, 1, 0),
        row("shape.middle.6.2", bad, 4, 4.01),
        row("shape.middle.6.2", bad, -4, -4.01),
        row("shape.half_m.6", bad, 4, 4.01),
        row("shape.half_m.6", bad, 0, -0.01),
        row(f"task.{NONE}.needed_links", bad, 0x7F, 0x80),
    ]


ROWS = [
    *rows_of_timing(),
    *rows_of_observer(),
    *rows_of_bank(),
    *rows_of_regressor(),
    *rows_of_projection_and_stop(),
    *rows_of_sight(),
    *rows_of_limits(),
    *rows_of_tasks(),
    *rows_of_robot(),
]


@functools.cache
def default_block(numeric: Numeric) -> bytes:
    """Panda's with one channel, at 1 kHz."""
    configuration = one_channel("panda")
    assert configuration.period_us == PERIOD_US
    return configuration.block(numeric)


def answer(change: Change, numeric: Numeric) -> str:
    """The result of config_check for the default block after this change, with a valid CRC."""
    block = np.frombuffer(bytearray(default_block(numeric)), block_dtype(numeric))
    change(block[0])
    block["crc"] = zlib.crc32(block.tobytes()[CRC_END:])
    library = load_library(numeric)
    config = library.new("guard_config_t *")
    library.ffi.memmove(config, block.tobytes(), block.nbytes)
    names = library.ffi.typeof("guard_status_t").elements
    return str(names[library.lib.config_check(config)]).removeprefix("GUARD_")


@pytest.mark.parametrize("numeric", NUMERICS)
@pytest.mark.parametrize("bound", ROWS, ids=[f"{i}-{row.field}" for i, row in enumerate(ROWS)])
def test_the_last_value_inside_passes_and_the_next_does_not(bound: Row, numeric: Numeric) -> None:
    assert answer(bound.good, numeric) == "OK"
    assert answer(bound.bad, numeric) == bound.status


@pytest.mark.parametrize("task", [PAYLOAD, CONTACT])
def test_a_task_that_explains_all_directions_of_a_short_arm_is_refused(task: int) -> None:
    """d_e needs 7 joints and d_p 6. The other tasks are off, so that the status is this task's."""
    want = {PAYLOAD: (6, 5, "PAYLOAD_NEEDS_6_JOINTS"), CONTACT: (7, 6, "CONTACT_NEEDS_JOINTS")}[task]
    other = {PAYLOAD: CONTACT, CONTACT: PAYLOAD}[task]
    off = both(to(f"task.{other}.index.kind", 0), to(f"task.{other}.index.components", 0))
    assert answer(both(off, joints(want[0])), "float32") == "OK"
    assert answer(both(off, joints(want[1])), "float32") == want[2]


def joints(count: int) -> Change:
    def change(block: Any) -> None:
        block["robot"]["joint_count"] = count
        block["robot"]["joint"][count:] = 0

    return change


def test_a_reaction_beyond_the_limit_is_refused() -> None:
    """A filter that takes 0.55 s to half of a step and 1 s to the full step: only the debounce decides."""
    constants = channel_constants(2.16, order=2, damping=0.4, high_pass_hz=0, gain_per_s=50, period_s=1e-3)
    slow = both(
        *(to(f"bank.channel.0.{name}.{gap}", values[gap]) for name, values in constants.items() for gap in range(4))
    )
    debounced = both(slow, *(to(f"task.{task}.detector.debounce_ticks", 100) for task in (NONE, PAYLOAD, CONTACT)))
    assert answer(slow, "float32") == "OK"
    assert answer(debounced, "float32") == "TOO_SLOW"


def leaves(kind: Any, place: str = "") -> set[str]:
    """Field names of a structured type, without array indexes."""
    found: set[str] = set()
    for name, (field, *_) in kind.fields.items():
        base = field.base
        found |= leaves(base, f"{place}{name}.") if base.fields else {f"{place}{name}"}
    return found


@pytest.mark.parametrize("rate_hz", [100.0, 200.0, 250.0, 500.0])
def test_the_channels_of_a_bank_are_valid_at_every_rate(rate_hz: float) -> None:
    """Also that of `sudden`, whose high-pass leaves less than half of a step where cycles are long."""
    slow, fast = {"low_pass_per_s": 30.0, "order": 2}, {"low_pass_per_s": 120.0, "order": 2}
    channels = [slow, {**fast, "high_pass_hz": 3.0}, {**fast, "high_pass_hz": 8.0, "of": "sudden"}]
    tasks: dict[str, Any] = {name: {"threshold_nm": 1.0, "fast": []} for name in TASKS}
    tasks["contact"]["fast"] = ["fx", "fy", "fz"]
    tables = {
        "wire": {"rate_hz": rate_hz, "format": "fd"},
        "bank": {"channel": channels},
        "task": tasks,
    }
    configuration = load_configuration("default", robot="panda", overrides=tables)
    library = load_library("float32")
    config = library.new("guard_config_t *")
    library.ffi.memmove(config, configuration.block(), len(configuration.block()))
    assert library.lib.config_check(config) == library.lib.GUARD_OK


def test_every_field_has_a_row() -> None:
    elsewhere = {  # header fields and the robot's table: test_config_block.py, test_config.c, test_robot.c
        field
        for field in leaves(block_dtype("float32"))
        if field.startswith("robot.") or field in ("magic", "schema", "size", "crc", "numeric", "wire")
    }
    rows = {".".join(part for part in row.field.split(".") if not part.isdigit()) for row in ROWS}
    assert leaves(block_dtype("float32")) - elsewhere - rows == set()
