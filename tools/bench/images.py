"""Runs the counting programs (QEMU, or Valgrind on the host) and reads what they print."""

import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from library_stack import bound, read_functions
from stack import worst_stack

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build"
CASES = ("none", "payload", "contact", "guard_tick")
SIZES = ("flash_bytes", "guard_bytes", "stack_bytes")
ROOTS = ("guard_init", "guard_receive", "guard_tick", "guard_note_tick_time", "guard_trip", "guard_cycle_complete")
AGREEMENT_PPM = 1000  # allowed difference between ours and a peer, relative to the largest entry
TIMEOUT_S = 1800

Counts = dict[str, Any]


def tool(target: str, name: str) -> str:
    """A tool of the binutils or gcc that builds for the target."""
    if target == "host":
        return os.environ.get("CC", "cc") if name == "gcc" else name
    return os.environ.get("CROSS", "arm-none-eabi-") + name


def compiler(target: str) -> str:
    """The compiler of the target with its version: other versions give other counts."""
    command = [*tool(target, "gcc").split(), "--version"]
    line = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[0]
    return line if target != "host" else f"{line} for {os.uname().machine}"


def lines_of(target: str, image: Path, counted: bool = True) -> list[list[str]]:
    """The lines that a program printed, split into words. Raises RuntimeError if it failed."""
    environment = dict(os.environ)
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None) as folder:
        command = [str(ROOT / "tools" / "qemu-run"), target, str(image)]
        if target == "host":
            command = [str(image)]
            if counted:
                dumps = environment["BENCH_DUMPS"] = f"{folder}/dumps"
                options = ["--combine-dumps=yes", "--dump-line=no", f"--callgrind-out-file={dumps}"]
                command = ["valgrind", "--quiet", f"--log-file={folder}/log", "--tool=callgrind", *options, str(image)]
        # QEMU prints the semihosting output on stderr.
        done = subprocess.run(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
            env=environment,
        )
    if done.returncode != 0:
        raise RuntimeError(f"{image.name} ended with {done.returncode}: {done.stdout[-300:]}")
    return [line.split() for line in done.stdout.splitlines() if line.strip()]


def read_counts(lines: list[list[str]], result: Counts) -> None:
    """Adds the lines of stages.c or guard.c: {case: {mean, worst, states, rank_deficient, stages}, NAME: number}."""
    for kind, *words in lines:
        if kind == "count":
            case, stage, mean, worst, states = words
            entry = result.setdefault(case, {"stages": {}})
            numbers = {"mean": int(mean), "worst": int(worst)}
            if stage == "total":
                entry.update(numbers, states=int(states))
            else:
                entry["stages"][stage] = numbers
        elif kind == "deficient":
            result.setdefault(words[0], {"stages": {}})["rank_deficient"] = int(words[1])
        elif kind == "size":
            result[words[0]] = int(words[1])
        else:
            raise RuntimeError(f"not a line of a counting program: {kind} {' '.join(words)}")


def flash_bytes(target: str, image: Path) -> int:
    """Code, constants and initial data of an ELF: everything that is loaded."""
    lines = subprocess.run([tool(target, "size"), str(image)], capture_output=True, text=True, check=True).stdout
    text, data = lines.splitlines()[1].split()[:2]
    return int(text) + int(data)


def stack_bytes(target: str, numeric: str, opt: str, joints: int) -> int:
    """Largest stack of any call of the guard, from gcc's call graphs and from the code of libgcc's helpers."""
    image = f"{BUILD}/bench/{target}-{numeric}{opt}-guard.elf"

    def text(name: str, *options: str) -> str:
        return subprocess.run([tool(target, name), *options, image], capture_output=True, text=True, check=True).stdout

    functions = {} if target == "host" else read_functions(text("objdump", "-d", "--no-show-raw-insn"), text("nm"))

    def library(name: str) -> int:
        if target == "host":
            raise ValueError(f"the firmware calls {name}, which has no call graph")
        return bound(functions, name)

    graphs = f"bench-*-{numeric}.dir/firmware/**/*.ci"
    return worst_stack(BUILD / "cmake" / target / "CMakeFiles", ROOTS, library, graphs)


def count(target: str, numeric: str, opt: str, joints: int) -> Counts:
    """All counts of ours for one target and numeric type."""
    image = f"{BUILD}/bench/{target}-{numeric}{opt}"
    result: Counts = {}
    for program in ("stages", "guard"):
        read_counts(lines_of(target, Path(f"{image}-{program}.elf")), result)
    for case, numbers in result.items():
        if isinstance(numbers, dict) and case not in CASES:
            numbers["stages"] = {}  # their sum is what is compared
    result["flash_bytes"] = flash_bytes(target, Path(f"{image}-image.elf"))
    result["stack_bytes"] = stack_bytes(target, numeric, opt, joints)
    if result["painted_stack_bytes"] > result["stack_bytes"]:
        raise RuntimeError(f"{image}: stack {result['painted_stack_bytes']} touched, {result['stack_bytes']} known")
    return result


@dataclass(frozen=True)
class Peer:
    """A peer's programs, TARGET-MOTION_PROJECTION-LEVEL-{stages,guard}.elf."""

    target: str
    name: str


def count_peer(peer: Peer) -> Counts:
    result: Counts = {}
    for program in ("stages", "guard"):
        read_counts(lines_of(peer.target, BUILD / "bench" / f"{peer.target}-{peer.name}-{program}.elf"), result)
    return {case: result[case] for case in CASES}


def read_agreement(lines: list[list[str]]) -> Counts:
    """{PEER: {QUANTITY: {states, ppm}}}. Raises RuntimeError where a peer's result differs from ours."""
    result: Counts = {}
    for _, peer, quantity, states, ppm in lines:
        if int(ppm) > AGREEMENT_PPM or int(states) == 0:
            raise RuntimeError(f"{peer} and ours differ in {quantity} by {ppm} ppm, over {states} states")
        result.setdefault(peer, {})[quantity] = {"states": int(states), "ppm": int(ppm)}
    if not result:
        raise RuntimeError("nothing was compared with the peers")
    return result


def agreement(target: str, level: str) -> Counts:
    return read_agreement(lines_of(target, BUILD / "bench" / f"{target}-peers{level}-agree.elf", counted=False))


def best_of(peers: dict[str, Counts]) -> Counts:
    """For each case the peer with the lowest mean; `peer` is its name, and `each` has all of them."""
    result: Counts = {}
    for case in CASES:
        each = {name: counts[case] for name, counts in peers.items()}
        name = min(each, key=lambda name: each[name]["mean"])
        result[case] = {**each[name], "peer": name, "each": each}
    return result
