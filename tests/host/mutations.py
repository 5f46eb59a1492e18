"""Randomly damaged files: bytes lost, repeated or changed, and values that no writer intends."""

import re
from collections.abc import Iterator

import numpy as np

VALUES = (
    b"nan",
    b"inf",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"-1",
    b"0",
    b"",
    b"0x1F",
    b"1,5",
    b"1_0",
    b"99999999999999999999",
)
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:e-?\d+)?")
WORD = re.compile(rb"[A-Za-z_][A-Za-z_]{2,}")


def mutations(data: bytes, count: int, seed: int) -> Iterator[bytes]:
    """This many changed versions of a file, the same for the same seed. Some of them may still be valid."""
    random = np.random.default_rng(seed)
    changes = (_cut, _lose, _double, _flip, _value, _value, _word, _swap)
    for _ in range(count):
        changed = data
        for _ in range(int(random.integers(1, 3))):
            changed = changes[int(random.integers(len(changes)))](changed, random)
        yield changed


def _span(data: bytes, random: np.random.Generator) -> tuple[int, int]:
    start = int(random.integers(len(data) + 1))
    return start, min(len(data), start + int(random.geometric(0.05)))


def _cut(data: bytes, random: np.random.Generator) -> bytes:
    return data[: int(random.integers(len(data) // 2, len(data) + 1))]


def _lose(data: bytes, random: np.random.Generator) -> bytes:
    start, end = _span(data, random)
    return data[:start] + data[end:]


def _double(data: bytes, random: np.random.Generator) -> bytes:
    start, end = _span(data, random)
    return data[:end] + data[start:end] + data[end:]


def _flip(data: bytes, random: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for _ in range(int(random.integers(1, 5))):
        if changed:
            changed[int(random.integers(len(changed)))] = int(random.integers(256))
    return bytes(changed)


def _value(data: bytes, random: np.random.Generator) -> bytes:
    return _replaced(data, NUMBER, VALUES[int(random.integers(len(VALUES)))], random)


def _word(data: bytes, random: np.random.Generator) -> bytes:
    words = WORD.findall(data)
    return _replaced(data, WORD, words[int(random.integers(len(words)))] if words else b"", random)


def _swap(data: bytes, random: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    one, other = (int(random.integers(len(lines))) for _ in range(2))
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _replaced(data: bytes, pattern: re.Pattern[bytes], value: bytes, random: np.random.Generator) -> bytes:
    found = list(pattern.finditer(data))
    if not found:
        return data
    match = found[int(random.integers(len(found)))]
    return data[: match.start()] + value + data[match.end() :]
