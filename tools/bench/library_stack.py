"""Stack of functions without a call graph by gcc (libgcc, newlib), from the instructions of the linked program.

This is an upper bound: the sum of all that each reachable function subtracts from the stack pointer, each function
once. It is valid if no library function is recursive. No integer or float helper is.
"""

import re
from dataclasses import dataclass, field

_LABEL = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
_SYMBOL = re.compile(r"^([0-9a-f]+) [Tt] (\S+)$")
_INSTRUCTION = re.compile(r"^\s*[0-9a-f]+:\s+(\S+)\s*(.*)$")
_TARGET = re.compile(r"<([^>+]+)(?:\+0x[0-9a-f]+)?>")
_REGISTERS = re.compile(r"\{([^}]*)\}")
_SUBTRACT = re.compile(r"^sp, (?:sp, )?#(\d+)")
_PRE_INDEXED = re.compile(r"\[sp, #-(\d+)\]!")
_WRITES_SP = re.compile(r"^sp\b|\bsp!|\[sp, [^\]]*\]!")
# Instructions that release stack or do not change the stack pointer.
_RELEASES = re.compile(r"^(pop|vpop|ldm|ldmia|ldmfd|vldmia|add|cmp|cmn|tst)(\.[nw])?$|^(add|pop|ldm\w*)\w{2}$")
_RETURNS = re.compile(r"^(b|bx|b\.n|b\.w|udf)$")


@dataclass
class Function:
    takes: int = 0
    reaches: set[str] = field(default_factory=set)


def _register_bytes(operands: str) -> int:
    """Bytes of a register list as objdump writes it: r4, r5, fp or s16-s31 or d8."""
    match = _REGISTERS.search(operands)
    if match is None:
        raise ValueError(f"no registers in {operands!r}")
    total = 0
    for part in match[1].replace(" ", "").split(","):
        first, _, last = part.partition("-")
        size = 8 if first.startswith("d") else 4
        total += size * (int(last[1:]) - int(first[1:]) + 1 if last else 1)
    return total


def taken(mnemonic: str, operands: str) -> int:
    """Bytes that one instruction subtracts from the stack pointer. Raises ValueError if that is unknown."""
    name = mnemonic.split(".")[0]
    if name.startswith(("push", "vpush")) or (name.startswith(("stmdb", "stmfd", "vstmdb")) and "sp!" in operands):
        return _register_bytes(operands)
    if pre_indexed := _PRE_INDEXED.search(operands):
        return int(pre_indexed[1])
    if name.startswith("sub") and (subtracted := _SUBTRACT.match(operands)):
        return int(subtracted[1])
    if _WRITES_SP.search(operands) and not _RELEASES.match(mnemonic):
        raise ValueError(f"{mnemonic} {operands}: its effect on the stack pointer is not known")
    return 0


def _ends(mnemonic: str, operands: str) -> bool:
    """Whether control cannot continue with the next instruction."""
    return bool(_RETURNS.match(mnemonic)) or (mnemonic.startswith(("pop", "ldm", "ldr")) and "pc" in operands)


def read_functions(disassembly: str, symbols: str = "") -> dict[str, Function]:
    """The stack of each function and the functions it may enter, from `objdump -d --no-show-raw-insn` and `nm`."""
    functions: dict[str, Function] = {}
    at: dict[int, Function] = {}
    name, open_end = "", False
    for line in disassembly.splitlines():
        if label := _LABEL.match(line):
            if open_end:  # falls through into the next one
                functions[name].reaches.add(label[2])
            name, open_end = label[2], False
            at[int(label[1], 16)] = functions.setdefault(name, Function())
        elif name and (instruction := _INSTRUCTION.match(line)):
            mnemonic, operands = instruction[1], instruction[2].split(";")[0].split("@")[0].strip()
            if mnemonic.startswith((".", "nop")):  # a literal, or padding before the next function
                continue
            function = functions[name]
            function.reaches |= {target for target in _TARGET.findall(operands) if target != name}
            try:
                function.takes += taken(mnemonic, operands)
            except ValueError:
                function.takes = 1 << 30  # an error only if its bound is requested
            open_end = not _ends(mnemonic, operands)
    for address, other in (match.groups() for match in map(_SYMBOL.match, symbols.splitlines()) if match):
        if int(address, 16) in at:  # another name of the same code
            functions.setdefault(other, at[int(address, 16)])
    return functions


def bound(functions: dict[str, Function], root: str) -> int:
    """Largest number of bytes that a call of `root` takes; 0 if it is not linked, because nothing calls it."""
    seen: set[str] = set()
    todo = [root] if root in functions else []
    while todo:
        name = todo.pop()
        if name not in seen:
            seen.add(name)
            todo += functions[name].reaches & functions.keys()
    total = sum(functions[name].takes for name in seen)
    if total >= 1 << 30:
        raise ValueError(f"{root}: its use of the stack cannot be determined from its code")
    return total
