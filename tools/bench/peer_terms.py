#!/usr/bin/env python3
"""Writes the robot-specific sources for the peers of `make bench`.

    peer_terms.py casadi ROBOT OUT.c      C by CasADi, from the Lagrangian: terms(q, qd) -> (p, C^T qd, g, J)
    peer_terms.py pinocchio ROBOT OUT.h   the robot's numbers, as a table from which a C++ program makes a model

The Lagrangian is written for few operations: velocities in the links' own frames, no constants that are zero, the
geometric Jacobian, common subexpressions eliminated. p = dT/dqd, C^T qd = dT/dq, g = dV/dq.
"""

import sys
from pathlib import Path

import casadi as ca
import numpy as np

from tauperp.robot import Joint, Robot, load
from tauperp.robot.spatial import Array, skew

ZERO = 1e-12  # a smaller constant of the robot is a rounded zero


def constant(values: Array) -> ca.SX:
    """An array as a symbolic constant with structural zeros."""
    values = np.asarray(values, dtype=float)
    return ca.sparsify(ca.SX(np.where(np.abs(values) < ZERO, 0.0, values)))


def turned(joint: Joint, angle: ca.SX) -> ca.SX:
    """Rotation of the joint's frame in its parent's (Rodrigues)."""
    along = np.outer(joint.axis, joint.axis)
    about = constant(along) + ca.cos(angle) * constant(np.eye(3) - along) + ca.sin(angle) * constant(skew(joint.axis))
    return ca.sparsify(constant(joint.origin_rotation) @ about)


def lagrangian_terms(robot: Robot) -> ca.Function:
    q, qd = ca.SX.sym("q", robot.n), ca.SX.sym("qd", robot.n)
    w, v = ca.SX.zeros(3), ca.SX.zeros(3)  # velocity of the link, in its own frame
    orientation, origin = ca.SX.eye(3), ca.SX.zeros(3)
    kinetic, potential = ca.SX(0), ca.SX(0)
    axes, origins = [], []
    for i, joint in enumerate(robot.joints):
        offset, axis, com = constant(joint.origin_position), constant(joint.axis), constant(joint.com)
        rotation = turned(joint, q[i])
        v = rotation.T @ (v + ca.cross(w, offset))
        w = rotation.T @ w + qd[i] * axis
        origin = origin + orientation @ offset
        orientation = orientation @ rotation
        at_com = v + ca.cross(w, com)
        kinetic += 0.5 * joint.mass * ca.dot(at_com, at_com) + 0.5 * ca.dot(w, constant(joint.inertia) @ w)
        potential -= joint.mass * ca.dot(constant(robot.gravity), origin + orientation @ com)
        axes.append(orientation @ axis)
        origins.append(origin)
    tip = origin + orientation @ constant(robot.tip)
    columns = [ca.vertcat(ca.cross(axis, tip - at), axis) for axis, at in zip(axes, origins, strict=True)]
    terms = [ca.gradient(kinetic, qd), ca.gradient(kinetic, q), ca.gradient(potential, q), ca.horzcat(*columns)]
    return ca.Function("terms", [q, qd], [ca.densify(term) for term in terms], {"cse": True})


def write_casadi(robot: Robot, out: Path) -> None:
    # "casadi_real": every variable of the generated code. Its constants are assigned, so the compiler converts them.
    generator = ca.CodeGenerator(out.name, {"casadi_real": "float", "casadi_int": "int"})
    generator.add(lagrangian_terms(robot))
    generator.generate(f"{out.parent}/")


def write_pinocchio(robot: Robot, out: Path) -> None:
    def row(values: Array) -> str:
        return "{" + ", ".join(f"{value:.17g}" for value in np.ravel(values)) + "}"

    lines = ["/* rotation, position, axis, mass, centre of mass, inertia about it; rotations by rows */"]
    lines += ["struct Link { double rotation[9], position[3], axis[3], mass, com[3], inertia[9]; };"]
    lines += ["static const Link LINKS[] = {"]
    for joint in robot.joints:
        placement = f"{row(joint.origin_rotation)}, {row(joint.origin_position)}, {row(joint.axis)}"
        lines.append(f"    {{{placement}, {joint.mass:.17g}, {row(joint.com)}, {row(joint.inertia)}}},")
    lines += ["};", f"static const double TIP[3] = {row(robot.tip)};"]
    lines += [f"static const double GRAVITY[3] = {row(robot.gravity)};", ""]
    out.write_text("\n".join(lines))


def main() -> int:
    kind, name, out = sys.argv[1:]
    {"casadi": write_casadi, "pinocchio": write_pinocchio}[kind](load(name), Path(out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
