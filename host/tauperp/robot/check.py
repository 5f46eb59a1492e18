"""Comparison of a table with other readers of the robot.

Pinocchio with our own numbers finds errors in the table. Pinocchio (URDF) or MuJoCo (MJCF) with the file itself finds
errors in our reading of it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tauperp.errors import InputError
from tauperp.robot.model import Robot, Source
from tauperp.robot.spatial import Array
from tauperp.robot.table import RobotTable, make_table
from tauperp.robot.walk import Terms, walk

TOLERANCE = 1e-9
QUANTITIES = {"momentum": "kg m^2/s", "coriolis": "Nm", "gravity": "Nm", "jacobian": "m"}

Reader = Callable[[Array, Array], Terms]


@dataclass(frozen=True)
class Comparison:
    """Largest differences between the table and one reader, and their bounds."""

    reader: str
    states: int
    difference: dict[str, float]
    allowed: dict[str, float]

    @property
    def good(self) -> bool:
        return all(self.difference[name] <= self.allowed[name] for name in QUANTITIES)


def check(robot: Robot, table: RobotTable | None = None, *, states: int = 100, seed: int = 1) -> list[Comparison]:
    """Compare a robot's table (or another one) with every available reader, on random states within +-pi and 3 rad/s.

    A difference may be 1e-9 of the largest value of its quantity, or 1e-9 if that value is below one. A NaN gives an
    infinite difference.
    """
    table = make_table(robot) if table is None else table
    readers = {"Pinocchio": pinocchio_reader(robot)}
    if robot.source is not None:
        make = {"urdf": urdf_reader, "mjcf": mjcf_reader}[robot.source.kind]
        other = "Pinocchio" if robot.source.kind == "urdf" else "MuJoCo"
        readers[f"{other} on {robot.source.path.name}"] = make(robot, robot.source)
    return [_compare(name, reader, table, states, seed) for name, reader in readers.items()]


def _compare(name: str, reader: Reader, table: RobotTable, states: int, seed: int) -> Comparison:
    random = np.random.default_rng(seed)
    difference = dict.fromkeys(QUANTITIES, 0.0)
    allowed = dict.fromkeys(QUANTITIES, TOLERANCE)
    for _ in range(states):
        q = random.uniform(-np.pi, np.pi, table.joint_count)
        qd = random.uniform(-3.0, 3.0, table.joint_count)
        ours, theirs = walk(table, q, qd), reader(q, qd)
        for quantity in QUANTITIES:
            reference = getattr(theirs, quantity)
            distance = float(np.max(np.abs(getattr(ours, quantity) - reference)))
            difference[quantity] = max(difference[quantity], distance if np.isfinite(distance) else np.inf)
            allowed[quantity] = max(allowed[quantity], TOLERANCE * float(np.max(np.abs(reference))))
    return Comparison(name, states, difference, allowed)


def pinocchio_reader(robot: Robot) -> Reader:
    """Terms of a robot from a Pinocchio model that is built of its numbers."""
    model = pin.Model()
    parent = 0
    for joint in robot.joints:
        placement = pin.SE3(joint.origin_rotation, joint.origin_position)
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(joint.axis), placement, joint.name)
        model.appendBodyToJoint(parent, pin.Inertia(joint.mass, joint.com, joint.inertia), pin.SE3.Identity())
    tip = model.addFrame(pin.Frame("the tip", parent, 0, pin.SE3(np.eye(3), robot.tip), pin.FrameType.OP_FRAME))
    model.gravity.linear = robot.gravity
    return _reader(model, list(range(1, robot.n + 1)), tip, np.eye(3))


def urdf_reader(robot: Robot, source: Source) -> Reader:
    """Terms of the file's chain from Pinocchio's own URDF parser, every other joint locked at zero."""
    from tauperp.robot.urdf import JOINT

    try:
        whole = pin.buildModelFromXML(source.document.decode("utf-8"))
    except (ValueError, RuntimeError) as error:
        raise InputError(f"{source.path.name}: Pinocchio does not read it ({' '.join(str(error).split())})") from None
    names = [JOINT + joint.name for joint in robot.joints]
    locked = [i for i, name in enumerate(whole.names) if i > 0 and name not in names]
    model = pin.buildReducedModel(whole, locked, pin.neutral(whole))
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    base = data.oMf[_frame(model, source.base)].rotation  # after locked joints only, so the same at every state
    end = model.frames[_frame(model, source.tip)]
    placement = end.placement * pin.SE3(np.eye(3), source.tool)
    tip = model.addFrame(pin.Frame("the tip", end.parentJoint, 0, placement, pin.FrameType.OP_FRAME))
    model.gravity.linear = source.mounting.T @ model.gravity.linear
    return _reader(model, [model.getJointId(name) for name in names], tip, base)


def _frame(model: pin.Model, link: str) -> int:
    from tauperp.robot.urdf import LINK

    return int(model.getFrameId(LINK + link, pin.FrameType.BODY))


def _reader(model: pin.Model, ids: list[int], tip: int, base: Array) -> Reader:
    """Terms at the joints `ids` of a Pinocchio model that has no others; base: rotation of the base in its world."""
    data = model.createData()
    columns = [model.joints[i].idx_v for i in ids]
    to_base = np.asarray(np.kron(np.eye(2), base.T), np.float64)

    def terms(q: Array, qd: Array) -> Terms:
        position, velocity = pin.neutral(model), np.zeros(model.nv)
        for i, angle, speed in zip(ids, q, qd, strict=True):
            joint = model.joints[i]
            at = slice(joint.idx_q, joint.idx_q + joint.nq)
            position[at] = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]  # continuous
            velocity[joint.idx_v] = speed
        n = model.nv  # reshape: for one joint Pinocchio returns vectors
        mass = np.reshape(pin.crba(model, data, position), (n, n))
        mass = np.triu(mass) + np.triu(mass, 1).T
        coriolis = np.reshape(pin.computeCoriolisMatrix(model, data, position, velocity), (n, n))
        gravity = np.array(pin.computeGeneralizedGravity(model, data, position))
        jacobian = pin.computeFrameJacobian(model, data, position, tip, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        return Terms(
            (mass @ velocity)[columns],
            (coriolis.T @ velocity)[columns],
            gravity[columns],
            to_base @ np.reshape(np.asarray(jacobian, np.float64), (6, n))[:, columns],
        )

    return terms


def mjcf_reader(robot: Robot, source: Source) -> Reader:
    """Terms of the file's chain from MuJoCo, every other joint at qpos0."""
    import mujoco

    from tauperp.robot.mjcf import body_name, compile_mjcf, joint_name

    model, _ = compile_mjcf(source.path, source.document, source.accept_inertia)
    data = mujoco.MjData(model)
    model.opt.gravity = source.mounting.T @ model.opt.gravity
    joint_names = [joint_name(model, j) for j in range(model.njnt)]
    body_names = [body_name(model, b) for b in range(model.nbody)]
    joints = [joint_names.index(joint.name) for joint in robot.joints]
    position, dof = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    base_body = body_names.index(source.base)
    body = body_names.index(source.tip) if source.tip in body_names else -1
    site = -1 if body >= 0 else mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, source.tip)
    # dT/dq_i exactly: T has no harmonic of q_i above the second, so five samples around the circle hold all of it.
    steps = 2.0 * np.pi * np.arange(5) / 5.0
    weights = (2.0 * np.sin(steps) + 4.0 * np.sin(2.0 * steps)) / 5.0

    def mass(q: Array) -> Array:
        data.qpos[:] = model.qpos0
        data.qpos[position] = q
        data.qvel[:] = 0.0
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        return (full - np.diag(model.dof_armature))[np.ix_(dof, dof)]

    def terms(q: Array, qd: Array) -> Terms:
        coriolis = np.zeros(len(q))
        for i in range(len(q)):
            turns = [mass(q + step * np.eye(len(q))[i]) for step in steps]
            coriolis[i] = sum(0.5 * weight * qd @ m @ qd for weight, m in zip(weights, turns, strict=True))
        momentum = mass(q) @ qd
        rotation = (data.xmat[body] if site < 0 else data.site_xmat[site]).reshape(3, 3)
        point = (data.xpos[body] if site < 0 else data.site_xpos[site]) + rotation @ source.tool
        jacobian = np.zeros((6, model.nv))
        owner = body if site < 0 else model.site_bodyid[site]
        mujoco.mj_jac(model, data, jacobian[:3], jacobian[3:], point, owner)
        base = data.xmat[base_body].reshape(3, 3)
        return Terms(momentum, coriolis, data.qfrc_bias[dof].copy(), np.kron(np.eye(2), base.T) @ jacobian[:, dof])

    return terms
