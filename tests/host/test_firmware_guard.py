"""The whole guard through Guard: the states that a board observes, and what it refuses."""

import dataclasses
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest
from counting import calls_of

from tauperp.config import Configuration, load_configuration
from tauperp.errors import InputError
from tauperp.firmware import Core, Guard, Reason, State, Verdict, load_library
from tauperp.firmware import guard as guard_module
from tauperp.firmware.library import ENVIRONMENT
from tauperp.wire import Receiver, Sender

Q = np.array([0.3, -0.7, 0.5, 1.1, -0.4, 0.8, 0.2])
HEALTHY_CYCLES = 100  # cycles of 1 ms before the first permission: 5 / K


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    return load_configuration("default", robot="ku_dex", overrides={"reset": {"healthy_ms": HEALTHY_CYCLES}})


class Bench:
    """A guard, and a robot that stands at Q: every `cycle` sends one cycle's frames and ticks."""

    def __init__(self, configuration: Configuration) -> None:
        self.guard = Guard(configuration.block())
        self.period_us = configuration.period_us
        self.sender = Sender(configuration.wire, fd=configuration.settings.wire.format == "fd")
        self.gravity = Core(configuration.robot).terms(Q, np.zeros(7)).gravity
        self.k = 0

    @property
    def now_us(self) -> int:
        return self.k * self.period_us

    def frames(self, external: float = 0.0) -> list[can.Message]:
        frame, k = self.sender.frame, self.k
        rest = {"AccelX": 0.0, "AccelY": 0.0, "AccelZ": 0.0}
        joints = [
            {"SensorStatus": 0, "Position": q, "Velocity": 0.0, "Torque": g + external}
            for q, g in zip(Q, self.gravity, strict=True)
        ]
        return [
            frame("Sync", {"Cycle": k & 0xFFFF}, cycle=k),
            frame("TaskCommand", {"Task": 1, **rest}, cycle=k),
            *(frame(f"JointState{i}", signals, cycle=k) for i, signals in enumerate(joints, start=1)),
        ]

    def tick(self, frames: list[can.Message]) -> Verdict:
        self.k += 1
        for frame in frames:
            self.guard.receive(frame, self.now_us)
        return self.guard.tick(self.now_us)

    def cycle(self, external: float = 0.0) -> Verdict:
        return self.tick(self.frames(external))

    def started(self) -> "Bench":
        for _ in range(4 * HEALTHY_CYCLES):
            verdict = self.cycle()
        assert verdict.reason == Reason.AWAITING_RESET
        assert self.reset(0).state == State.MONITORING
        return self

    def reset(self, trip: int) -> Verdict:
        """Request the end of a trip, or of the start: an edge of Request. The first frame only sets a reference."""
        for request in (0, 0, 1):
            frame = self.sender.frame("GuardReset", {"Request": request, "TripNumber": trip})
            verdict = self.tick([*self.frames(), frame])
        return verdict


@pytest.fixture
def bench(configuration: Configuration) -> Bench:
    return Bench(configuration).started()


@pytest.mark.parametrize(("ours", "name"), [(State, "guard_state_t"), (Reason, "guard_reason_t")])
def test_numbers_and_names_agree_with_the_header(ours: type, name: str) -> None:
    prefix = name.removesuffix("t").upper()
    elements = load_library("float32").ffi.typeof(name).elements
    assert {value: text.removeprefix(prefix) for value, text in elements.items()} == {
        member.value: member.name for member in ours
    }


def test_every_refusal_of_the_header_has_a_message() -> None:
    elements = load_library("float32").ffi.typeof("guard_status_t").elements
    refusals = {
        value
        for value, name in elements.items()
        if name.startswith(("GUARD_BAD", "GUARD_CONTACT", "GUARD_PAY", "GUARD_TOO"))
    }
    assert set(guard_module._REFUSALS) == refusals


def test_permission_needs_every_input(configuration: Configuration) -> None:
    bench = Bench(configuration)
    verdicts = [bench.tick([]) for _ in range(70)]
    assert (verdicts[0].state, verdicts[0].reason) == (State.SELF_TEST, Reason.SELF_TEST)
    assert (verdicts[-1].state, verdicts[-1].reason) == (State.WAITING, Reason.WAITING_SYNC)
    verdicts += [bench.cycle() for _ in range(3 * HEALTHY_CYCLES)]
    assert verdicts[70 + HEALTHY_CYCLES // 2].reason == Reason.SETTLING
    assert verdicts[-1].reason == Reason.AWAITING_RESET
    assert not any(verdict.permitted for verdict in verdicts)
    last = bench.reset(0)
    assert (last.state, last.reason, last.permitted) == (State.MONITORING, Reason.NONE, True)


def test_the_cycle_is_complete_from_the_last_joint_until_the_tick(bench: Bench) -> None:
    frames = bench.frames()
    bench.k += 1
    for frame in frames[:-1]:
        bench.guard.receive(frame, bench.now_us)
    assert not bench.guard.cycle_complete()
    bench.guard.receive(frames[-1], bench.now_us)
    assert bench.guard.cycle_complete()
    bench.guard.tick(bench.now_us)
    assert not bench.guard.cycle_complete()


def test_the_frames_of_a_verdict_conform_to_the_wire(bench: Bench, configuration: Configuration) -> None:
    receiver = Receiver(configuration.wire)
    names: set[str] = set()
    for _ in range(40):
        verdict = bench.cycle()
        for frame in verdict.frames:
            received = receiver.receive(frame)
            assert received is not None
            assert frame.is_fd
            assert frame.bitrate_switch
            names.add(received.message.name)
            if received.message.name == "StopCommand" and received.signals:
                assert received.signals["Permission"] == int(verdict.permitted)
    assert names == {"StopCommand", "GuardStatus", "GuardIndex"}


def test_a_torque_above_the_threshold_stops_and_names_the_joint(bench: Bench, configuration: Configuration) -> None:
    verdicts = [bench.cycle(external=5.0) for _ in range(30)]
    stop = next(verdict for verdict in verdicts if not verdict.permitted)
    assert (stop.state, stop.reason, stop.stop_category) == (State.STOPPED, Reason.COLLISION, 2)
    assert 1 <= stop.joint <= 7
    assert stop.threshold_nm == pytest.approx(configuration.thresholds_nm("none")[stop.channel, stop.joint - 1])
    assert stop.value_nm > stop.threshold_nm
    assert stop.index[stop.joint - 1] == stop.value_nm
    assert stop.trip_number == 1


def test_residual_and_index_agree_with_the_core(bench: Bench, configuration: Configuration) -> None:
    core = Core(configuration.robot, config=configuration)
    for _ in range(200):
        verdict = bench.cycle(external=5.0)
    core.step(Q, np.zeros(7), bench.gravity, "none")
    for _ in range(200):
        expected = core.step(Q, np.zeros(7), bench.gravity + 5, "none")
    np.testing.assert_allclose(verdict.residual, expected.residual, atol=0.02)  # the wire's 0.01 Nm and 1.25e-4 rad
    np.testing.assert_allclose(verdict.index, expected.index, atol=0.02)


def test_silence_ends_the_permission(bench: Bench) -> None:
    verdicts = [bench.tick([]) for _ in range(12)]
    assert verdicts[0].permitted
    assert verdicts[-1].state == State.STOPPED
    assert verdicts[-1].reason in (Reason.SYNC_TIMEOUT, Reason.JOINT_TIMEOUT)


def test_a_fault_reported_by_the_board_stops(bench: Bench) -> None:
    bench.guard.trip(Reason.BUS_OFF)
    verdict = bench.cycle()
    assert (verdict.state, verdict.reason, verdict.permitted) == (State.STOPPED, Reason.BUS_OFF, False)


def test_a_tick_over_budget_is_a_fault(bench: Bench, configuration: Configuration) -> None:
    bench.guard.note_tick_time(configuration.tick_budget_us + 1)
    verdict = bench.cycle()
    assert (verdict.state, verdict.reason) == (State.FAULT, Reason.TICK_OVER_BUDGET)


def test_every_property_of_a_frame_reaches_the_firmware(bench: Bench) -> None:
    """Each of these differs from a good frame in one property only, and is a format error for it."""
    good = bench.frames()[0]
    for change in (
        {"is_fd": False, "bitrate_switch": False},
        {"is_extended_id": True},
        {"arbitration_id": 0x7FF},
        {"data": good.data[:3], "dlc": 3},
        {"data": bytes(good.data) + bytes(8), "dlc": 12},
    ):
        fields = {
            "arbitration_id": good.arbitration_id,
            "is_extended_id": False,
            "is_fd": True,
            "bitrate_switch": True,
            "data": good.data,
            **change,
        }
        before = bench.guard.counters["format_errors"]
        bench.guard.receive(can.Message(**fields), bench.now_us)
        assert bench.guard.counters["format_errors"] == before + 1, change


def test_a_remote_frame_is_a_format_error(configuration: Configuration) -> None:
    classic = configuration.changed(wire={"rate_hz": 500, "format": "classic"})
    guard = Guard(classic.block())
    guard.receive(can.Message(arbitration_id=0x020, is_extended_id=False, is_remote_frame=True, dlc=4), 0)
    assert guard.counters["format_errors"] == 1


def test_an_error_frame_is_ignored(bench: Bench) -> None:
    before = bench.guard.counters
    bench.guard.receive(can.Message(is_error_frame=True), bench.now_us)
    assert bench.guard.counters == before


def test_verdicts_keep_their_numbers(bench: Bench) -> None:
    verdict = bench.cycle(external=5.0)
    kept = verdict.residual.copy()
    bench.cycle(external=5.0)
    np.testing.assert_array_equal(verdict.residual, kept)


def resealed(block: bytes, offset: int, word: int) -> bytes:
    """The block with one word changed and a matching CRC."""
    changed = bytearray(block)
    struct.pack_into("<I", changed, offset, word)
    struct.pack_into("<I", changed, 12, zlib.crc32(changed[16:]))
    return bytes(changed)


@pytest.mark.parametrize(
    ("offset", "word", "message"),
    [
        (0, 1, "not a configuration block"),
        (4, 99, "another version of the firmware"),
        (8, 1, "another size"),
        (16, 77, "the other numeric type"),
        (20, 77, "another DBC"),
        (28, 0, "a period, deadline, budget or settling time"),
        (64, 3, "a stop category is not allowed"),
    ],
)
def test_a_refused_block_gives_the_reason(configuration: Configuration, offset: int, word: int, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Guard(resealed(configuration.block(), offset, word))


def test_a_damaged_block_is_refused(configuration: Configuration) -> None:
    damaged = bytearray(configuration.block())
    damaged[500] ^= 1
    with pytest.raises(InputError, match="CRC does not match"):
        Guard(bytes(damaged))


@pytest.mark.parametrize("length", [0, 10, 915, 917])
def test_a_block_of_another_length_is_refused(configuration: Configuration, length: int) -> None:
    with pytest.raises(InputError, match=f"{length} bytes"):
        Guard((configuration.block() * 2)[:length])


def test_a_tick_with_its_frames_takes_few_calls(bench: Bench) -> None:
    """A tick should take 100 us in Python. The load of the machine does not change how many functions are called."""
    bench.tick(bench.frames())
    assert 0 < calls_of(lambda: bench.guard.tick(bench.now_us)) < 1000


@pytest.fixture
def no_cache() -> Iterator[None]:
    load_library.cache_clear()
    yield
    load_library.cache_clear()


@pytest.mark.usefixtures("no_cache")
def test_the_message_for_a_missing_library_names_the_command_that_builds_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(ENVIRONMENT, str(tmp_path / "libtauperp.so"))
    with pytest.raises(InputError, match=r"libtauperp\.so: the firmware's library is missing; `make library`"):
        load_library("float32")


@pytest.mark.usefixtures("no_cache")
def test_a_file_that_is_not_a_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "libtauperp.so").write_text("no library")
    (tmp_path / "tauperp.cdef.h").write_text("int tauperp_numeric(void);")
    monkeypatch.setenv(ENVIRONMENT, str(tmp_path / "libtauperp.so"))
    with pytest.raises(InputError, match="not a library of the Tauperp firmware"):
        load_library("float32")


@pytest.mark.usefixtures("no_cache")
def test_a_library_for_other_numbers_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENVIRONMENT, str(load_library("float32").path))
    with pytest.raises(InputError, match=r"built for float32, not q9\.22"):
        load_library("q9.22")


def test_the_library_has_a_version_and_a_hash() -> None:
    library = load_library("float32")
    assert library.version.count(".") == 2
    assert library.hash == dataclasses.replace(library).hash
    assert len(library.hash) == 12
