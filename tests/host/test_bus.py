"""Opening a bus, and the bus load of the wire."""

import argparse
import subprocess
import sys

import can
import pytest

from tauperp.bus import add_bus_arguments, open_bus
from tauperp.busload import classic_bits, fd_bits, worst_case_load
from tauperp.errors import InputError
from tauperp.wire import Wire


def parsed(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_bus_arguments(parser)
    return parser.parse_args(arguments)


def test_without_arguments_the_bus_is_the_virtual_one_and_carries_frames() -> None:
    sent = can.Message(arbitration_id=0x101, is_extended_id=False, data=b"\1\2", is_fd=True)
    with open_bus(parsed()) as one, open_bus() as other:
        one.send(sent)
        received = other.recv(1.0)
    assert received is not None
    assert received.equals(sent, timestamp_delta=None, check_channel=False, check_direction=False)


def test_channels_are_separate() -> None:
    with (
        open_bus(parsed("-c", "left", "-i", "virtual")) as left,
        open_bus(interface="virtual", channel="right") as right,
    ):
        left.send(can.Message(arbitration_id=1))
        assert right.recv(0.0) is None


def test_the_command_line_overrides_the_callers_options() -> None:
    with open_bus(parsed("-i", "virtual", "-c", "named"), interface="socketcan", channel="can0") as bus:
        assert "named" in bus.channel_info


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        (("-i", "socketcan", "-c", "nosuchcan0"), "CAN bus socketcan nosuchcan0: "),
        (("-i", "socketcan"), "CAN bus socketcan: --channel is missing"),
        (("-i", "slcan", "-c", "nosuchtty"), "CAN bus slcan nosuchtty: "),
        (("-c", "can7"), "CAN bus can7: no interface is given"),
    ],
)
def test_a_missing_bus_gives_one_line_that_names_it(arguments: tuple[str, ...], place: str) -> None:
    with pytest.raises(InputError) as caught:
        open_bus(parsed(*arguments))
    message = str(caught.value)
    assert message.startswith(place)
    assert len(message) > len(place)
    assert "\n" not in message


def test_the_command_reports_a_missing_bus_once(capfd: pytest.CaptureFixture[str]) -> None:
    """In a separate process: python-can's log goes to its default handlers."""
    command = [sys.executable, "-m", "tauperp.cli", "monitor", "--once", "-i", "socketcan", "-c", "nosuchcan0"]
    assert subprocess.run(command, check=False).returncode == 2
    output = capfd.readouterr()
    assert output.out == ""
    assert len(output.err.splitlines()) == 1
    assert output.err.startswith("tauperp: CAN bus socketcan nosuchcan0: ")


def test_a_driver_that_fails_gives_one_line_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(**_: object) -> can.BusABC:
        raise NameError("name 'canOpen' is not defined")  # what python-can's kvaser raises without its library

    monkeypatch.setattr(can, "Bus", broken)
    with pytest.raises(InputError, match=r"^CAN bus virtual tauperp: its driver cannot be used here .*canOpen"):
        open_bus()


def test_an_unknown_interface_is_named() -> None:
    with pytest.raises(InputError, match="CAN bus carrierpigeon: Unknown interface type"):
        open_bus(interface="carrierpigeon")


def test_frame_lengths_are_the_published_worst_cases() -> None:
    """Classic, 8 bytes: 135 bits with intermission (Davis, Burns, Bril and Lukkien 2007, eq. 1, standard ids)."""
    assert [classic_bits(length).nominal for length in range(9)] == [55 + 10 * length for length in range(9)]
    assert classic_bits(8).data == 0
    # ISO 11898-1:2015 for 8 bytes: 17 bits of arbitration with 4 stuff bits and 15 after the CRC, and
    # ESI, DLC, 64 data bits, 17 stuff bits, stuff count, CRC-17 and its 6 fixed stuff bits at the higher rate.
    assert fd_bits(8).nominal == 17 + 4 + 15
    assert fd_bits(8).data == 1 + 4 + 64 + 17 + 4 + 17 + 6


@pytest.mark.parametrize(("rate_hz", "fd"), [(500, False), (1000, True)])
def test_eight_joints_leave_a_tenth_of_the_bus_free_at_worst(rate_hz: float, fd: bool) -> None:
    load = worst_case_load(Wire.read(), joints=8, rate_hz=rate_hz, fd=fd)
    print(f"{load:.1%} at {rate_hz} Hz, {'CAN FD 1/5' if fd else 'classic 1'} Mbit/s")
    assert 0.5 < load <= 0.9


def test_the_load_grows_with_joints_and_rate_and_falls_with_the_bit_rate() -> None:
    wire = Wire.read()
    seven = worst_case_load(wire, joints=7, rate_hz=500, fd=False)
    # StopCommand, TaskCommand, a GuardStatus or GuardIndex, an eighth of a GuardEvent and 7 joints of 135 bits,
    # Sync and GuardReset of 95, in 2 ms
    assert seven == pytest.approx((10.125 * 135 + 2 * 95) * 1e-6 / 2e-3)
    assert worst_case_load(wire, joints=8, rate_hz=500, fd=False) - seven == pytest.approx(135e-6 / 2e-3)
    assert worst_case_load(wire, joints=7, rate_hz=1000, fd=False) == pytest.approx(2 * seven)
    assert worst_case_load(wire, joints=7, rate_hz=500, fd=False, bitrate=500_000) == pytest.approx(2 * seven)
    assert worst_case_load(wire, joints=7, rate_hz=500, fd=True) < seven


@pytest.mark.parametrize("joints", [0, 9])
def test_the_bus_load_of_no_or_too_many_joints_is_refused(joints: int) -> None:
    with pytest.raises(InputError, match="bus load"):
        worst_case_load(Wire.read(), joints=joints, rate_hz=500, fd=False)
