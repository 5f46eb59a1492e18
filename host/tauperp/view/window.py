"""MuJoCo's own viewer as a window on a run: `--view`."""

import contextlib
import importlib
import os
import sys
import time
from collections.abc import Iterator
from types import ModuleType
from typing import Any

from tauperp.errors import InputError
from tauperp.sim.moment import Moment, Watch
from tauperp.view.scene import aim, colour_links, decorate, light

FRAME_S = 1 / 60  # of simulated time between two pictures


@contextlib.contextmanager
def window() -> Iterator[Watch]:
    """A watch that shows each moment in a window, no faster than real time. The window opens with the first one.

    Closing it ends the showing, not the run. Raises InputError without a display or without the extra `view`.
    """
    shown = _Window(viewer())
    try:
        yield shown.watch
    finally:
        shown.close()


def viewer() -> ModuleType:
    """mujoco.viewer, if a window can be opened; checked before, because MuJoCo would end the process.

    Raises InputError without a display or without the extra `view`.
    """
    try:
        glfw = importlib.import_module("glfw")
    except ImportError as error:
        raise InputError("--view needs the extra 'view' (pip install 'tauperp[view]')") from error
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise InputError("--view needs a display: neither DISPLAY nor WAYLAND_DISPLAY is set")
    if not glfw.init():
        raise InputError("--view needs a display: none can be opened")
    try:
        return importlib.import_module("mujoco.viewer")
    except (ImportError, RuntimeError) as error:
        raise InputError(f"--view: MuJoCo's viewer cannot be used here: {' '.join(str(error).split())}") from error


class _Window:
    def __init__(self, program: ModuleType) -> None:
        self._viewer = program
        self._handle: Any = None
        self._begin_s = self._next_s = 0.0

    def watch(self, moment: Moment) -> None:
        if self._handle is None:
            self._open(moment)
        if moment.time_s < self._next_s or not self._handle.is_running():
            return
        self._next_s = moment.time_s + FRAME_S
        colour_links(moment)
        with self._handle.lock():
            self._handle.user_scn.ngeom = 0
            decorate(self._handle.user_scn, moment)
        self._handle.sync()
        time.sleep(max(0.0, self._begin_s + moment.time_s - time.monotonic()))

    def close(self) -> None:
        if self._handle is not None:
            self._handle.close()

    def _open(self, moment: Moment) -> None:
        light(moment.model)
        self._handle = self._viewer.launch_passive(moment.model, moment.data, show_left_ui=False, show_right_ui=False)
        with self._handle.lock():
            aim(self._handle.cam)
        self._begin_s, self._next_s = time.monotonic() - moment.time_s, moment.time_s
