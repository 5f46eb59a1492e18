"""The smallest detectable force, on an arm that the user can turn in MuJoCo's viewer; colours as in the figure."""

import time

import mujoco
import numpy as np
from matplotlib import colormaps
from matplotlib.colors import LogNorm

from tauperp.robot import Robot
from tauperp.sensitivity.analysis import BLIND_N, TaskForces
from tauperp.sim.model import build_spec, geom_name
from tauperp.view.scene import aim, light
from tauperp.view.sensitivity_figure import ARROW_M, BLIND_RGBA, HIGHEST_N, LOWEST_N
from tauperp.view.window import viewer

ARROW_WIDTH_M = 0.006
ARROW_RGBA = (0.13, 0.15, 0.18, 1.0)
PAUSE_S = 1 / 30


def colours(task: TaskForces) -> np.ndarray:
    """Colour of each link (n, 4) by its median static force; dark grey if that is not detectable."""
    medians = np.array([float(np.median(link.static_n)) for link in task.links])
    norm, chart = LogNorm(LOWEST_N, HIGHEST_N), colormaps["RdYlGn_r"]
    shown = np.array(chart(norm(np.clip(medians, LOWEST_N, HIGHEST_N))))
    shown[medians > BLIND_N] = BLIND_RGBA
    return shown


def show(robot: Robot, posture: np.ndarray, task: TaskForces) -> None:
    """Show the arm until the window is closed. Arrows: the direction that is hardest to detect on each link.

    Raises InputError without a display or without the extra `view`.
    """
    program = viewer()
    model = build_spec(robot, timestep_s=1e-3).compile()
    data = mujoco.MjData(model)
    data.qpos[: robot.n] = posture
    mujoco.mj_kinematics(model, data)
    light(model)
    for link, colour in enumerate(colours(task)):
        model.geom(geom_name(link)).rgba = colour
    with program.launch_passive(model, data, show_left_ui=False, show_right_ui=False) as handle:
        with handle.lock():
            aim(handle.cam)
            for link in range(robot.n):
                _arrow(handle.user_scn, data.geom(geom_name(link)).xpos, task.blindest[link])
        while handle.is_running():
            handle.sync()
            time.sleep(PAUSE_S)


def _arrow(scene: mujoco.MjvScene, middle: np.ndarray, direction: np.ndarray) -> None:
    """Towards `middle`, unless the scene is full."""
    if scene.ngeom < scene.maxgeom:
        geom = scene.geoms[scene.ngeom]
        shape, nothing = mujoco.mjtGeom.mjGEOM_ARROW, np.zeros(3)
        mujoco.mjv_initGeom(geom, shape, nothing, nothing, np.eye(3).ravel(), np.array(ARROW_RGBA, np.float32))
        mujoco.mjv_connector(geom, shape, ARROW_WIDTH_M, middle - ARROW_M * direction, middle)
        scene.ngeom += 1
