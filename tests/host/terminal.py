"""A program in a pseudo-terminal, and the screen as a person would see it."""

import codecs
import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Sequence

import pyte

BEYOND = 40


class Terminal:
    """Runs a Python program at `columns` x `rows`; a context manager that ends the program."""

    def __init__(self, arguments: Sequence[str], columns: int, rows: int, kind: str = "xterm-256color") -> None:
        # The real screen has the width that the program sees; this one shows what it writes beyond that edge.
        self.screen = pyte.Screen(columns + BEYOND, rows)
        self._stream = pyte.Stream(self.screen)
        self._decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")
        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        environment = os.environ | {"TERM": kind, "PYTHONIOENCODING": "utf-8"}
        for name in ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR"):
            environment.pop(name, None)
        self.program = subprocess.Popen(
            [sys.executable, *arguments],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env=environment,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        os.close(slave)
        self.output = ""

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(self, *_: object) -> None:
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait(10)
        os.close(self._master)

    @property
    def lines(self) -> list[str]:
        return [line.rstrip() for line in self.screen.display]

    @property
    def text(self) -> str:
        return "\n".join(self.lines)

    def colour(self, words: str) -> str:
        """Foreground of the first letter of `words` on the screen."""
        for row, line in enumerate(self.screen.display):
            column = line.find(words)
            if column >= 0:
                return str(self.screen.buffer[row][column].fg)
        raise AssertionError(f"{words!r} is not on the screen:\n{self.text}")

    def background(self, words: str) -> str:
        """Background of the same."""
        row = next(row for row, line in enumerate(self.screen.display) if words in line)
        return str(self.screen.buffer[row][self.screen.display[row].find(words)].bg)

    def wait_for(self, seen: Callable[[str], bool], timeout_s: float = 20.0) -> str:
        """The screen as soon as `seen` accepts its text."""
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            if self._read(0.1) and seen(self.text):
                return self.text
            if self.program.poll() is not None:
                break
        raise AssertionError(f"the wait timed out at:\n{self.text}")

    def wait_for_words(self, *words: str) -> str:
        """The screen as soon as it contains all `words`."""
        return self.wait_for(lambda text: all(word in text for word in words))

    def press_ctrl_c(self) -> int:
        """As the key does: the terminal itself sends the signal. Returns the exit code."""
        os.write(self._master, b"\x03")
        return self.wait()

    def interrupt(self) -> int:
        """The same, sent by another process."""
        self.program.send_signal(signal.SIGINT)
        return self.wait()

    def wait(self, timeout_s: float = 20.0) -> int:
        """Read until the program ends; its exit code."""
        end = time.monotonic() + timeout_s
        while self.program.poll() is None and time.monotonic() < end:
            self._read(0.1)
        while self._read(0.1):
            pass
        return self.program.wait(1)

    def _read(self, timeout_s: float) -> bool:
        if not select.select([self._master], [], [], timeout_s)[0]:
            return False
        try:
            data = os.read(self._master, 65536)
        except OSError:  # Linux reports in this way that no process has the terminal open
            return False
        text = self._decoder.decode(data)
        self.output += text
        self._stream.feed(text)
        return bool(data)
