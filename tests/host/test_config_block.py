"""The block is guard_config_t byte for byte, and contains the values of the configuration."""

import dataclasses
import math
import struct
import types
import zlib
from typing import Any

import numpy as np
import pytest

from tauperp import robot
from tauperp.config import NUMERICS, Numeric, load_configuration
from tauperp.config.block import MAX_GAP, block_dtype, observer_constants, pack
from tauperp.config.indexes import INDEXES
from tauperp.errors import InputError
from tauperp.firmware import load_library
from tauperp.robot.table import make_table
from tauperp.wire import Wire


def fields(block: bytes, numeric: Numeric = "float32") -> Any:
    return np.frombuffer(block, block_dtype(numeric))[0]


@pytest.fixture(scope="module")
def block() -> bytes:
    return load_configuration("paper", robot="ku_dex").block()


def c_offsets(ffi: Any, kind: Any, start: int = 0, place: str = "") -> dict[str, int]:
    """Every leaf of a C type with its offset; arrays element by element, vec3_t as its first number."""
    if kind.kind == "struct" and kind.cname != "vec3_t":
        return {
            key: value
            for name, field in kind.fields
            for key, value in c_offsets(ffi, field.type, start + field.offset, f"{place}.{name}").items()
        }
    if kind.kind == "array" and kind.item.kind == "struct":
        size = ffi.sizeof(kind.item)
        return {
            key: value
            for i in range(kind.length)
            for key, value in c_offsets(ffi, kind.item, start + i * size, f"{place}[{i}]").items()
        }
    return {place: start}


def numpy_offsets(kind: np.dtype[Any], start: int = 0, place: str = "") -> dict[str, int]:
    if kind.fields:
        return {
            key: value
            for name, (field, offset, *_) in kind.fields.items()
            for key, value in numpy_offsets(field, start + offset, f"{place}.{name}").items()
        }
    if kind.subdtype and kind.subdtype[0].fields:
        item = kind.subdtype[0]
        return {
            key: value
            for i in range(kind.shape[0])
            for key, value in numpy_offsets(item, start + i * item.itemsize, f"{place}[{i}]").items()
        }
    return {place: start}


def test_every_field_has_its_offset_in_the_firmware() -> None:
    ffi = load_library("float32").ffi
    kind = block_dtype("float32")
    assert kind.itemsize == ffi.sizeof("guard_config_t")
    assert numpy_offsets(kind) == c_offsets(ffi, ffi.typeof("guard_config_t"))


def test_every_index_of_the_firmware_has_a_name() -> None:
    kinds = {index.kind for index in INDEXES.values()}
    assert kinds == set(range(load_library("float32").lib.INDEX_KIND_COUNT))


def test_both_numeric_types_have_one_layout() -> None:
    assert numpy_offsets(block_dtype("q9.22")) == numpy_offsets(block_dtype("float32"))


def test_the_crc_covers_all_that_follows_it(block: bytes) -> None:
    magic, schema, size, crc = struct.unpack_from("<4I", block)
    assert (magic, schema, size) == (0x50524554, 4, len(block))
    assert crc == zlib.crc32(block[16:])


def test_the_block_names_the_dbc_that_it_was_made_for(block: bytes) -> None:
    assert fields(block)["wire"] == Wire.read().crc


def test_times_are_in_microseconds(block: bytes) -> None:
    found = fields(block)
    cycles = load_configuration("paper", robot="ku_dex").timeout_cycles
    assert found["period_us"] == 1000
    assert found["sync_deadline_us"] == 1000 * cycles("sync")
    assert found["joint_deadline_us"] == 1000 * cycles("joint")
    assert found["task_deadline_us"] == 1000 * cycles("task")
    assert found["tick_deadline_us"] == 2000
    assert found["tick_budget_us"] == 500
    assert found["reset_healthy_us"] == 100_000


def test_settings_become_the_firmwares_numbers(block: bytes) -> None:
    found = fields(block)
    assert (found["format"], found["numeric"]) == (2, 1)
    assert (found["stop_collision"], found["stop_input"], found["stop_fault"]) == (2, 1, 0)
    assert (found["subspace"]["order"], found["subspace"]["projector"]) == (1, 1)
    assert found["observer"]["torque_sample"] == 1
    assert found["task"]["index"]["kind"].tolist() == [0, 1, 2, 3, 0, 0, 0]
    assert found["task"]["detector"]["debounce_ticks"].tolist() == [0, 1, 1, 1, 0, 0, 0]
    assert found["task"]["detector"]["threshold_nm"][2][0].tolist() == [2.0] * 7 + [0.0]


def test_a_task_that_is_off_is_all_zero() -> None:
    found = fields(
        load_configuration("paper", robot="ku_dex", overrides={"task": {"contact": {"index": "off"}}}).block()
    )
    assert found["task"][3].tobytes() == bytes(found["task"][3].nbytes)


@pytest.mark.parametrize("gap", range(1, MAX_GAP + 1))
def test_observer_constants_are_the_exact_discretisation(gap: int) -> None:
    constants = observer_constants(50.0, 0.001)
    decay = math.exp(-50.0 * gap * 0.001)
    assert constants["decay"][gap - 1] == pytest.approx(decay, rel=1e-15)
    assert constants["gain"][gap - 1] == pytest.approx(1 - decay, rel=1e-13)
    assert constants["momentum_gain"][gap - 1] == pytest.approx((1 - decay) / (gap * 0.001), rel=1e-13)


def test_the_robots_table_is_in_the_block(block: bytes) -> None:
    found, table = fields(block)["robot"], make_table(robot.load("ku_dex"))
    assert found["name"].decode() == "ku_dex"
    assert found["joint_count"] == 7
    np.testing.assert_array_equal(found["base"], np.float32(table.base))
    np.testing.assert_array_equal(found["gravity"], np.float32(table.gravity))
    np.testing.assert_array_equal(found["tip"], np.float32(table.tip))
    for name in found["joint"].dtype.names:
        expected = np.float32([getattr(joint, name) for joint in table.joint[:7]])
        np.testing.assert_array_equal(found["joint"][name][:7], expected, err_msg=name)


def test_entries_after_the_last_joint_are_zero() -> None:
    whole = robot.load("ku_dex")
    short = dataclasses.replace(whole, joints=whole.joints[:3], capsules=whole.capsules[:3])
    found = fields(load_configuration("default", robot=short).block())
    assert found["robot"]["joint_count"] == 3
    assert found["robot"]["joint"][3:].tobytes() == bytes(found["robot"]["joint"][3:].nbytes)


def test_fixed_point_is_the_same_block_in_q9_22() -> None:
    configuration = load_configuration("paper", robot="ku_dex")
    single, fixed = fields(configuration.block("float32")), fields(configuration.block("q9.22"), "q9.22")
    assert fixed["numeric"] == NUMERICS["q9.22"]
    for path in (
        ("observer", "momentum_gain"),
        ("subspace", "tolerance"),
        ("robot", "gravity"),
    ):
        expected, found = single[path[0]][path[1]], fixed[path[0]][path[1]] / 2.0**22
        np.testing.assert_allclose(found, expected, atol=2.0**-22, rtol=1e-7)


def test_numbers_are_rounded_to_the_nearest_step_of_q9_22() -> None:
    found = fields(pack({"subspace": {"tolerance": 1.6 * 2.0**-22, "lever_m": -1.6 * 2.0**-22}}, "q9.22"), "q9.22")
    assert (found["subspace"]["tolerance"], found["subspace"]["lever_m"]) == (2, -2)


@pytest.mark.parametrize(
    ("values", "numeric", "message"),
    [
        ({"subspace": {"lever_m": 512.0}}, "q9.22", "subspace.lever_m does not fit into Q9.22"),
        ({"robot": {"joint": [{}, {"torque_max_nm": 600.0}]}}, "q9.22", r"robot.joint\[1\].torque_max_nm does not fit"),
        ({"subspace": {"lever_m": 1e39}}, "float32", "subspace.lever_m does not fit into float32"),
        ({"period_us": 2**32}, "float32", "period_us does not fit into 32 bits"),
    ],
)
def test_a_number_that_does_not_fit_is_named(values: dict[str, Any], numeric: Numeric, message: str) -> None:
    with pytest.raises(InputError, match=message):
        pack(values, numeric)


def test_an_arm_too_strong_for_fixed_point_is_refused_there_only() -> None:
    whole = robot.load("ku_dex")
    strong = dataclasses.replace(
        whole, joints=tuple(dataclasses.replace(joint, torque_max=600.0) for joint in whole.joints)
    )
    configuration = load_configuration("default", robot=strong)
    assert isinstance(configuration.block("float32"), bytes)
    with pytest.raises(
        InputError, match=r"^default: .*torque_max_nm|^default: .*residual_max_nm.*does not fit into Q9\.22"
    ):
        configuration.block("q9.22")


def test_a_field_that_the_struct_does_not_have_is_a_defect() -> None:
    with pytest.raises((KeyError, ValueError)):
        pack(types.MappingProxyType({"no_such_field": 1}), "float32")
