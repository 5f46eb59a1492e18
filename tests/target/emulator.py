"""Images and the emulated controllers that run them."""

import functools
import os
import socket
import subprocess
import threading
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from checkout import ROOT, make

BUILD = ROOT / "build" / "target"
QEMU_RUN = ROOT / "tools" / "qemu-run"


@functools.cache
def built(goal: str, image: Path) -> Path:
    """The image. `make GOAL` runs once; an image of the goal that does not build fails only its own tests."""
    if make("-k", "-j2", goal, check=False).returncode != 0:
        make(str(image.relative_to(ROOT)))
    return image


def versal_image(name: str, block: bytes, *, numeric: str = "float", lockstep: bool = True) -> Path:
    """The image of board versal_r5 for the emulator with this configuration block."""
    BUILD.mkdir(parents=True, exist_ok=True)
    block_file = BUILD / f"{name}.bin"
    block_file.write_bytes(block)
    image = BUILD / f"{name}.elf"
    mode = ["LOCKSTEP=1"] if lockstep else []
    place = image.relative_to(ROOT)
    make(
        "firmware",
        "BOARD=versal_r5",
        "EMULATOR=1",
        f"NUMERIC={numeric}",
        f"BLOCK={block_file}",
        f"IMAGE={place}",
        *mode,
    )
    return image


def run_to_end(target: str, image: Path, timeout_s: float = 300, arguments: Sequence[str] = ()) -> tuple[int, str]:
    """Exit code and complete output of an image that exits. It runs in the checkout's root."""
    done = subprocess.run(
        [str(QEMU_RUN), target, str(image.relative_to(ROOT)), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=timeout_s,
        check=False,
        cwd=ROOT,
    )
    return done.returncode, done.stdout


class Emulator:
    """The Versal's R5F with an image that never ends, on a SocketCAN interface if one is named. A context manager.

    monitor   path of a socket to be made: QEMU's monitor, for `reset`
    """

    def __init__(self, image: Path, channel: str | None = None, monitor: Path | None = None) -> None:
        can = ["--can", channel] if channel else []
        options = f"-monitor unix:{monitor},server=on,wait=off" if monitor else ""
        self._monitor = monitor
        self._process = subprocess.Popen(
            [str(QEMU_RUN), *can, "r5f", str(image)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=os.environ | {"QEMU_OPTIONS": options},
        )
        self.lines: list[str] = []
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._read, args=(self._process.stdout,), daemon=True)
        self._reader.start()

    def wait_for(self, text: str, timeout_s: float = 60) -> str:
        """The first line of the UART with this text."""

        def found() -> str | None:
            return next((line for line in self.lines if text in line), None)

        with self._changed:
            self._changed.wait_for(lambda: found() is not None or self._process.poll() is not None, timeout_s)
            line = found()
        assert line is not None, f"no {text!r} on the UART: {self.lines}"
        return line

    def reset(self) -> None:
        """A reset as by the watchdog: the memory keeps its content."""
        with socket.socket(socket.AF_UNIX) as monitor:
            monitor.connect(str(self._monitor))
            monitor.recv(4096)  # QEMU's greeting
            monitor.sendall(b"system_reset\n")
            monitor.recv(4096)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.terminate()
        self._process.wait(30)
        self._reader.join(10)

    def _read(self, output: IO[bytes]) -> None:
        for line in output:
            with self._changed:
                self.lines.append(line.decode(errors="replace").strip())
                self._changed.notify_all()
