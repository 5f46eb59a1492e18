"""Worst-case bus load: every stuff bit that the standard allows, every event in every cycle.

Frame lengths are those of ISO 11898-1:2015 for standard ids, with the 3 bits of intermission.
"""

from dataclasses import dataclass

from tauperp.bus import BITRATE, DATA_BITRATE
from tauperp.errors import InputError
from tauperp.wire import Wire

_INTERMISSION = 3
_STUFF_RUN = 4  # after the first five equal bits, every fourth further bit can cost a stuff bit


@dataclass(frozen=True)
class FrameBits:
    """Bits of one frame at each of the two rates; a classic frame has nominal bits only."""

    nominal: int
    data: int = 0

    def seconds(self, bitrate: float, data_bitrate: float) -> float:
        return self.nominal / bitrate + self.data / data_bitrate


def classic_bits(length: int) -> FrameBits:
    """Longest classic frame with `length` data bytes, 0 to 8."""
    stuffable = 1 + 11 + 1 + 1 + 1 + 4 + 8 * length + 15  # SOF, id, RTR, IDE, r0, DLC, data, CRC
    unstuffed = 1 + 2 + 7 + _INTERMISSION  # CRC delimiter, ACK with its delimiter, end of frame
    return FrameBits(stuffable + (stuffable - 1) // _STUFF_RUN + unstuffed)


def fd_bits(length: int) -> FrameBits:
    """Longest CAN FD frame with bit-rate switch and `length` data bytes, 0 to 8.

    As many stuff bits as possible are counted in the arbitration phase, at the lower rate.
    """
    arbitration = 1 + 11 + 1 + 1 + 1 + 1 + 1  # SOF, id, RRS, IDE, FDF, res, BRS
    stuffable = 1 + 4 + 8 * length  # ESI, DLC, data
    slow_stuff = (arbitration - 1) // _STUFF_RUN
    fast_stuff = (arbitration + stuffable - 1) // _STUFF_RUN - slow_stuff
    check = 4 + 17  # stuff count and CRC-17, with a fixed stuff bit first and after every fourth bit
    fixed_stuff = 1 + (check - 1) // 4
    end = 2 + 2 + 1 + 7 + _INTERMISSION  # CRC delimiter and ACK (each may take two), ACK delimiter, end of frame
    return FrameBits(arbitration + slow_stuff + end, stuffable + fast_stuff + check + fixed_stuff)


def worst_case_load(
    wire: Wire,
    *,
    joints: int,
    rate_hz: float,
    fd: bool,
    bitrate: float = BITRATE,
    data_bitrate: float = DATA_BITRATE,
) -> float:
    """Share of the bus time that the wire occupies in the worst case; 1 for a bus that is never idle.

    joints      1 to 8 of the JointState messages are on the bus
    rate_hz     cycles per second; each message keeps its ratio to Sync's cycle time, an event counts once per cycle
    """
    if not 1 <= joints <= 8 or min(rate_hz, bitrate, data_bitrate) <= 0:
        raise InputError(
            f"bus load: {joints} joints at {rate_hz:g} Hz on {bitrate:g}/{data_bitrate:g} bit/s is not a bus"
        )
    cycle_ms = wire.message("Sync").cycle_time_ms
    seconds_per_cycle = 0.0
    for message in wire.messages.values():
        if message.joint > joints:
            continue
        bits = fd_bits(message.length) if fd else classic_bits(message.length)
        frames_per_cycle = cycle_ms / message.cycle_time_ms if message.cycle_time_ms else 1.0
        seconds_per_cycle += frames_per_cycle * bits.seconds(bitrate, data_bitrate)
    return seconds_per_cycle * rate_hz
