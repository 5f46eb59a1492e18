"""MJCF as a tree of links, read by MuJoCo's own compiler: defaults, angles, orientations and inertias are its.

Of a body with an explicit inertia the geoms add nothing, so meshes are not needed for it. What MJCF has no place for,
the velocity limit of a joint, is taken from `<custom><numeric name="velocity_max:JOINT" data="rad/s"/></custom>`.
"""

from pathlib import Path

import mujoco
import numpy as np

from tauperp.errors import InputError
from tauperp.robot.model import DEFAULT_POSITION_RAD, DEFAULT_TORQUE_NM, DEFAULT_VELOCITY_RAD_S, Capsule
from tauperp.robot.spatial import Array, Body, Pose, rotation_about, rotation_quaternion
from tauperp.robot.tree import REVOLUTE, Tree, TreeJoint, TreeLink

KINDS = {
    int(mujoco.mjtJoint.mjJNT_HINGE): REVOLUTE,
    int(mujoco.mjtJoint.mjJNT_SLIDE): "prismatic",
    int(mujoco.mjtJoint.mjJNT_BALL): "a ball joint",
    int(mujoco.mjtJoint.mjJNT_FREE): "floating",
}


def compile_mjcf(path: Path) -> mujoco.MjModel:
    """The model of a file, without the meshes and pictures that no inertia needs."""
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.fusestatic = False
        _strip(spec)
        return spec.compile()
    except (ValueError, OSError, mujoco.FatalError) as error:
        raise InputError(f"{path.name}: {' '.join(str(error).split())}") from None


def read_mjcf(path: Path) -> Tree:
    """The tree of a file; a hinge's position zero is its `ref`, as in MuJoCo."""
    model = compile_mjcf(path)
    links: list[TreeLink] = []
    for b in range(model.nbody):
        links += _body_links(model, b)
    for s in range(model.nsite):
        if model.site(s).name:
            parent = body_name(model, model.site_bodyid[s])
            pose = Pose(rotation_quaternion(model.site_quat[s]), model.site_pos[s].copy())
            links.append(TreeLink(model.site(s).name, parent, pose, TreeJoint(""), marker=True))
    names = [link.name for link in links]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path.name}: name '{name}' stands for a body and a site: rename one")
    name = model.names[: model.names.index(b"\0")].decode()
    return Tree(name or path.stem, links, np.array(model.opt.gravity), _closures(model))


def _strip(spec: mujoco.MjSpec) -> None:
    """Remove what needs files and carries no mass: pictures, and meshes of bodies with an explicit inertia."""
    ignored = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    file_geoms = (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD)
    for body in spec.bodies:
        if ignored or not (body.explicitinertial or body.name == "world"):
            continue
        for geom in list(body.geoms):
            if geom.type in file_geoms:
                spec.delete(geom)
    used = {geom.meshname for geom in spec.geoms}
    for asset in [mesh for mesh in spec.meshes if mesh.name not in used] + list(spec.skins) + list(spec.hfields):
        spec.delete(asset)
    for geom in spec.geoms:
        geom.material = ""
    for site in spec.sites:
        site.material = ""
    for asset in [*spec.materials, *spec.textures]:
        spec.delete(asset)


def body_name(model: mujoco.MjModel, b: int) -> str:
    """What a body is called here: its name or, without one, its number."""
    return model.body(b).name or f"body {b}"


def joint_name(model: mujoco.MjModel, j: int) -> str:
    """What a joint is called here: its name or, without one, its place."""
    return model.joint(j).name or f"joint {j} of body {body_name(model, model.jnt_bodyid[j])}"


def _body_links(model: mujoco.MjModel, b: int) -> list[TreeLink]:
    """A body as one link for each of its joints and one, fixed to the last, for itself."""
    if b == 0:
        return [TreeLink(body_name(model, 0), None, Pose(), TreeJoint(""), capsules=_capsules(model, 0))]
    links = []
    parent = body_name(model, model.body_parentid[b])
    pose = Pose(rotation_quaternion(model.body_quat[b]), np.array(model.body_pos[b]))
    first = model.body_jntadr[b]
    for j in range(first, first + model.body_jntnum[b]):
        at = np.array(model.jnt_pos[j])
        rest = pose @ Pose(position=at)
        joint = _joint(model, j)
        zero = rest
        if joint.kind == REVOLUTE:
            zero = rest @ Pose(rotation_about(joint.axis, -float(model.qpos0[model.jnt_qposadr[j]])))
        name = f"{body_name(model, b)} at {joint.name}"
        links.append(TreeLink(name, parent, zero, joint, locked_pose=rest, marker=True))
        parent, pose = name, Pose(position=-at)
    axes = rotation_quaternion(model.body_iquat[b])
    body = Body(float(model.body_mass[b]), np.array(model.body_ipos[b]), axes @ np.diag(model.body_inertia[b]) @ axes.T)
    links.append(TreeLink(body_name(model, b), parent, pose, TreeJoint(""), body, capsules=_capsules(model, b)))
    return links


def _closures(model: mujoco.MjModel) -> list[tuple[str, str, str]]:
    """Equality constraints that hold two bodies together: name, body, body."""
    found = []
    for e in range(model.neq):
        kind, active = int(model.eq_type[e]), bool(model.eq_active0[e])
        if not active or kind not in (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)):
            continue
        ends = [int(model.eq_obj1id[e]), int(model.eq_obj2id[e])]
        if model.eq_objtype[e] == mujoco.mjtObj.mjOBJ_SITE:
            ends = [int(model.site_bodyid[s]) for s in ends]
        name = model.equality(e).name or f"constraint {e}"
        found.append((name, body_name(model, ends[0]), body_name(model, ends[1])))
    return found


def _follows(model: mujoco.MjModel, j: int) -> bool:
    """True if an equality constraint makes the joint follow another one."""
    return any(
        model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and model.eq_obj1id[e] == j and bool(model.eq_active0[e])
        for e in range(model.neq)
    )


def _joint(model: mujoco.MjModel, j: int) -> TreeJoint:
    name = joint_name(model, j)
    limited = bool(model.jnt_limited[j])
    return TreeJoint(
        name=name,
        kind=KINDS[int(model.jnt_type[j])],
        axis=np.array(model.jnt_axis[j]),
        position_min=float(model.jnt_range[j, 0]) if limited else -DEFAULT_POSITION_RAD,
        position_max=float(model.jnt_range[j, 1]) if limited else DEFAULT_POSITION_RAD,
        velocity_max=_velocity_max(model, name),
        torque_max=_torque_max(model, j),
        rotor_inertia=float(model.dof_armature[model.jnt_dofadr[j]]),
        mimic=_follows(model, j),
    )


def _velocity_max(model: mujoco.MjModel, joint: str) -> float:
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, f"velocity_max:{joint}")
    return DEFAULT_VELOCITY_RAD_S if key < 0 else float(model.numeric_data[model.numeric_adr[key]])


def _torque_max(model: mujoco.MjModel, j: int) -> float:
    """The largest torque that the joint or the actuators on it admit, Nm."""
    if model.jnt_actfrclimited[j]:
        return float(np.max(np.abs(model.jnt_actfrcrange[j])))
    found = []
    for a in range(model.nu):
        if model.actuator_trntype[a] != mujoco.mjtTrn.mjTRN_JOINT or model.actuator_trnid[a, 0] != j:
            continue
        gear = abs(float(model.actuator_gear[a, 0]))
        motor = model.actuator_biastype[a] == mujoco.mjtBias.mjBIAS_NONE
        if model.actuator_forcelimited[a]:
            found.append(gear * float(np.max(np.abs(model.actuator_forcerange[a]))))
        elif model.actuator_ctrllimited[a] and motor:
            gain = abs(float(model.actuator_gainprm[a, 0]))
            found.append(gear * gain * float(np.max(np.abs(model.actuator_ctrlrange[a]))))
    return sum(found) if found else DEFAULT_TORQUE_NM


def _capsules(model: mujoco.MjModel, b: int) -> tuple[Capsule, ...]:
    first = model.body_geomadr[b]
    found = []
    for g in range(first, first + model.body_geomnum[b]):
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_CAPSULE:
            radius, half = model.geom_size[g, :2]
            along: Array = rotation_quaternion(model.geom_quat[g])[:, 2] * half
            found.append(Capsule(model.geom_pos[g] - along, model.geom_pos[g] + along, float(radius)))
    return tuple(found)
