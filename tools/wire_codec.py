"""C code that packs and unpacks the messages of the wire: one struct per message, with raw integers as its fields.

Signals are little-endian, as the whole wire is. A byte belongs either to the signals of every frame or to the groups of
a multiplexed message, never to both. CRC and counter are ordinary signals here; e2e.h writes them afterwards.
"""

import itertools
from collections.abc import Container, Iterable

from cantools.database.can import Message, Signal
from cantools.database.can.c_source import camel_to_snake_case

from tauperp.errors import InputError

PREFIX = "tauperp"
INDENT = "    "
CHOICES_MAX = 4


def snake(name: str) -> str:
    return str(camel_to_snake_case(name))


def struct_of(message: Message) -> str:
    return f"struct {PREFIX}_{snake(message.name)}_t"


def field_type(signal: Signal) -> str:
    bits = next(bits for bits in (8, 16, 32) if signal.length <= bits)
    return f"{'' if signal.is_signed else 'u'}int{bits}_t"


def field_lines(signals: Iterable[Signal]) -> list[str]:
    """The members of a struct in their order: those of one type in one declaration."""
    return [
        f"{INDENT}{kind} {', '.join(snake(signal.name) for signal in group)};"
        for kind, group in itertools.groupby(signals, field_type)
    ]


def check(message: Message) -> None:
    """Raises InputError for a signal that this code cannot carry."""
    for signal in message.signals:
        whole = signal.length in (8, 16, 32) or not signal.is_signed
        if signal.byte_order != "little_endian" or signal.length > 32 or signal.is_float or not whole:
            raise InputError(f"{message.name}.{signal.name}: not a little-endian integer of 1 to 32 bits")


def pieces(signal: Signal) -> list[tuple[int, int, int, int]]:
    """The part of the signal in each byte: (byte, shift in the byte, shift in the value, mask before the shift)."""
    first, end = signal.start, signal.start + signal.length
    result = []
    for byte in range(first // 8, (end - 1) // 8 + 1):
        low, high = max(first, 8 * byte), min(end, 8 * byte + 8)
        result.append((byte, low - 8 * byte, low - first, (1 << (high - low)) - 1))
    return result


def shifted(value: str, operator: str, shift: int) -> str:
    return f"({value} {operator} {shift}u)" if shift else value


def byte_lines(signals: Iterable[Signal], indent: str) -> dict[int, str]:
    """Statements that fill the bytes of these signals, by byte."""
    terms: dict[int, list[str]] = {}
    for signal in signals:
        value = f"(uint32_t)message->{snake(signal.name)}"
        for byte, at, down, mask in pieces(signal):
            part = f"({shifted(value, '>>', down)} & 0x{mask:02X}u)"
            terms.setdefault(byte, []).append(shifted(part, "<<", at))
    return {byte: f"{indent}data[{byte}] = (uint8_t)({' | '.join(parts)});" for byte, parts in sorted(terms.items())}


def field_line(signal: Signal, indent: str) -> str:
    terms = []
    for byte, at, up, mask in pieces(signal):
        value = f"((uint32_t)data[{byte}]{f' >> {at}u' if at else ''})" if at else f"(uint32_t)data[{byte}]"
        terms.append(shifted(f"({value} & 0x{mask:02X}u)" if mask != 0xFF else value, "<<", up))
    kind = field_type(signal)
    unsigned = f"({kind.removeprefix('u').replace('int', 'uint')})({' | '.join(terms)})"
    return f"{indent}message->{snake(signal.name)} = {f'({kind})' if signal.is_signed else ''}{unsigned};"


def groups_of(message: Message) -> tuple[list[Signal], dict[int, list[Signal]], str]:
    """Signals of every frame, those of each group, and the multiplexer's name ("" if there is none)."""
    always = [signal for signal in message.signals if not signal.multiplexer_ids]
    groups: dict[int, list[Signal]] = {}
    for signal in message.signals:
        for group in signal.multiplexer_ids or ():
            groups.setdefault(group, []).append(signal)
    name = next((signal.name for signal in message.signals if signal.is_multiplexer), "")
    shared = {piece[0] for signal in always for piece in pieces(signal)} & {
        piece[0] for group in groups.values() for signal in group for piece in pieces(signal)
    }
    if shared:
        raise InputError(f"{message.name}: byte {min(shared)} belongs to a group and to every frame")
    return always, dict(sorted(groups.items())), name


def pack_function(message: Message) -> list[str]:
    always, groups, multiplexer = groups_of(message)
    parameters = f"uint8_t data[{message.length}], const {struct_of(message)} *message"
    lines = [f"void {PREFIX}_{snake(message.name)}_pack({parameters}) {{"]
    statements = byte_lines(always, INDENT)
    lines += [statements.get(byte, f"{INDENT}data[{byte}] = 0u;") for byte in range(message.length)]
    if groups:
        lines.append(f"{INDENT}switch (message->{snake(multiplexer)}) {{")
        for group, signals in groups.items():
            lines += [f"{INDENT}case {group}u:", *byte_lines(signals, 2 * INDENT).values(), f"{2 * INDENT}break;"]
        lines += [f"{INDENT}default: /* nothing else */", f"{2 * INDENT}break;", f"{INDENT}}}"]
    return [*lines, "}", ""]


def unpack_function(message: Message) -> list[str]:
    if message.is_multiplexed():
        raise InputError(f"{message.name}: the firmware receives no multiplexed message")
    parameters = f"{struct_of(message)} *message, const uint8_t data[{message.length}]"
    head = f"void {PREFIX}_{snake(message.name)}_unpack({parameters}) {{"
    return [head, *(field_line(signal, INDENT) for signal in message.signals), "}", ""]


def choice_lines(messages: Iterable[Message], enumerated: Container[str]) -> list[str]:
    """Value tables as macros, except those that values.h has as enumerations."""
    lines = []
    for message in messages:
        for signal in message.signals:
            if len(signal.choices or {}) > CHOICES_MAX or f"{message.name}.{signal.name}" in enumerated:
                continue
            for value, text in (signal.choices or {}).items():
                name = "_".join((PREFIX, snake(message.name), snake(signal.name), snake(str(text)), "CHOICE")).upper()
                lines.append(f"#define {name} {int(value)}u")
    return lines


def messages_header(messages: list[Message], node: str, enumerated: Container[str]) -> str:
    """messages.h. Raises InputError for a message that this code cannot carry."""
    lines = [
        "/* messages: the frames of the wire as structs of raw integers. Generated by tools/dbc2c; not edited.",
        " *",
        " * Physical value = raw value times the factor of the DBC (protocol.h). Packing keeps the signal's bits only.",
        " */",
        "#ifndef TAUPERP_MESSAGES_H",
        "#define TAUPERP_MESSAGES_H",
        "",
        "#include <stdint.h>",
        "",
    ]
    for message in messages:
        name = snake(message.name).upper()
        lines += [
            f"#define {PREFIX.upper()}_{name}_FRAME_ID 0x{message.frame_id:X}u",
            f"#define {PREFIX.upper()}_{name}_LENGTH   {message.length}u",
        ]
    lines += ["", *choice_lines(messages, enumerated), ""]
    for message in messages:
        check(message)
        lines += [f"{struct_of(message)} {{"]
        lines += field_lines(message.signals)
        lines += ["};", ""]
    for message in messages:
        function = pack_function if node in message.senders else unpack_function
        lines.append(function(message)[0].removesuffix(" {") + ";")
    return "\n".join([*lines, "", "#endif", ""])


def messages_source(messages: list[Message], node: str) -> str:
    """messages.c: functions that pack the messages sent by `node` and unpack those that it receives."""
    lines = ["/* Generated by tools/dbc2c from dbc/tauperp.dbc; not edited. */", '#include "messages.h"', ""]
    for message in messages:
        lines += pack_function(message) if node in message.senders else unpack_function(message)
    return "\n".join(lines)
