"""The robot as a picture: its links, the tripped one in red, and a point at each contact. In a window or as a PNG file.

MuJoCo draws it. Off screen it uses OSMesa (MUJOCO_GL=osmesa, Debian's libosmesa6), EGL or GLFW, according to that
variable at the start of the process. The window needs GLFW and a display. Both need the extra `view`.
"""

import io
from pathlib import Path

import mujoco
import numpy as np

from tauperp.errors import InputError
from tauperp.files import write_atomically
from tauperp.sim.model import geom_name
from tauperp.sim.moment import Moment

LINKS = ((0.86, 0.87, 0.88, 1.0), (0.70, 0.73, 0.77, 1.0))  # alternating light greys, so that joints are visible
TRIPPED = (0.85, 0.10, 0.10, 1.0)
CONTACT = (1.0, 0.55, 0.0, 1.0)
HAND = (0.93, 0.72, 0.56, 0.5)  # transparent, so that the point of contact is visible
FLOOR = (0.32, 0.36, 0.40, 1.0)
FLOOR_HALF_M = 30.0  # beyond the horizon: farther objects are black
CONTACT_RADIUS_M = (0.012, 0.04)
FULL_FORCE_N = 200.0  # at which a contact point has its largest radius
LOOK_AT_M = (0.15, 0.0, 0.35)  # where an arm on a table keeps its middle
DISTANCE_M, AZIMUTH_DEG, ELEVATION_DEG = 1.6, 140.0, -25.0


def light(model: mujoco.MjModel) -> None:
    """A light at the camera that is bright enough: a model for simulation has none."""
    model.vis.headlight.ambient = (0.45, 0.45, 0.45)
    model.vis.headlight.diffuse = (0.55, 0.55, 0.55)
    model.vis.headlight.specular = (0.1, 0.1, 0.1)


def colour_links(moment: Moment) -> None:
    """Links, and hands if there are any. A picture changes only the colours of a model."""
    moment.model.geom_rgba[len(moment.index) :] = HAND
    for link in range(len(moment.index)):
        colour = TRIPPED if link + 1 == moment.tripped_joint else LINKS[link % 2]
        moment.model.geom(geom_name(link)).rgba = colour


def aim(camera: mujoco.MjvCamera) -> None:
    """A camera position from which the whole arm is visible."""
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat = LOOK_AT_M
    camera.distance, camera.azimuth, camera.elevation = DISTANCE_M, AZIMUTH_DEG, ELEVATION_DEG


def decorate(scene: mujoco.MjvScene, moment: Moment) -> None:
    """Add to a scene what the model does not have: a floor, and a point at each contact that grows with its force."""
    identity = np.eye(3).ravel()
    _add(scene, mujoco.mjtGeom.mjGEOM_PLANE, (FLOOR_HALF_M, FLOOR_HALF_M, 0.1), np.zeros(3), identity, FLOOR)
    wrench = np.empty(6)
    for index in range(moment.data.ncon):
        mujoco.mj_contactForce(moment.model, moment.data, index, wrench)
        share = min(1.0, float(np.linalg.norm(wrench[:3])) / FULL_FORCE_N)
        radius = CONTACT_RADIUS_M[0] + share * (CONTACT_RADIUS_M[1] - CONTACT_RADIUS_M[0])
        place = moment.data.contact.pos[index]
        _add(scene, mujoco.mjtGeom.mjGEOM_SPHERE, (radius, 0, 0), place, identity, CONTACT)


def _add(
    scene: mujoco.MjvScene,
    shape: mujoco.mjtGeom,
    size: tuple[float, float, float],
    place: np.ndarray,
    rotation: np.ndarray,
    colour: tuple[float, float, float, float],
) -> None:
    """Add one geom, unless the scene is full."""
    if scene.ngeom < scene.maxgeom:
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, shape, np.array(size, float), place, rotation, np.array(colour, np.float32))
        scene.ngeom += 1


def render(path: str | Path, moment: Moment, *, width: int = 640, height: int = 480) -> None:
    """Write a picture of this cycle as a PNG file.

    Raises InputError if nothing can draw off screen.
    """
    import matplotlib.image

    colour_links(moment)
    light(moment.model)
    camera = mujoco.MjvCamera()
    aim(camera)
    glo = moment.model.vis.global_
    glo.offwidth, glo.offheight = max(glo.offwidth, width), max(glo.offheight, height)
    try:
        renderer = mujoco.Renderer(moment.model, height, width)
    except Exception as error:  # each of its drivers has its own exceptions
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            f"cannot draw off screen: {reason} (pip install 'tauperp[view]', libosmesa6, MUJOCO_GL=osmesa)"
        ) from error
    with renderer:
        renderer.update_scene(moment.data, camera)
        decorate(renderer.scene, moment)
        pixels = renderer.render()
    picture = io.BytesIO()
    matplotlib.image.imsave(picture, pixels, format="png")
    write_atomically(path, picture.getvalue())
