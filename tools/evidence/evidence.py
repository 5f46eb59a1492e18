#!/usr/bin/env python3
"""Runs the checks of parts.toml and writes one page on which each number has its command, commit and hash.

    evidence.py [--out out/evidence] [--parts FILE] [--minutes 60] [--patience 1] [--only WORD...]

A part is green if its command ends with 0. It is red if the command fails, takes too long or does not exist yet ("not
available"). The complete output of each part is a file next to the page, and the page states its SHA-256. The page is
index.md: it is written at the end, or not at all. The former page and its files are removed first. --patience
multiplies every time limit, for a machine with other work; the seconds of processor time show what an idle one needs.
Exit code 1 if anything is red or the sources changed meanwhile, 130 after Ctrl-C.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import re
import signal
import subprocess
import sys
import threading
import time
import tomllib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LAST_LINES = 12
COLOURS = re.compile(r"\x1b\[[0-9;]*m")


@dataclass(frozen=True)
class Part:
    """One check."""

    name: str
    goal: str
    command: str
    minutes: float
    keep: str = ""


@dataclass(frozen=True)
class Result:
    """The result of one check."""

    part: Part
    status: str  # "green", "red", "not available", "not run: no time left"
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    log: Path | None = None
    digest: str = ""
    lines: tuple[str, ...] = ()

    @property
    def green(self) -> bool:
        return self.status == "green"


def read(path: Path) -> list[Part]:
    return [Part(**row) for row in tomllib.loads(path.read_text(encoding="utf-8"))["part"]]


def is_available(goal: str, root: Path) -> bool:
    """Whether the Makefile has this goal."""
    database = subprocess.run(["make", "-C", root, "-pRrq", ":"], capture_output=True, text=True, check=False).stdout
    return re.search(rf"^{re.escape(goal)}:", database, re.MULTILINE) is not None


def run(part: Part, folder: Path, root: Path, left_s: float, patience: float) -> Result:
    if not is_available(part.goal, root):
        return Result(part, "not available")
    if left_s <= 0:
        return Result(part, "not run: no time left")
    log = folder / f"{slug(part.name)}.log"
    began = time.monotonic()
    code, cpu_s = finished(part.command, log, root, min(part.minutes * 60 * patience, left_s))
    status = "green" if code == 0 else "red: took too long" if code is None else f"red: exit code {code}"
    text = log.read_bytes()
    lines = kept(text.decode("utf-8", "replace"), part.keep)
    return Result(part, status, time.monotonic() - began, cpu_s, log, hashlib.sha256(text).hexdigest(), lines)


def slug(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def finished(command: str, log: Path, root: Path, limit_s: float) -> tuple[int | None, float]:
    """Exit code, None after the time limit; and seconds of processor time of all its processes that it waited for."""
    # Ctrl-C waits until the part has started: it could not be ended before.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    with open(log, "wb") as file:
        process = subprocess.Popen(
            command,
            shell=True,
            cwd=root,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            preexec_fn=lambda: signal.pthread_sigmask(signal.SIG_SETMASK, mask),
        )
    late = threading.Event()

    def stop() -> None:
        late.set()
        os.killpg(process.pid, signal.SIGKILL)

    timer = threading.Timer(limit_s, stop)
    timer.start()
    try:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        _, status, usage = os.wait4(process.pid, 0)
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        raise
    finally:
        timer.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    return None if late.is_set() else process.returncode, usage.ru_utime + usage.ru_stime


def kept(text: str, keep: str) -> tuple[str, ...]:
    lines = [COLOURS.sub("", line).rstrip() for line in text.splitlines() if line.strip()]
    wanted = [line for line in lines if re.search(keep, line)] if keep else []
    return tuple(wanted or lines[-LAST_LINES:])


def commit(root: Path) -> str:
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False).stdout.strip()

    changed = " with changes that are not committed" if git("status", "--porcelain") else ""
    return (git("rev-parse", "HEAD") or "no commit") + changed


def page(results: list[Result], head: str, minutes: float, left_out: int) -> str:
    red = [result for result in results if not result.green]
    now = datetime.now(UTC)
    cpu_s = sum(result.cpu_seconds for result in results)
    lines = [
        "# Evidence",
        "",
        f"Commit {head}.",
        f"{now:%Y-%m-%d %H:%M} UTC, {platform.system()} {platform.machine()}, {os.cpu_count()} processors.",
        f"**{'RED' if red or not results else 'GREEN'}**: {len(results) - len(red)} of {len(results)} parts are green.",
        *([f"**Not the whole record**: {left_out} parts were left out by --only."] if left_out else []),
        f"{cpu_s:,.0f} seconds of processor time; two cores have {2 * 60 * minutes:,.0f} in {minutes:.0f} minutes.",
        "",
        "| part | status | command | seconds | of processor time | SHA-256 of its output |",
        "|---|---|---|---|---|---|",
    ]
    for result in results:
        lines.append(
            f"| {result.part.name} | {result.status} | `{result.part.command}` | {result.seconds:.0f} |"
            f" {result.cpu_seconds:.0f} | {result.digest[:16] or '-'} |"
        )
    for result in results:
        lines += ["", f"## {result.part.name}", ""]
        if result.log is None:
            lines.append(f"{result.status}.")
            continue
        lines += [
            f"`{result.part.command}` at {head[:12]}: {result.status}.",
            f"Output: {result.log.name}, SHA-256 {result.digest}.",
            "",
            *(["```", *result.lines, "```"] if result.lines else ["It printed nothing."]),
        ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None, root: Path = ROOT) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=root / "out" / "evidence")
    parser.add_argument("--parts", type=Path, default=Path(__file__).with_name("parts.toml"))
    parser.add_argument("--minutes", type=float, default=60.0, help="for all parts together")
    parser.add_argument("--only", nargs="*", default=[], metavar="WORD", help="parts whose goal is one of these")
    parser.add_argument("--patience", type=float, default=1.0, help="factor of every time limit")
    options = parser.parse_args(arguments)
    every = read(options.parts)
    parts = [part for part in every if not options.only or part.goal in options.only]
    options.out.mkdir(parents=True, exist_ok=True)
    for old in [options.out / "index.md", *options.out.glob("*.log")]:
        old.unlink(missing_ok=True)
    head = commit(root)
    end_s = time.monotonic() + options.minutes * 60 * options.patience
    results: list[Result] = []
    try:
        for part in parts:
            result = run(part, options.out, root, end_s - time.monotonic(), options.patience)
            print(f"{result.status:24} {result.cpu_seconds:6.0f} s  {part.name}", flush=True)
            results.append(result)
    except KeyboardInterrupt:
        print("interrupted: no page", flush=True)
        return 130
    if commit(root) != head:
        results.append(Result(Part("The sources stayed the same", "", "git status", 0), "red: they changed meanwhile"))
    written = options.out / "index.new"
    written.write_text(page(results, head, options.minutes, len(every) - len(parts)), encoding="utf-8")
    written.replace(options.out / "index.md")
    red = [f"{result.status}: {result.part.name}" for result in results if not result.green]
    print("\n".join([str(options.out / "index.md"), *red]))
    return 0 if results and not red else 1


if __name__ == "__main__":
    sys.exit(main())
