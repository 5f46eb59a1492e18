"""The bytes of guard_config_t (firmware/guard/config.h): its layout in numpy, its numbers and its CRC."""

import struct
import zlib
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from tauperp.errors import InputError
from tauperp.wire_values import Task

Numeric = Literal["float32", "q9.22"]

MAX_JOINTS = 8  # ROBOT_MAX_JOINTS
NAME_LENGTH = 16  # ROBOT_NAME_LENGTH
MAX_GAP = 4  # CONFIG_MAX_GAP
TASK_COUNT = len(Task)
MAX_CHANNELS = 4  # BANK_MAX_CHANNELS

MAGIC = 0x50524554  # "TERP"
SCHEMA = 4
NUMERICS: dict[Numeric, int] = {"float32": 1, "q9.22": 2}
CRC_END = 16  # magic, schema, size and the CRC itself are outside of what it covers

_Q_FRACTION = 22
_Q_LIMIT = 2 ** (31 - _Q_FRACTION)


def block_dtype(numeric: Numeric) -> np.dtype[np.void]:
    """guard_config_t as a structured type: every field 32 bits wide, little-endian, no padding anywhere."""
    num = "<f4" if numeric == "float32" else "<i4"
    word = "<u4"
    joint = np.dtype(
        [
            ("offset", num, 3),
            *(
                (field, num)
                for field in (
                    "cos_twist", "sin_twist", "zero_rad", "moment_x", "moment_y",
                    "inertia_xx", "inertia_xy", "inertia_xz", "inertia_yz", "inertia_zz",
                    "position_min_rad", "position_max_rad", "velocity_max_rad_s", "torque_max_nm",
                )
            ),
        ]
    )  # fmt: skip
    robot = np.dtype(
        [
            ("name", f"S{NAME_LENGTH}"),
            ("joint_count", word),
            ("base", num, (3, 3)),
            ("gravity", num, 3),
            ("tip", num, 3),
            ("joint", joint, MAX_JOINTS),
        ]
    )
    observer = np.dtype(
        [
            ("decay", num, MAX_GAP),
            ("gain", num, MAX_GAP),
            ("momentum_gain", num, MAX_GAP),
            ("torque_sample", word),
        ]
    )
    channel = np.dtype(
        [
            *((field, num, MAX_GAP) for field in ("own", "cross", "back", "stay", "in", "in_back", "high_pass")),
            ("of", word),
        ]
    )
    bank = np.dtype([("channels", word), ("channel", channel, MAX_CHANNELS)])
    subspace = np.dtype([("order", word), ("projector", word), ("tolerance", num), ("lever_m", num), ("softness", num)])
    acceleration = np.dtype([("force_floor_n", num), ("error_max", num)])
    regressor = np.dtype([("used", word), ("low_pass", channel)])
    sensor = np.dtype([("offset_nm", num, MAX_JOINTS), ("friction_nm", num, MAX_JOINTS)])
    shape = np.dtype([("middle", num, (MAX_JOINTS, 3)), ("half_m", num, MAX_JOINTS)])
    sight = np.dtype([("reaction", word), ("force_n", num)])
    index = np.dtype(
        [
            ("kind", word),
            ("components", word),
            ("fast", word),
            ("frame", word),
            ("axis", num, (3, 3)),
            ("point", num, 3),
        ]
    )
    detector = np.dtype(
        [("debounce_ticks", word), ("channels", word), ("threshold_nm", num, (MAX_CHANNELS, MAX_JOINTS))]
    )
    limits = np.dtype(
        [
            *(
                (field, num)
                for field in (
                    "mass_max_kg", "arm_max_m", "force_max_n", "moment_max_nm", "force_slack_n", "moment_slack_nm",
                )
            ),
            ("residual_max_nm", num, MAX_JOINTS),
        ]
    )  # fmt: skip
    task = np.dtype([("index", index), ("detector", detector), ("limits", limits), ("needed_links", word)])
    words = (
        "magic", "schema", "size", "crc", "numeric", "wire", "format", "period_us",
        "sync_deadline_us", "joint_deadline_us", "task_deadline_us", "tick_deadline_us", "tick_budget_us",
        "reset_healthy_us", "stop_collision", "stop_input", "stop_fault",
        "settling_us", "task_dwell_cycles",
    )  # fmt: skip
    return np.dtype(
        [
            *((field, word) for field in words),
            ("observer", observer),
            ("bank", bank),
            ("subspace", subspace),
            ("acceleration", acceleration),
            ("regressor", regressor),
            ("sensor", sensor),
            ("shape", shape),
            ("sight", sight),
            ("task", task, TASK_COUNT),
            ("robot", robot),
        ]
    )


def observer_constants(gain_per_s: float, period_s: float) -> dict[str, npt.NDArray[np.float64]]:
    """Exact discretisation of the momentum observer over 1 to MAX_GAP cycles, (MAX_GAP,) each, in float64."""
    span = period_s * np.arange(1, MAX_GAP + 1)
    gain = -np.expm1(-gain_per_s * span)
    return {"decay": np.exp(-gain_per_s * span), "gain": gain, "momentum_gain": gain / span}


def channel_constants(
    low_pass_per_s: float, order: int, damping: float, high_pass_hz: float, gain_per_s: float, period_s: float
) -> dict[str, npt.NDArray[np.float64]]:
    """Exact discretisation of one channel (firmware/core/bank.h) over 1 to MAX_GAP cycles, (MAX_GAP,) each.

    A low-pass of order 1 or 2 at low_pass_per_s rad/s, with `damping` below 1 for order 2, then a first-order high-pass
    at high_pass_hz (0: none). The input is the observer's update, which carries the factor 1 - exp(-K g T).
    """
    span = period_s * np.arange(1, MAX_GAP + 1)
    gain = -np.expm1(-gain_per_s * span)
    zeros = np.zeros(MAX_GAP)
    if order == 1:
        own, cross, back, stay = np.exp(-low_pass_per_s * span), zeros, zeros, zeros
    else:
        turn = low_pass_per_s * np.sqrt(1 - damping**2) * span
        fade = np.exp(-damping * low_pass_per_s * span)
        lean = damping / np.sqrt(1 - damping**2)
        own = fade * (np.cos(turn) + lean * np.sin(turn))
        cross = fade * np.sin(turn) / np.sqrt(1 - damping**2)
        back = -cross
        stay = fade * (np.cos(turn) - lean * np.sin(turn))
    return {
        "own": own,
        "cross": cross,
        "back": back,
        "stay": stay,
        "in": (1 - own) / gain,
        "in_back": -back / gain,
        "high_pass": -np.expm1(-2 * np.pi * high_pass_hz * span),
    }


def passing_channel() -> dict[str, npt.NDArray[np.float64]]:
    """A channel that passes its input on: for an index that was filtered before its projection."""
    zeros = np.zeros(MAX_GAP)
    names = ("own", "cross", "back", "stay", "in_back", "high_pass")
    return {**dict.fromkeys(names, zeros), "in": np.ones(MAX_GAP)}


def pack(values: Mapping[str, Any], numeric: Numeric) -> bytes:
    """The block of these field values, its header and CRC included. Missing fields are zero.

    Numbers are rounded once, from float64. Raises InputError, with the field's name, for one that does not fit.
    """
    block = np.zeros((), block_dtype(numeric))
    _fill(block, values, "")
    block["magic"] = MAGIC
    block["schema"] = SCHEMA
    block["size"] = block.dtype.itemsize
    block["numeric"] = NUMERICS[numeric]
    block["crc"] = zlib.crc32(block.tobytes()[CRC_END:])
    return block.tobytes()


def block_crc(block: bytes) -> int:
    """The CRC that the block carries."""
    (crc,) = struct.unpack_from("<I", block, CRC_END - 4)
    return int(crc)


def _fill(target: Any, values: Mapping[str, Any], place: str) -> None:
    """Write nested values into a structured array, field by field; lists go into arrays of structs from the front."""
    for name, value in values.items():
        where = place + name
        field = target.dtype[name]
        if field.names:
            _fill(target[name], value, where + ".")
        elif field.subdtype and field.subdtype[0].names:
            for index, item in enumerate(value):
                _fill(target[name][index], item, f"{where}[{index}].")
        elif field.base.kind == "S":
            target[name] = str(value).encode()[:NAME_LENGTH]
        else:
            numbers = _rounded(np.asarray(value, float), field.base, where)
            if field.shape:
                numbers = np.pad(
                    numbers, [(0, room - has) for room, has in zip(field.shape, numbers.shape, strict=True)]
                )
            target[name] = numbers


def _rounded(numbers: npt.NDArray[np.float64], kind: np.dtype[Any], where: str) -> npt.NDArray[Any]:
    if kind.kind == "i":
        numbers = np.rint(numbers * 2.0**_Q_FRACTION)
        if not (np.abs(numbers) < _Q_LIMIT * 2.0**_Q_FRACTION).all():
            raise InputError(f"{where} does not fit into Q9.22 (-{_Q_LIMIT} to {_Q_LIMIT})")
    elif kind.kind == "u" and not ((numbers >= 0) & (numbers < 2.0**32)).all():
        raise InputError(f"{where} does not fit into 32 bits")
    with np.errstate(over="ignore"):
        result = numbers.astype(kind)
    if not np.isfinite(result).all():
        raise InputError(f"{where} does not fit into float32")
    return result
