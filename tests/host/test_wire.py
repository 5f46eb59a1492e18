"""The host's codec: cantools and autosar-e2e accept its frames, and it judges frames as the firmware does."""

import random

import can
import pytest
from counting import calls_of
from e2e import p02

from tauperp.errors import InputError
from tauperp.wire import E2EStatus, Receiver, Sender, Wire, WireMessage

HEADER = ("CRC", "Counter")
JOINT = {"SensorStatus": 0, "CycleHigh": 0, "Position": 0.5, "Velocity": -0.25, "Torque": 12.34}


@pytest.fixture(scope="module")
def wire() -> Wire:
    return Wire.read()


def random_signals(message: WireMessage, rng: random.Random) -> dict[str, float]:
    """Every signal that one frame carries, anywhere in its range."""
    definition = message.definition
    names = {s.name for s in definition.signals if not s.multiplexer_ids} - set(HEADER)
    raw = {}
    for multiplexer in (s for s in definition.signals if s.is_multiplexer):
        page = rng.randint(int(multiplexer.minimum), int(multiplexer.maximum))
        raw[multiplexer.name] = page
        names |= {s.name for s in definition.signals if s.multiplexer_ids and page in s.multiplexer_ids}
    signals: dict[str, float] = {}
    for signal in definition.signals:
        if signal.name in names:
            low, high = (round(limit / signal.scale) for limit in (signal.minimum, signal.maximum))
            signals[signal.name] = raw.get(signal.name, rng.randint(low, high)) * signal.scale
    return signals


@pytest.mark.parametrize("name", list(Wire.read().messages))
def test_every_message_decodes_in_cantools_and_checks_in_autosar_e2e(wire: Wire, name: str, seed: int) -> None:
    print(f"seed {seed}")
    rng = random.Random(seed)
    message = wire.message(name)
    sender = Sender(wire, fd=True)
    for sent in range(1, 101):
        signals = random_signals(message, rng)
        frame = sender.frame(name, signals, cycle=sent)
        assert p02.e2e_p02_check(frame.data, message.data_ids)
        decoded = message.definition.decode(bytes(frame.data), decode_choices=False)
        assert decoded.pop("Counter") == sent % 16
        assert decoded.pop("CRC") == frame.data[0]
        assert decoded == pytest.approx(signals, abs=1e-9)


@pytest.mark.parametrize("name", [n for n, m in Wire.read().messages.items() if not m.definition.is_multiplexed()])
def test_the_fast_encoder_gives_cantools_bytes(wire: Wire, name: str, seed: int) -> None:
    print(f"seed {seed}")
    rng = random.Random(seed)
    message = wire.message(name)
    for _ in range(500):
        signals = {key: value + rng.uniform(-0.4, 0.4) * scale for key, value, scale in scaled(message, rng)}
        expected = message.definition.encode({"CRC": 0, "Counter": 0, **signals}, strict=False)
        assert message.encode(signals) == expected


def scaled(message: WireMessage, rng: random.Random) -> list[tuple[str, float, float]]:
    signals = random_signals(message, rng)
    return [(name, value, message.definition.get_signal_by_name(name).scale) for name, value in signals.items()]


def test_frames_have_the_requested_format(wire: Wire) -> None:
    for fd in (False, True):
        frame = Sender(wire, fd=fd).frame("Sync", {"Cycle": 7}, cycle=7, timestamp=0.5)
        assert (frame.arbitration_id, frame.is_extended_id, frame.dlc) == (0x020, False, 4)
        assert (frame.is_fd, frame.bitrate_switch, frame.timestamp) == (fd, fd, 0.5)


def test_cycle_messages_carry_the_cycles_nibble_and_others_count_frames(wire: Wire) -> None:
    assert {name for name, message in wire.messages.items() if message.counter_is_cycle} == {
        "Sync",
        "TaskCommand",
        *(f"JointState{joint}" for joint in range(1, 9)),
    }
    sender = Sender(wire, fd=False)
    assert sender.frame("JointState3", JOINT, cycle=0x123).data[1] & 0x0F == 3
    resets = [sender.frame("GuardReset", {"Request": 0, "TripNumber": 1}).data[1] & 0x0F for _ in range(17)]
    assert resets == [*range(1, 16), 0, 1]


def test_a_cycle_message_without_its_cycle_is_refused(wire: Wire) -> None:
    with pytest.raises(InputError, match="Sync: its counter is the cycle's"):
        Sender(wire, fd=False).frame("Sync", {"Cycle": 1})


@pytest.mark.parametrize(
    ("signals", "complaint"),
    [
        ({**JOINT, "Position": 4.0961}, "JointState1.Position: 4.0961 rad is outside"),
        ({**JOINT, "Velocity": -8.2}, "JointState1.Velocity"),
        ({**JOINT, "Torque": -327.68}, "JointState1.Torque"),
        ({**JOINT, "SensorStatus": 4}, "JointState1.SensorStatus: 4 is outside 0 to 3"),
        ({**JOINT, "Torque": float("nan")}, "nan is not a number that a frame can carry"),
        ({**JOINT, "Torque": float("inf")}, "inf is not a number that a frame can carry"),
        ({"CycleHigh": 0, "Position": 0.0, "Velocity": 0.0, "Torque": 0.0}, "signal SensorStatus is missing"),
        ({**JOINT, "Mass": 1.0}, "no signal Mass to set"),
        ({**JOINT, "Counter": 1}, "no signal Counter to set"),
    ],
)
def test_signals_that_do_not_fit_are_refused_and_never_clamped(
    wire: Wire, signals: dict[str, float], complaint: str
) -> None:
    with pytest.raises(InputError, match=complaint):
        Sender(wire, fd=False).frame("JointState1", signals, cycle=1)


def test_multiplexed_signals_that_do_not_fit_are_refused(wire: Wire) -> None:
    sender = Sender(wire, fd=False)
    good = {"Joint": 2, "Residual3": 1.0, "Index3": 0.5, "Threshold3": 2.0, "Channel3": 1}
    for signals in (
        {**good, "Index3": 400.0},
        {**good, "Joint": 8},
        {key: good[key] for key in ("Joint", "Residual3", "Index3")},
        {key: good[key] for key in ("Residual3", "Index3", "Threshold3")},
        {**good, "Residual4": 1.0},
        {**good, "Residual3": float("nan")},
    ):
        with pytest.raises(InputError, match="GuardIndex"):
            sender.frame("GuardIndex", signals)


def test_a_refused_frame_does_not_advance_the_counter(wire: Wire) -> None:
    sender = Sender(wire, fd=False)
    with pytest.raises(InputError):
        sender.frame("GuardReset", {"Request": 2, "TripNumber": 0})
    assert sender.frame("GuardReset", {"Request": 1, "TripNumber": 0}).data[1] & 0x0F == 1


def test_an_unknown_message_is_refused(wire: Wire) -> None:
    with pytest.raises(InputError, match="no message JointState9"):
        wire.message("JointState9")


def joint_frame(wire: Wire, counter: int) -> can.Message:
    return Sender(wire, fd=True).frame("JointState1", JOINT, cycle=counter)


def test_the_receiver_names_every_sequence_error(wire: Wire) -> None:
    receiver = Receiver(wire)
    script = [
        (14, E2EStatus.INITIAL, 0),
        (15, E2EStatus.OK, 0),
        (0, E2EStatus.OK, 0),
        (0, E2EStatus.REPEATED, 0),
        (4, E2EStatus.SOME_LOST, 3),
        (3, E2EStatus.WRONG_SEQUENCE, 0),
        (4, E2EStatus.OK, 0),
        (9, E2EStatus.WRONG_SEQUENCE, 0),
        (10, E2EStatus.OK, 0),
    ]
    for counter, status, lost in script:
        received = receiver.receive(joint_frame(wire, counter))
        assert received is not None
        assert (received.status, received.lost) == (status, lost)
        assert received.signals == (pytest.approx(JOINT) if status.accepted else {})


def test_every_flipped_bit_is_a_wrong_crc_and_leaves_the_counter_reference(wire: Wire) -> None:
    receiver = Receiver(wire)
    receiver.receive(joint_frame(wire, 4))
    for bit in range(64):
        frame = joint_frame(wire, 5)
        frame.data[bit // 8] ^= 1 << bit % 8
        received = receiver.receive(frame)
        assert received is not None
        assert received.status is E2EStatus.WRONG_CRC
    received = receiver.receive(joint_frame(wire, 5))
    assert received is not None
    assert received.status is E2EStatus.OK


def test_a_frame_of_another_wire_is_not_a_message(wire: Wire) -> None:
    receiver = Receiver(wire)
    data = joint_frame(wire, 1).data
    remote = can.Message(arbitration_id=0x101, is_extended_id=False, is_remote_frame=True)
    remote.data, remote.dlc = data, 8
    for frame in (
        remote,
        can.Message(arbitration_id=0x109, is_extended_id=False, data=data),
        can.Message(arbitration_id=0x101, is_extended_id=True, data=data),
        can.Message(arbitration_id=0x101, is_extended_id=False, data=data[:7]),
        can.Message(arbitration_id=0x101, is_extended_id=False, data=data + b"\0", is_fd=True),
        can.Message(arbitration_id=0x101, is_extended_id=False, is_error_frame=True, data=data),
    ):
        assert receiver.receive(frame) is None


def test_signals_out_of_range_are_named(wire: Wire) -> None:
    receiver = Receiver(wire)
    receiver.receive(joint_frame(wire, 0))
    message = wire.message("JointState1")
    frame = joint_frame(wire, 1)
    frame.data[4:6] = b"\x00\x80"  # raw -32768: not available
    message.seal(frame.data, 1)
    received = receiver.receive(frame)
    assert received is not None
    assert (received.status, received.invalid) == (E2EStatus.OK, ("Velocity",))


def test_a_page_that_the_dbc_does_not_know_is_named_and_has_no_signals(wire: Wire) -> None:
    receiver = Receiver(wire)
    message = wire.message("GuardStatus")
    for counter in (1, 2):
        data = bytearray([0, 0xF0, 0, 0, 0, 0, 0, 0])
        message.seal(data, counter)
        received = receiver.receive(can.Message(arbitration_id=message.id, is_extended_id=False, data=data))
    assert received is not None
    assert (received.status, received.signals, received.invalid) == (E2EStatus.OK, {}, ("Page",))


def test_nine_frames_of_a_cycle_encode_in_few_calls(wire: Wire) -> None:
    sender = Sender(wire, fd=True)

    def cycle(number: int) -> None:
        sender.frame("Sync", {"Cycle": number & 0xFFFF}, cycle=number)
        sender.frame("TaskCommand", {"Task": 1, "AccelX": 0.1, "AccelY": 0.2, "AccelZ": 0.3}, cycle=number)
        for name in names:
            sender.frame(name, JOINT, cycle=number)

    names = [f"JointState{joint}" for joint in range(1, 8)]
    cycle(0)
    assert 0 < calls_of(lambda: cycle(1)) < 1000


def test_a_missing_dbc_is_an_input_error(tmp_path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.dbc: cannot read the wire's DBC file: No such file"):
        Wire.read(tmp_path / "nowhere.dbc")


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("BO_ 16 StopCommand", "BO_ sixteen StopCommand", "not a DBC file"),
        (
            'BA_ "E2EDataIDs" BO_ 32 "39',
            'BA_ "E2EDataIDs" BO_ 32 "c2',
            "StopCommand and Sync share a data id at counter 0",
        ),
        ('BA_ "E2EDataIDs" BO_ 32 "39', 'BA_ "E2EDataIDs" BO_ 32 "', "Sync: E2EDataIDs must be 16 bytes, not 15"),
        ('BA_ "E2EDataIDs" BO_ 32 "39', 'BA_ "E2EDataIDs" BO_ 32 "xy', "Sync: E2EDataIDs are not hex digits"),
        ("TimeoutCycles", "Timeout", "attribute TimeoutCycles is missing"),
        ("WireVersion", "Version", "attribute WireVersion is missing"),
    ],
)
def test_a_dbc_that_breaks_a_rule_is_refused_with_its_place(
    wire: Wire, tmp_path, old: str, new: str, complaint: str
) -> None:
    text = wire.path.read_text()
    assert old in text
    path = tmp_path / "broken.dbc"
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=complaint) as caught:
        Wire.read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
