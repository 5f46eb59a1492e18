"""Residual error probability of the wire: exact for E2E profile 2 alone, and estimated with the check of CAN before it.

A frame of 64 bits is a code word of the CRC-8 (polynomial 0x2F) over 56 bits of data. An error is undetected if it is a
code word itself. The numbers A_i of code words of weight i follow from the dual code of 256 words by the identity of
MacWilliams. For independent bit errors of probability p, the residual error probability is the sum of A_i p^i
(1-p)^(n-i).

Profile 2 appends a data id that the counter selects. For an error that does not change the counter, the sum is exact.
An error that changes the counter and more than one bit is undetected with a probability of about 2^-8; `residual` adds
these errors. A single flipped bit is always detected (tests/unit/test_e2e.c).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import comb

POLYNOMIAL = 0x2F
CRC_BITS = 8
BITS = 64  # of a frame with 8 bytes, including the CRC
COUNTER_BITS = 4
# Bits of a frame on the wire that an error can hit: a classic frame with 8 bytes and every stuff bit.
WIRE_BITS = 135
# Two errors in a CAN frame undetected by CAN's CRC, because of stuff bits (Tran, Carnegie Mellon University, 1999).
CAN_UNDETECTED = 1.3e-7
# More bad frames of a sender cause a stop (guard_receive.c: a bad frame counts 8, and 4 more as a missing one).
ERROR_RATE_LIMIT = 1 / 13


def reduce(word: int) -> int:
    """Remainder of a polynomial by the CRC's."""
    divisor = 1 << CRC_BITS | POLYNOMIAL
    while word.bit_length() > CRC_BITS:
        word ^= divisor << (word.bit_length() - CRC_BITS - 1)
    return word


def weights(bits: int = BITS) -> list[int]:
    """Code words of each weight, 0 to `bits`."""
    # The syndrome of each single error: the data id is between the data and the CRC, and errors do not affect it.
    columns = [reduce(1 << position) for position in (*range(CRC_BITS), *range(2 * CRC_BITS, bits + CRC_BITS))]
    dual = [0] * (bits + 1)
    for word in range(1 << CRC_BITS):
        dual[sum((word & column).bit_count() & 1 for column in columns)] += 1
    return [
        sum(count * krawtchouk(bits, weight, of) for of, count in enumerate(dual)) >> CRC_BITS
        for weight in range(bits + 1)
    ]


def krawtchouk(bits: int, weight: int, of: int) -> int:
    return sum((-1) ** j * comb(of, j) * comb(bits - of, weight - j) for j in range(weight + 1))


def residual(p: float, bits: int = BITS) -> float:
    """Probability that a frame is wrong and its CRC-8 is valid."""
    chance, other = Fraction(p), 1 - Fraction(p)
    same_counter = float(
        sum(count * chance**i * other ** (bits - i) for i, count in enumerate(weights(bits)) if i and count)
    )
    counter = frame_error(p, COUNTER_BITS) - COUNTER_BITS * p * (1 - p) ** (bits - 1)
    return same_counter + counter * 2.0**-CRC_BITS


def frame_error(p: float, bits: int) -> float:
    return 1 - (1 - p) ** bits


def bit_error_at(rate: float, bits: int) -> float:
    """Bit error probability at which this share of frames is wrong."""
    return 1 - (1 - rate) ** (1 / bits)


@dataclass(frozen=True)
class Estimate:
    """Undetected wrong frames of one robot, per hour."""

    p: float
    e2e: float  # probability per frame, CAN not counted
    with_can: float  # per frame, with CAN's check before it
    e2e_per_hour: float
    with_can_per_hour: float


def estimate(p: float, frames_per_s: float) -> Estimate:
    """For independent bit errors of probability p. `with_can`: a frame on the wire has two or more errors, CAN does
    not detect them, and the CRC-8 is valid by chance."""
    alone = residual(p)
    two = 1 - (1 - p) ** WIRE_BITS - WIRE_BITS * p * (1 - p) ** (WIRE_BITS - 1)
    behind = max(two, 0.0) * CAN_UNDETECTED * 2.0**-CRC_BITS
    return Estimate(p, alone, behind, alone * frames_per_s * 3600, behind * frames_per_s * 3600)
