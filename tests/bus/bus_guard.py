"""The guard's process under test: start it, read its JSON lines, end it."""

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
RELEASE = ROOT / "build" / "tauperp-guard"
SANITIZED = ROOT / "build" / "sanitized" / "tauperp-guard"
PEER = ROOT / "build" / "bus-peer"
TIMEOUT_S = 20.0

Event = dict[str, Any]


class GuardProcess:
    """`tauperp-guard --json`, with its lines in a file so that it never waits for the test. A context manager that ends
    it."""

    def __init__(
        self,
        folder: Path,
        *options: str,
        channel: str = "vcan0",
        program: Path = SANITIZED,
        environment: dict[str, str] | None = None,
    ) -> None:
        self._path = folder / f"guard-{time.monotonic_ns()}.jsonl"
        command = [str(program), "--channel", channel, "--json", *options]
        # No leak check: the program has no heap, and the check needs ptrace. No core file of 16 TB either.
        variables = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0:disable_coredump=1", **(environment or {})}
        with open(self._path, "wb") as out:
            self.process = subprocess.Popen(command, stdout=out, stderr=subprocess.PIPE, env=variables)

    def __enter__(self) -> "GuardProcess":
        self.wait_for(lambda event: event["event"] == "start", "its start")
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.terminate()
            try:
                self.process.wait(TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()

    def events(self) -> list[Event]:
        """Every complete line so far."""
        return [json.loads(line) for line in self._path.read_text().splitlines(keepends=True) if line.endswith("\n")]

    def wait_for(self, wanted: Callable[[Event], bool], what: str, timeout_s: float = TIMEOUT_S) -> Event:
        """The first line that matches, in the past or in the future."""
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            for event in self.events():
                if wanted(event):
                    return event
            if self.process.poll() is not None:
                break
            time.sleep(0.02)
        raise AssertionError(f"the guard did not report {what}: {self.events()} {self._errors()}")

    def wait_for_state(self, state: str, reason: str | None = None, after: int = 0) -> Event:
        """Wait for a line with this state, after the first `after` lines."""
        end = time.monotonic() + TIMEOUT_S
        while time.monotonic() < end:
            for event in self.events()[after:]:
                if event["event"] == "state" and event["state"] == state and reason in (None, event["reason"]):
                    return event
            time.sleep(0.02)
        raise AssertionError(f"the guard did not reach {state} {reason}: {self.events()[after:]}")

    def wait_for_bus(self, what: str) -> Event:
        return self.wait_for(lambda event: event["event"] == "bus" and event["what"] == what, what)

    def end(self, number: signal.Signals = signal.SIGTERM) -> Event:
        """The last line of the process after this signal. Fails unless it exits with 0 and nothing on stderr."""
        self.process.send_signal(number)
        code = self.process.wait(TIMEOUT_S)
        errors = self._errors()
        assert (code, errors) == (0, ""), errors
        last = self.events()[-1]
        assert last["event"] == "end"
        return last

    def _errors(self) -> str:
        if self.process.poll() is None or self.process.stderr is None or self.process.stderr.closed:
            return ""
        return self.process.stderr.read().decode()


def run_guard(*arguments: str, program: Path = RELEASE) -> "subprocess.CompletedProcess[str]":
    """Run the guard with arguments that make it print and exit: help and bad input."""
    return subprocess.run([str(program), *arguments], capture_output=True, text=True, timeout=TIMEOUT_S)


@contextmanager
def candump(path: Path, *channels: str) -> Iterator[None]:
    """`candump -L` into a file, from before the body's first frame on."""
    listeners = _listeners()
    with open(path, "w") as file:
        # Large enough for a whole run, because candump reads its frames late on a busy machine.
        process = subprocess.Popen(["candump", "-L", "-r", "16000000", *channels], stdout=file)
        end = time.monotonic() + TIMEOUT_S
        while _listeners() == listeners and time.monotonic() < end:
            time.sleep(0.02)
        try:
            yield
            _wait_until_calm(path)
        finally:
            process.terminate()
            process.wait(TIMEOUT_S)


def _wait_until_calm(path: Path) -> None:
    """Wait until nothing was written for half a second."""
    size, since = -1, time.monotonic()
    end = since + TIMEOUT_S
    while time.monotonic() < min(since + 0.5, end):
        if path.stat().st_size != size:
            size, since = path.stat().st_size, time.monotonic()
        time.sleep(0.05)


def _listeners() -> int:
    """The number of receive filters of all sockets on all CAN interfaces."""
    return sum(line.endswith("raw") for path in Path("/proc/net/can").glob("rcvlist_*") for line in _lines(path))


def _lines(path: Path) -> list[str]:
    return [line.rstrip() for line in path.read_text().splitlines()]
