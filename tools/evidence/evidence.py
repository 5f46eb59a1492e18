#!/usr/bin/env python3
"""Runs the checks of parts.toml and writes one page on which each number has its command, commit and hash.

    evidence.py [--out out/evidence] [--parts FILE] [--minutes 60] [--only WORD...]

A part is green if its command ends with 0. It is red if the command fails, takes too long or does not exist yet ("not
available"). The complete output of each part is a file next to the page, and the page states its SHA-256. The page is
index.md. Exit code 1 if anything is red.
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


def run(part: Part, folder: Path, root: Path, left_s: float) -> Result:
    if not is_available(part.goal, root):
        return Result(part, "not available")
    if left_s <= 0:
        return Result(part, "not run: no time left")
    log = folder / (re.sub(r"[^a-z0-9]+", "-", part.name.lower()).strip("-") + ".log")
    began = time.monotonic()
    with open(log, "wb") as file:
        process = subprocess.Popen(
            part.command, shell=True, cwd=root, stdout=file, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            code: int | None = process.wait(min(part.minutes * 60, left_s))
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            code = None
    status = "green" if code == 0 else "red: took too long" if code is None else f"red: exit code {code}"
    text = log.read_bytes()
    lines = kept(text.decode("utf-8", "replace"), part.keep)
    return Result(part, status, time.monotonic() - began, log, hashlib.sha256(text).hexdigest(), lines)


def kept(text: str, keep: str) -> tuple[str, ...]:
    lines = [COLOURS.sub("", line).rstrip() for line in text.splitlines() if line.strip()]
    wanted = [line for line in lines if re.search(keep, line)] if keep else []
    return tuple(wanted or lines[-LAST_LINES:])


def commit(root: Path) -> str:
    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=False).stdout.strip()

    changed = " with changes that are not committed" if git("status", "--porcelain") else ""
    return (git("rev-parse", "HEAD") or "no commit") + changed


def page(results: list[Result], head: str) -> str:
    red = [result for result in results if not result.green]
    now = datetime.now(UTC)
    lines = [
        "# Evidence",
        "",
        f"Commit {head}.",
        f"{now:%Y-%m-%d %H:%M} UTC, {platform.system()} {platform.machine()}, {os.cpu_count()} processors.",
        f"**{'RED' if red else 'GREEN'}**: {len(results) - len(red)} of {len(results)} parts are green.",
        "",
        "| part | status | command | seconds | SHA-256 of its output |",
        "|---|---|---|---|---|",
    ]
    for result in results:
        lines.append(
            f"| {result.part.name} | {result.status} | `{result.part.command}` | {result.seconds:.0f} |"
            f" {result.digest[:16] or '-'} |"
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
            "```",
            *result.lines,
            "```",
        ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None, root: Path = ROOT) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=root / "out" / "evidence")
    parser.add_argument("--parts", type=Path, default=Path(__file__).with_name("parts.toml"))
    parser.add_argument("--minutes", type=float, default=60.0, help="for all parts together")
    parser.add_argument("--only", nargs="*", default=[], metavar="WORD", help="parts whose goal is one of these")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    end_s = time.monotonic() + options.minutes * 60
    results: list[Result] = []
    head = commit(root)
    for part in read(options.parts):
        if options.only and part.goal not in options.only:
            continue
        result = run(part, options.out, root, end_s - time.monotonic())
        print(f"{result.status:24} {part.name}", flush=True)
        results.append(result)
        (options.out / "index.md").write_text(page(results, head), encoding="utf-8")
    print(f"{options.out / 'index.md'}")
    return 0 if results and all(result.green for result in results) else 1


if __name__ == "__main__":
    sys.exit(main())
