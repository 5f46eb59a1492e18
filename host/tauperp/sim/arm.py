"""The arm: physics between two control cycles, and the input of its joint torque sensors.

The sensors are between gear and link. They measure the torque on the link,

    tau_j = M qdd + C qd + g + tau_ext,   M the links' inertia without the rotors

In MuJoCo's terms this is motor torque plus brake minus rotor inertia (`armature`) times acceleration. Friction and
brakes act on the motor's side and are not measured. A reading is the mean over the cycle that ends with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from tauperp.robot import Robot
from tauperp.sim.model import PAYLOAD, TIP, build_spec

DRIVE_SHARE = 0.97  # of the sensor's range: a drive in saturation must not saturate its sensor
BRAKE_MARGIN = 1.5  # a holding brake carries more than the joint's largest torque
BRAKE_IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 2.0)  # MuJoCo's solimp; its default lets a brake creep at 0.02 rad/s


@dataclass(frozen=True)
class Payload:
    """A rigid object at the tip: kg, centre of mass in the last link's axes from the tip (3,) m, solid-ball inertia."""

    mass_kg: float
    com_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius_m: float = 0.04

    @property
    def inertia_kg_m2(self) -> float:
        """About its own centre of mass, the same for every axis."""
        return 0.4 * self.mass_kg * self.radius_m**2


@dataclass(frozen=True)
class JointSample:
    """True values at the end of a cycle, (n,) each: rad, rad/s, and the mean link-side torque over the cycle, Nm."""

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    torque: NDArray[np.float64]


class Touching(Protocol):
    """Something outside the robot in the same simulation: a hand that strikes, a force that guides."""

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add bodies and contact pairs to the model before it is compiled."""

    def before_step(self, arm: "Arm", time_s: float) -> None:
        """Set forces for the step that starts at `time_s`."""

    def after_step(self, arm: "Arm", time_s: float) -> None:
        """Read the result of the step that started at `time_s`."""


class Arm:
    """A serial arm under torque control. `model` and `data` are MuJoCo's; joints of the arm are their first `n`.

    `substeps` steps of MuJoCo make one cycle of `period_s`. Raises ValueError if the description does not compile.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        period_s: float,
        substeps: int = 2,
        mass_scale: NDArray[np.float64] | None = None,
        touching: Sequence[Touching] = (),
    ) -> None:
        self.robot = robot
        self.n = robot.n
        self.period_s = period_s
        self._substeps = substeps
        self._touching = tuple(touching)
        spec = build_spec(robot, timestep_s=period_s / substeps, mass_scale=mass_scale)
        for one in self._touching:
            one.add_to(spec)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._scratch = mujoco.MjData(self.model)  # mj_setConst uses its own state, not the running one
        self.model.dof_solimp[: self.n] = BRAKE_IMPEDANCE
        self._rotor = self.model.dof_armature[: self.n].copy()
        self._torque_max = DRIVE_SHARE * np.array([joint.torque_max for joint in robot.joints])
        self._tip = self.model.site(TIP).id
        self._payload = self.model.body(PAYLOAD).id
        self._links = [int(body) for body in self.model.jnt_bodyid[: self.n]]
        self._lever_moment = np.empty(3)
        self._braked = False
        self.time_s = 0.0
        self.attach(None)

    def reset(self, position: NDArray[np.float64]) -> None:
        """At rest at `position` (n,) rad, everything else as compiled, time 0."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[: self.n] = position
        self.time_s = 0.0
        mujoco.mj_forward(self.model, self.data)

    def stand(self) -> JointSample:
        """The sample of an arm at rest where it is now: its torque carries its own weight."""
        n, data = self.n, self.data
        mujoco.mj_forward(self.model, data)
        return JointSample(data.qpos[:n].copy(), np.zeros(n), data.qfrc_bias[:n].copy())

    def attach(self, payload: Payload | None) -> None:
        """Grasp `payload`, or release it with None, between two cycles. Velocities stay: it already moves with the
        tip."""
        body = self._payload
        held = payload or Payload(0.0)
        self.model.body_mass[body] = held.mass_kg
        self.model.body_ipos[body] = held.com_m
        self.model.body_inertia[body] = held.inertia_kg_m2
        mujoco.mj_setConst(self.model, self._scratch)

    def brake(self, engaged: bool) -> None:
        """Engage or lift the holding brakes: dry friction on the motor's side."""
        if engaged != self._braked:
            self.model.dof_frictionloss[: self.n] = BRAKE_MARGIN * self._torque_max if engaged else 0.0
            self._braked = engaged

    def step(self, torque: NDArray[np.float64]) -> JointSample:
        """One control cycle with the motors' torque (n,) Nm held constant, limited to each joint's largest."""
        n, model, data = self.n, self.model, self.data
        motor = np.clip(torque, -self._torque_max, self._torque_max)
        data.ctrl[:n] = motor
        accelerated = np.zeros(n)
        braked = np.zeros(n)
        for _ in range(self._substeps):
            for one in self._touching:
                one.before_step(self, self.time_s)
            mujoco.mj_step(model, data)
            accelerated += data.qacc[:n]
            if self._braked:
                braked += self._brake_torque()
            for one in self._touching:
                one.after_step(self, self.time_s)
            self.time_s += model.opt.timestep
        link_side = motor + (braked - self._rotor * accelerated) / self._substeps
        return JointSample(data.qpos[:n].copy(), data.qvel[:n].copy(), link_side)

    def push_tip(self, force: NDArray[np.float64], moment: NDArray[np.float64]) -> None:
        """Apply this wrench on the robot at the end-effector point, base frame, N (3,) and Nm (3,), until changed."""
        data, body = self.data, self._links[-1]
        lever = data.site_xpos[self._tip] - data.xipos[body]
        data.xfrc_applied[body, :3] = force
        data.xfrc_applied[body, 3:] = moment
        mujoco.mju_cross(self._lever_moment, lever, force)
        data.xfrc_applied[body, 3:] += self._lever_moment

    def _brake_torque(self) -> NDArray[np.float64]:
        """Torque of the brakes in the last step, (n,) Nm."""
        data = self.data
        torque = np.zeros(self.n)
        rows = np.flatnonzero(data.efc_type[: data.nefc] == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF)
        torque[data.efc_id[rows]] = data.efc_force[rows]
        return torque

    def link_body(self, link: int) -> int:
        """MuJoCo's number of the body of link `link`, counted from 1."""
        return self._links[link - 1]

    def tip_velocity(self) -> NDArray[np.float64]:
        """Of the end-effector point, base frame (3,) m/s."""
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, jacobian, None, self._tip)
        return jacobian[:, : self.n] @ self.data.qvel[: self.n]
