"""MJCF as a tree of links. MuJoCo's compiler reads it and resolves defaults, angles, orientations and inertias.

The geoms of a body with an explicit inertia have no effect on it, so their meshes are not needed. MJCF has no velocity
limit of a joint; it is read from `<custom><numeric name="velocity_max:JOINT" data="rad/s"/></custom>`.
"""

import warnings
from pathlib import Path

import mujoco
import numpy as np

from tauperp.errors import InputError
from tauperp.robot.document import text_of
from tauperp.robot.inertia import LENGTH_MAX_M, MASS_MAX_KG, excess, moments, possible
from tauperp.robot.limits import Limits
from tauperp.robot.model import Capsule
from tauperp.robot.spatial import Array, Body, Pose, rotation_about, rotation_quaternion
from tauperp.robot.tree import REVOLUTE, Tree, TreeJoint, TreeLink

_ROUNDING_KG_M2 = 1e-12  # larger than the rounding error of an exact triangle inequality

KINDS = {
    int(mujoco.mjtJoint.mjJNT_HINGE): REVOLUTE,
    int(mujoco.mjtJoint.mjJNT_SLIDE): "prismatic",
    int(mujoco.mjtJoint.mjJNT_BALL): "a ball joint",
    int(mujoco.mjtJoint.mjJNT_FREE): "floating",
}


def compile_mjcf(path: Path, data: bytes, accept_inertia: bool = False) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """The model of a file, without meshes and textures that no inertia needs, and the changes by accept_inertia.

    data: the file's content. MuJoCo itself reads a regular file, because it may include others.
    """
    said: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(said.append)  # instead of a line on stderr and in a file
    try:
        if path.is_file() and not data.startswith((b"\xff\xfe", b"\xfe\xff", b"\xef\xbb\xbf")):
            spec = mujoco.MjSpec.from_file(str(path))
        else:
            spec = mujoco.MjSpec.from_string(text_of(data, path))
        spec.compiler.fusestatic = False
        _strip(spec)
        changes = _make_possible(spec) if accept_inertia else ()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = spec.compile()
    except InputError:
        raise
    except (ValueError, OSError, TypeError, mujoco.FatalError) as error:
        raise InputError(f"{path.name}: {' '.join(str(error).split())}") from None
    finally:
        mujoco.set_mju_user_warning(before)
    if said:
        raise InputError(f"{path.name}: {' '.join(said[0].split())}")
    _refuse_sizes(path, model)
    return model, changes


def _refuse_sizes(path: Path, model: mujoco.MjModel) -> None:
    """Numbers that are impossible for an arm, and whose products overflow float64."""
    positions = (model.body_pos, model.body_ipos, model.qpos0, model.jnt_pos, model.site_pos, model.opt.gravity)
    masses = (model.body_mass, model.body_inertia, model.dof_armature)
    for values, most in (*((x, LENGTH_MAX_M) for x in positions), *((x, MASS_MAX_KG) for x in masses)):
        if not np.all(np.abs(values) < most):
            raise InputError(f"{path.name}: holds a number beyond {most:g} (m, rad, kg, kg m^2 or m/s^2)")
    for quaternions in (model.body_quat, model.body_iquat, model.site_quat):
        if not np.all(np.abs(np.sum(np.square(quaternions), axis=1) - 1.0) < 1e-6):
            raise InputError(f"{path.name}: contains an orientation that is not a unit quaternion")


def read_mjcf(path: Path, data: bytes, accept_inertia: bool = False) -> tuple[Tree, tuple[str, ...]]:
    """The tree of a file and the changes by accept_inertia. As in MuJoCo, `ref` is a hinge's position zero."""
    model, changes = compile_mjcf(path, data, accept_inertia)
    try:
        return _tree(path, model), changes
    except UnicodeDecodeError:
        raise InputError(f"{path.name}: its names are not in UTF-8") from None


def _tree(path: Path, model: mujoco.MjModel) -> Tree:
    if model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY) or not np.any(model.opt.gravity):
        raise InputError(
            f"{path.name}: gravity is off (<option gravity> or <flag gravity>): "
            "a guard would report the arm's weight as a touch"
        )
    links: list[TreeLink] = []
    for b in range(model.nbody):
        links += _body_links(model, b)
    for s in range(model.nsite):
        if model.site(s).name:
            parent = body_name(model, model.site_bodyid[s])
            pose = Pose(rotation_quaternion(model.site_quat[s]), model.site_pos[s].copy())
            links.append(TreeLink(model.site(s).name, parent, pose, TreeJoint(""), marker=True))
    names: set[str] = set()
    for link in links:
        if link.name in names:
            raise InputError(f"{path.name}: name '{link.name}' names two bodies or sites: rename one")
        names.add(link.name)
    name = model.names[: model.names.index(b"\0")].decode()
    return Tree(name or path.stem, links, np.array(model.opt.gravity), _closures(model))


def _strip(spec: mujoco.MjSpec) -> None:
    """Remove textures, and meshes of bodies with an explicit inertia: they need files and have no effect on mass.

    Such a mesh geom becomes a small sphere without contacts, because contact pairs or sensors may name it.
    """
    ignored = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    file_geoms = (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_SDF, mujoco.mjtGeom.mjGEOM_HFIELD)
    for body in spec.bodies:
        if ignored or not (body.explicitinertial or body.name == "world"):
            continue
        for geom in body.geoms:
            if geom.type in file_geoms or geom.meshname:
                geom.type, geom.meshname, geom.hfieldname = mujoco.mjtGeom.mjGEOM_SPHERE, "", ""
                geom.size, geom.contype, geom.conaffinity = [1e-3, 0.0, 0.0], 0, 0
    used = {geom.meshname for geom in spec.geoms}
    for asset in [mesh for mesh in spec.meshes if mesh.name not in used] + list(spec.skins) + list(spec.hfields):
        spec.delete(asset)
    for geom in spec.geoms:
        geom.material = ""
    for site in spec.sites:
        site.material = ""
    for tendon in spec.tendons:
        tendon.material = ""
    for asset in [*spec.materials, *spec.textures, *spec.keys]:
        spec.delete(asset)


def _make_possible(spec: mujoco.MjSpec) -> tuple[str, ...]:
    """Give bodies with an impossible inertia the nearest possible one; returns the changes."""
    changes = []
    for body in spec.bodies:
        if not body.explicitinertial:
            continue
        full = np.array(body.fullinertia)
        is_full = bool(np.all(np.isfinite(full)))
        xx, yy, zz, xy, xz, yz = full if is_full else (*body.inertia, 0.0, 0.0, 0.0)
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if not np.all(np.isfinite(inertia)) or excess(inertia)[0] == 0.0:
            continue
        nearest = possible(inertia) + _ROUNDING_KG_M2 * np.eye(3)
        before, after = (", ".join(f"{moment:.4g}" for moment in moments(x)) for x in (inertia, nearest))
        changes.append(f"body '{body.name}': no body has its inertia; principal moments {before} became {after} kg m^2")
        if is_full:
            body.fullinertia = [nearest[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        else:
            body.inertia = np.diag(nearest)
    return tuple(changes)


def body_name(model: mujoco.MjModel, b: int) -> str:
    """The body's name or, without one, its number."""
    return model.body(b).name or f"body {b}"


def joint_name(model: mujoco.MjModel, j: int) -> str:
    """The joint's name or, without one, its place."""
    return model.joint(j).name or f"joint {j} of body {body_name(model, model.jnt_bodyid[j])}"


def _body_links(model: mujoco.MjModel, b: int) -> list[TreeLink]:
    """A body as links: one for each of its joints, then one for the body, fixed to the last."""
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
    """Equality constraints that connect two bodies: name, body, body."""
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


def _follows(model: mujoco.MjModel, j: int) -> str | None:
    """The joint that this one follows by an equality constraint; empty if the constraint locks it; None without one."""
    for e in range(model.neq):
        if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and model.eq_obj1id[e] == j and bool(model.eq_active0[e]):
            driver = int(model.eq_obj2id[e])
            return joint_name(model, driver) if driver >= 0 else ""
    return None


def _joint(model: mujoco.MjModel, j: int) -> TreeJoint:
    name = joint_name(model, j)
    limited = bool(model.jnt_limited[j])
    return TreeJoint(
        name=name,
        kind=KINDS[int(model.jnt_type[j])],
        axis=np.array(model.jnt_axis[j]),
        limits=Limits(
            lower=float(model.jnt_range[j, 0]) if limited else None,
            upper=float(model.jnt_range[j, 1]) if limited else None,
            velocity=_velocity_max(model, name),
            torque=_torque_max(model, j),
        ),
        rotor_inertia=float(model.dof_armature[model.jnt_dofadr[j]]),
        mimics=_follows(model, j),
    )


def _velocity_max(model: mujoco.MjModel, joint: str) -> float | None:
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, f"velocity_max:{joint}")
    return None if key < 0 else float(model.numeric_data[model.numeric_adr[key]])


def _torque_max(model: mujoco.MjModel, j: int) -> float | None:
    """The largest torque that the joint or the actuators on it admit, Nm; None without a limit."""
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
    return sum(found) if found else None


def _capsules(model: mujoco.MjModel, b: int) -> tuple[Capsule, ...]:
    first = model.body_geomadr[b]
    found = []
    for g in range(first, first + model.body_geomnum[b]):
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_CAPSULE:
            radius, half = model.geom_size[g, :2]
            along: Array = rotation_quaternion(model.geom_quat[g])[:, 2] * half
            found.append(Capsule(model.geom_pos[g] - along, model.geom_pos[g] + along, float(radius)))
    return tuple(found)
