"""`tauperp config`: the constant block that the library, the process and the boards load."""

import argparse
import json
from typing import Any

from tauperp.config import NUMERICS, Configuration, Numeric, load_configuration
from tauperp.files import write_atomically
from tauperp.firmware import reaction_us
from tauperp.robot.options import add_robot_arguments, chain_of, say_warnings

REACTION_WARNING_MS = 200

HELP = """Check the TOML file of one installation and make the guard's configuration block from it. The block holds the
robot table, thresholds, gains, timing and stop categories, with a CRC-32. Without -o it only checks. A binary
file has two blocks, in float32 and in Q9.22, for the guard's two channels. With --numeric, or as C, it has one."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="TOML file, or the name of a shipped preset")
    parser.add_argument(
        "-o", "--output", metavar="OUT", help="write the block to this file (as C source if it ends in .c)"
    )
    add_robot_arguments(parser, "the file's")
    parser.add_argument(
        "--numeric", choices=list(NUMERICS), help="one channel of this number type (default: two channels; C: float32)"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def run(args: argparse.Namespace) -> int:
    configuration = load_configuration(args.file, robot=args.robot, chain=chain_of(args))
    say_warnings(configuration.robot)
    numeric: Numeric = args.numeric or "float32"
    block = configuration.block(numeric)
    as_c = bool(args.output) and args.output.endswith(".c")
    second = b"" if args.numeric or as_c else configuration.block("q9.22")
    if args.output:
        write_atomically(args.output, _c_source(configuration, block) if as_c else block + second)
    summary = _summary(configuration, numeric, block, second)
    print(json.dumps(summary, indent=2) if args.json else _table(summary))
    return 0


def _c_source(configuration: Configuration, block: bytes) -> str:
    """The block as constants for a program of your own: firmware/api/tauperp.h."""
    words = [f"0x{int.from_bytes(block[i : i + 4], 'little'):08x}u" for i in range(0, len(block), 4)]
    lines = ["    " + ", ".join(words[i : i + 8]) + "," for i in range(0, len(words), 8)]
    return "\n".join(
        [
            f"/* Configuration block of {configuration.robot.name}, written by `tauperp config`. Do not edit. */",
            "#include <stddef.h>",
            "#include <stdint.h>",
            "",
            "extern const uint32_t tauperp_block[];",
            "extern const size_t tauperp_block_size;",
            "const uint32_t tauperp_block[] = {",
            *lines,
            "};",
            "const size_t tauperp_block_size = sizeof tauperp_block;",
            "",
        ]
    )


def _summary(configuration: Configuration, numeric: Numeric, block: bytes, second: bytes) -> dict[str, Any]:
    settings = configuration.settings
    return {
        "configuration": configuration.source,
        "crc": f"{configuration.crc(numeric):08x}",
        "bytes": len(block + second),
        "channels": 2 if second else 1,
        "reaction_ms": round(reaction_us(block) / 1000, 1),
        "numeric": numeric,
        "wire_crc": f"{configuration.wire.crc:08x}",
        "robot": configuration.robot.name,
        "joints": configuration.robot.n,
        "rate_hz": settings.wire.rate_hz,
        "format": settings.wire.format,
        "gain_per_s": settings.observer.gain_per_s,
        "order": settings.subspace.order,
        "tasks": {
            name: {
                "index": settings.task[name].index,
                "threshold_nm": configuration.threshold_nm(name).tolist(),
                "debounce_ticks": settings.task[name].debounce_ticks,
            }
            for name in settings.task.numbers
        },
        "deadline_cycles": {kind: configuration.timeout_cycles(kind) for kind in ("sync", "joint", "task")},
        "tick_budget_us": configuration.tick_budget_us,
    }


def _table(summary: dict[str, Any]) -> str:
    lines = [
        f"{summary['configuration']}: {summary['robot']}, {summary['joints']} joints, "
        f"{summary['rate_hz']:g} Hz {summary['format']}, gain {summary['gain_per_s']:g} 1/s, "
        f"{summary['order'].replace('_', ' ')}",
        f"{'task':<9}{'index':<7}{'debounce':<10}threshold Nm",
    ]
    for name, task in summary["tasks"].items():
        if task["index"] == "off":
            lines.append(f"{name:<9}off")
            continue
        values = task["threshold_nm"]
        text = f"{values[0]:g}" if len(set(values)) == 1 else " ".join(f"{value:g}" for value in values)
        lines.append(f"{name:<9}{task['index']:<7}{task['debounce_ticks']:<10}{text}")
    deadlines = ", ".join(f"{kind} {cycles}" for kind, cycles in summary["deadline_cycles"].items())
    lines.append(f"deadlines in cycles: {deadlines}; tick budget {summary['tick_budget_us']} us")
    reaction = f"worst-case reaction {summary['reaction_ms']:g} ms from a step of twice a threshold to the stop frame"
    slow = summary["reaction_ms"] > REACTION_WARNING_MS
    lines.append(reaction + (f": longer than {REACTION_WARNING_MS} ms, a person may be hurt by then" if slow else ""))
    lines.append(
        f"block {summary['crc']}, {summary['bytes']} bytes, "
        f"{'two channels' if summary['channels'] == 2 else summary['numeric']}, for wire {summary['wire_crc']}"
    )
    return "\n".join(lines)
