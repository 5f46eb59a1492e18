"""A short film of a stop in slow motion, as a camera next to the arm would record it. One animated picture in memory.

`Camera` is a watch that keeps the pose at every tenth call. After the run `film` draws the stop off screen
(tauperp.view.scene states the requirements).
"""

import ctypes.util
import importlib
import importlib.util
import io
import os
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from PIL import Image, ImageDraw

from tauperp.errors import InputError
from tauperp.sim.moment import Moment
from tauperp.view.scene import aim, colour_links, decorate, light

KEEP_S = 0.01  # between two poses that are kept
BEFORE_S, AFTER_S = 0.35, 0.65  # of a stop
SLOWER = 4  # times
FRAMES_HZ = 15.0  # of the film as it is shown
SIZE = (480, 360)
QUALITY = 60
STRIP_PX = 26
PERMITTED, STOPPED = (46, 158, 91), (200, 53, 43)


def choose_driver() -> None:
    """Without a display, let MuJoCo draw with OSMesa if it is installed, unless MUJOCO_GL is set.

    MuJoCo chooses its renderer when it is imported, before a film is requested. It must therefore choose again.
    """
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or "MUJOCO_GL" in os.environ:
        return
    if ctypes.util.find_library("OSMesa") is None or importlib.util.find_spec("OpenGL") is None:
        return
    os.environ["MUJOCO_GL"] = "osmesa"
    importlib.reload(importlib.import_module("mujoco.rendering.classic.gl_context"))


class Camera:
    """Keeps the poses of a run."""

    def __init__(self) -> None:
        self._model: mujoco.MjModel | None = None
        self._n = 0
        self._kept: list[tuple[float, np.ndarray, bool, int, str]] = []

    def watch(self, moment: Moment) -> None:
        """Record one cycle of the run."""
        if self._kept and moment.time_s < self._kept[-1][0] + KEEP_S - 1e-9:
            return
        self._model, self._n = moment.model, len(moment.index)
        force = f"{moment.contact_n:.0f} N" if moment.contact_n > 0 else ""
        self._kept.append((moment.time_s, moment.data.qpos.copy(), moment.permitted, moment.tripped_joint, force))

    def film(self, stop_s: float) -> bytes:
        """An animated WebP of the stop at this time. Raises InputError if nothing can draw off screen."""
        assert self._model is not None
        step_s = 1.0 / (FRAMES_HZ * SLOWER)
        wanted = np.arange(stop_s - BEFORE_S, stop_s + AFTER_S, step_s)
        times = np.array([one[0] for one in self._kept])
        rows = dict.fromkeys(int(np.argmin(np.abs(times - at))) for at in wanted)
        frames = [Image.fromarray(pixels) for pixels in self._draw(list(rows))]
        for frame, row in zip(frames, rows, strict=True):
            _caption(frame, self._kept[row], stop_s)
        film = io.BytesIO()
        frames[0].save(film, "WEBP", save_all=True, append_images=frames[1:], duration=round(1000 / FRAMES_HZ), loop=0,
                       quality=QUALITY)  # fmt: skip
        return film.getvalue()

    def _draw(self, rows: Sequence[int]) -> list[np.ndarray]:
        model, data, camera = self._model, mujoco.MjData(self._model), mujoco.MjvCamera()
        assert model is not None
        aim(camera)
        light(model)
        width, height = SIZE
        model.vis.global_.offwidth = max(model.vis.global_.offwidth, width)
        model.vis.global_.offheight = max(model.vis.global_.offheight, height)
        try:
            renderer: Any = mujoco.Renderer(model, height, width)
        except Exception as error:  # each of its drivers has its own exceptions
            raise InputError(f"cannot draw off screen: {' '.join(str(error).split())}") from error
        pictures = []
        nothing = np.zeros(self._n)
        with renderer:
            for row in rows:
                time_s, data.qpos[:], permitted, tripped, _ = self._kept[row]
                mujoco.mj_forward(model, data)
                moment = Moment(time_s, model, data, permitted, tripped, nothing, nothing, nothing, 0.0)
                colour_links(moment)
                renderer.update_scene(data, camera)
                decorate(renderer.scene, moment)
                pictures.append(renderer.render().copy())
        return pictures


def _caption(frame: Image.Image, kept: tuple[float, np.ndarray, bool, int, str], stop_s: float) -> None:
    """A strip at the bottom: green with permission, red without, with the time relative to the stop."""
    time_s, _, permitted, joint, force = kept
    draw = ImageDraw.Draw(frame)
    width, height = frame.size
    draw.rectangle((0, height - STRIP_PX, width, height), fill=PERMITTED if permitted else STOPPED)
    words = "motion permitted" if permitted else f"stopped by joint {joint}" if joint else "stopped"
    text = f"{1000 * (time_s - stop_s):+.0f} ms   {words}   {force}"
    draw.text((8, height - STRIP_PX + 7), text, fill=(255, 255, 255))
