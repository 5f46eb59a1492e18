"""The MuJoCo model of an arm, built in memory from its `Robot` description, so that no second file can differ from it.

World frame: the robot's base frame, in metres, with the gravity of the description. Each link is one body with the name
of its joint. The arm's own bodies never collide with each other. A body that touches the arm defines explicit contact
pairs.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from tauperp.robot import Robot
from tauperp.robot.inertia import excess, possible

TIP = "tip"
PAYLOAD = "payload"


def geom_name(link: int) -> str:
    """Name of the contact geometry of link `link`, counted from 0."""
    return f"link{link + 1}"


def build_spec(robot: Robot, *, timestep_s: float, mass_scale: NDArray[np.float64] | None = None) -> mujoco.MjSpec:
    """The arm as an MjSpec, to which others may add bodies before they compile it.

    `mass_scale` (n,) multiplies each link's mass and inertia, for a plant that differs from the firmware's model. The
    payload is a body at the tip, compiled with a placeholder inertia; `Arm` empties it before the first step.
    """
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.option.timestep = timestep_s
    spec.option.gravity = robot.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    scale = np.ones(robot.n) if mass_scale is None else mass_scale
    body = spec.worldbody
    for link, joint in enumerate(robot.joints):
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, np.asarray(joint.origin_rotation, float).ravel())
        body = body.add_body(name=joint.name, pos=joint.origin_position, quat=quat)
        _set_inertia(body, joint.mass * scale[link], joint.com, joint.inertia * scale[link])
        body.add_joint(name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis, armature=joint.rotor_inertia)
        shape = robot.capsules[link]
        geom = body.add_geom(name=geom_name(link), type=mujoco.mjtGeom.mjGEOM_CAPSULE, contype=0, conaffinity=0)
        geom.size, geom.fromto = [shape.radius, 0, 0], [*shape.p0, *shape.p1]
        motor = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
    body.add_site(name=TIP, pos=robot.tip)
    payload = body.add_body(name=PAYLOAD, pos=robot.tip)
    # Off-centre and unequal: otherwise MuJoCo compiles a shortcut for a body whose frame is its inertia frame,
    # and the numbers may change during a run.
    # and the numbers may change while it runs.
    _set_inertia(payload, 1e-3, np.array([1e-3, 1e-3, 1e-3]), np.diag([1e-6, 1.1e-6, 1.2e-6]))
    return spec


def _set_inertia(body: mujoco.MjsBody, mass: float, com: NDArray[np.float64], inertia: NDArray[np.float64]) -> None:
    if excess(inertia)[0] > 0.0:  # rounding of a file, which a robot table may have but MuJoCo refuses
        inertia = possible(inertia) + 1e-12 * np.eye(3)
    body.mass = mass
    body.ipos = com
    body.fullinertia = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    body.explicitinertial = True
