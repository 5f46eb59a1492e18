"""The firmware's half of the wire against cantools and autosar-e2e, both ways, through the built library."""

import random
import re
from collections.abc import Callable
from typing import Any

import cffi
import pytest
from cantools.database.can.c_source import camel_to_snake_case
from e2e import p02

from tauperp.files import repository_root
from tauperp.firmware.library import load_library
from tauperp.wire import E2EStatus, Receiver, Sender, Wire, WireMessage
from tauperp.wire_values import Task

Call = Callable[..., Any]


@pytest.fixture(scope="module")
def wire() -> Wire:
    return Wire.read()


@pytest.fixture(scope="module")
def firmware() -> Any:
    """The library with the E2E functions and tables."""
    return load_library()


@pytest.fixture(scope="module")
def messages() -> tuple[Any, Any]:
    """cffi over messages.h, which the library's own declarations leave out."""
    text = (repository_root() / "firmware" / "wire" / "generated" / "messages.h").read_text()
    ffi = cffi.FFI()
    ffi.cdef(re.sub(r"^#.*$", "", text, flags=re.MULTILINE))
    return ffi, ffi.dlopen(str(load_library().path.resolve()))


@pytest.fixture
def rng(seed: int) -> random.Random:
    print(f"seed {seed}")
    return random.Random(seed)


def raw_signals(message: WireMessage, rng: random.Random) -> dict[str, int]:
    """Random raw integers, in the DBC's range, for every signal that one frame carries."""
    definition = message.definition
    raw: dict[str, int] = {}
    for signal in sorted(definition.signals, key=lambda s: not s.is_multiplexer):
        page = signal.multiplexer_ids
        if page and raw[str(signal.multiplexer_signal)] not in page:
            continue
        low, high = (round(limit / signal.scale) for limit in (signal.minimum, signal.maximum))
        raw[signal.name] = rng.randint(low, high)
    return raw


def c_names(message: WireMessage, raw: dict[str, int]) -> dict[str, int]:
    """The firmware's names: one JointState, and GuardIndex without its joints' numbers."""
    numbered = message.name == "GuardIndex"
    return {camel_to_snake_case(name.rstrip("0123456789") if numbered else name): raw[name] for name in raw}


def c_struct(message: WireMessage) -> str:
    return "tauperp_" + camel_to_snake_case("JointState" if message.joint else message.name)


@pytest.mark.parametrize("name", ["StopCommand", "GuardStatus", "GuardIndex"])
def test_frames_of_the_firmware_decode_in_cantools_and_check_in_autosar_e2e(
    wire: Wire, firmware: Any, messages: tuple[Any, Any], rng: random.Random, name: str
) -> None:
    ffi, lib = messages
    message = wire.message(name)
    pack: Call = getattr(lib, f"{c_struct(message)}_pack")
    slot = getattr(firmware.lib, "PROTOCOL_TRANSMIT_" + camel_to_snake_case(name).upper())
    entry = firmware.lib.protocol_transmit[slot]
    assert (entry.id, entry.length) == (message.id, message.length)
    transmitter = firmware.ffi.new("e2e_transmitter_t *")
    for sent in range(1, 501):
        raw = raw_signals(message, rng) | {"CRC": 0, "Counter": 0}
        data = bytearray(message.length)
        pack(ffi.from_buffer(data), ffi.new(f"struct {c_struct(message)}_t *", c_names(message, raw)))
        firmware.lib.e2e_protect(
            transmitter, firmware.ffi.from_buffer("uint8_t *", data), message.length, entry.data_ids
        )
        assert p02.e2e_p02_check(data, message.data_ids)
        decoded = message.definition.decode(bytes(data), decode_choices=False, scaling=False)
        assert decoded == raw | {"CRC": data[0], "Counter": sent % 16}


@pytest.mark.parametrize("name", [n for n, m in Wire.read().messages.items() if "GUARD" in m.definition.receivers])
def test_frames_of_the_host_check_and_unpack_in_the_firmware(
    wire: Wire, firmware: Any, messages: tuple[Any, Any], rng: random.Random, name: str
) -> None:
    ffi, lib = messages
    message = wire.message(name)
    unpack: Call = getattr(lib, f"{c_struct(message)}_unpack")
    entry = firmware.lib.protocol_receive[firmware.lib.protocol_slot(message.id)]
    assert (entry.id, entry.length, entry.max_delta) == (message.id, message.length, message.max_delta)
    assert (entry.timeout_cycles, bytes(entry.data_ids)) == (message.timeout_cycles, message.data_ids)
    receiver = firmware.ffi.new("e2e_receiver_t *")
    sender = Sender(wire, fd=True)
    factors = {signal.name: signal.scale for signal in message.definition.signals}
    for cycle in range(1, 501):
        raw = {name: value for name, value in raw_signals(message, rng).items() if name not in ("CRC", "Counter")}
        frame = sender.frame(name, {key: value * factors[key] for key, value in raw.items()}, cycle=cycle)
        data = firmware.ffi.from_buffer("uint8_t *", frame.data)
        status = firmware.lib.e2e_check(receiver, data, message.length, entry.data_ids, entry.max_delta)
        assert status == (E2EStatus.INITIAL if cycle == 1 else E2EStatus.OK)
        unpacked = ffi.new(f"struct {c_struct(message)}_t *")
        unpack(unpacked, ffi.from_buffer(frame.data))
        assert {key: getattr(unpacked, key) for key in c_names(message, raw)} == c_names(message, raw)
        assert unpacked.counter == cycle % 16


def test_host_and_firmware_judge_the_same_frames_alike(wire: Wire, firmware: Any, rng: random.Random) -> None:
    """Random steps, corruptions and masquerades over every message that the guard receives."""
    host = Receiver(wire)
    heard = [message for message in wire.messages.values() if "GUARD" in message.definition.receivers]
    receivers = {message.id: firmware.ffi.new("e2e_receiver_t *") for message in heard}
    counters = dict.fromkeys(receivers, 0)
    seen = set()
    for _ in range(20000):
        message = rng.choice(heard)
        data = bytearray(rng.randbytes(message.length))
        counters[message.id] += rng.choice((0, 1, 1, 1, 1, 2, 3, 5, 9, 15))
        other = rng.choice(list(wire.messages.values())) if rng.random() < 0.1 else message
        other.seal(data, counters[message.id])
        if rng.random() < 0.1:
            data[rng.randrange(message.length)] ^= 1 << rng.randrange(8)
        frame = Sender(wire, fd=True).frame("Sync", {"Cycle": 0}, cycle=0)
        frame.arbitration_id, frame.data, frame.dlc = message.id, data, message.length
        received = host.receive(frame)
        assert received is not None
        entry = firmware.lib.protocol_receive[firmware.lib.protocol_slot(message.id)]
        status = firmware.lib.e2e_check(
            receivers[message.id],
            firmware.ffi.from_buffer("uint8_t *", data),
            message.length,
            entry.data_ids,
            entry.max_delta,
        )
        assert status == received.status
        if received.status is E2EStatus.SOME_LOST:
            assert receivers[message.id].lost == received.lost
        seen.add(received.status)
    assert seen == set(E2EStatus) - {E2EStatus.UNCHECKED}


def test_the_e2e_states_have_the_firmwares_numbers(firmware: Any) -> None:
    assert {f"E2E_{status.name}": int(status) for status in E2EStatus} == {
        f"E2E_{status.name}": getattr(firmware.lib, f"E2E_{status.name}") for status in E2EStatus
    }


def test_reasons_states_and_tasks_are_named_as_in_the_firmware(wire: Wire, firmware: Any) -> None:
    """The DBC's value tables against guard.h and config.h."""
    tables = {"Reason": "GUARD_REASON_", "State": "GUARD_STATE_", "Task": "TASK_"}
    for signal in wire.message("GuardStatus").definition.signals:
        if signal.name in tables and signal.choices:
            for number, choice in signal.choices.items():
                if signal.name == "Task" and str(choice).startswith("Task"):  # a task defined by the installation
                    assert 3 < number < len(Task)
                    continue
                constant = tables[signal.name] + camel_to_snake_case(str(choice)).upper()
                assert getattr(firmware.lib, constant) == number, constant
