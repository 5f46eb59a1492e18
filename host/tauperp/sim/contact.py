"""People who touch the arm: a hand or forearm that strikes a link, and an intended force that guides the tip.

A strike is a MuJoCo contact. The striking part is a mass behind soft tissue (ISO/TS 15066, Annex A: effective mass and
stiffness of the body region), and the person's arm drives it with limited force. The force on the robot is the result
of this contact: it is recorded, not prescribed. Only the intended guiding force is an applied wrench.
"""

import math
from dataclasses import dataclass
from enum import Enum, auto
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from tauperp.sim.arm import Arm
from tauperp.sim.model import geom_name

Vector = NDArray[np.float64]

IMPEDANCE = 0.1  # MuJoCo's contact impedance: low, so that a contact is a spring and damper and adds little mass
TISSUE_DAMPING = 0.4  # damping ratio of the part's mass on its tissue
AIM_RAD_S = 25.0  # bandwidth of the sideways correction by the person's arm
SPEED_RATE_PER_S = 800.0  # gain of its speed control, within its force
STANDOFF_M = 0.12  # free distance before the strike
GIVE_UP_S = 2.0  # s; a strike without contact is withdrawn after this time
WITHDRAW_M_S = 0.5
PARK_M = 10.0  # below the base, a metre apart, away from everything


class Obstructed(ValueError):
    """A strike cannot start: the part would appear inside a link. The message names the link."""


@dataclass(frozen=True)
class BodyPart:
    """Effective mass kg and tissue stiffness N/m of a region of the body, and the radius m of the touching part."""

    mass_kg: float
    stiffness_n_m: float
    radius_m: float


# ISO/TS 15066:2016, table A.3: hands and fingers; lower arm and wrist joint (mass of lower arm with hand).
BODY_PARTS: dict[str, BodyPart] = {"hand": BodyPart(0.6, 75_000.0, 0.04), "forearm": BodyPart(2.0, 40_000.0, 0.045)}


@dataclass(frozen=True)
class Strike:
    """One collision: which part hits which link (from 1), where, and how.

    `along` 0 to 1 from the lower to the upper end of the link's capsule; `direction` (3,) of the part's motion, in the
    base frame or the link's own. The part arrives at `speed_m_s` and then pushes for `duration_s` with a half sine of
    `push_n`. The impact itself may exceed that force for a moment.
    """

    link: int
    direction: tuple[float, float, float]
    along: float = 0.5
    frame: Literal["base", "link"] = "base"
    part: Literal["hand", "forearm"] = "hand"
    speed_m_s: float = 0.3
    push_n: float = 100.0
    duration_s: float = 0.2


class _State(Enum):
    PARKED = auto()
    APPROACHING = auto()
    PUSHING = auto()
    WITHDRAWING = auto()


@dataclass
class ContactRecord:
    """Result of a strike: first and last touch s (None: not yet), link touched (from 1), largest force N; when the hand
    started, and when it was withdrawn before any touch, s (None: it was not)."""

    contact_s: float | None = None
    release_s: float | None = None
    link: int = 0
    peak_force_n: float = 0.0
    sent_s: float | None = None
    withdrawn_s: float | None = None


class Hand:
    """The body that performs one `Strike`. It is parked out of reach until `start`, and after it has withdrawn.

    `number` identifies it among the hands of a model; `place` is where the scenario defines the strike.
    """

    def __init__(self, strike: Strike, number: int, place: str = "") -> None:
        self.strike = strike
        self.place = place
        self.record = ContactRecord()
        self.force_n = 0.0  # contact force in the last step
        self._part = BODY_PARTS[strike.part]
        self._name = f"hand{number}"
        self._park = np.array([float(number), 0.0, -PARK_M])
        self._state = _State.PARKED
        self._since = 0.0

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """A sphere on three slides, without weight because the person carries it, paired with every link of the arm."""
        body = spec.worldbody.add_body(name=self._name, pos=self._park, gravcomp=1.0)
        for axis, name in enumerate("xyz"):
            body.add_joint(name=f"{self._name}_{name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=np.eye(3)[axis].tolist())
        body.add_geom(
            name=self._name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[self._part.radius_m, 0, 0],
            mass=self._part.mass_kg,
            contype=0,
            conaffinity=0,
        )
        links = sum(1 for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE)
        for link in range(links):
            spec.add_pair(
                name=f"{self._name}_{geom_name(link)}",
                geomname1=geom_name(link),
                geomname2=self._name,
                condim=3,
                friction=[0.5, 0.5, 0.005, 1e-4, 1e-4],
                solimp=[IMPEDANCE, IMPEDANCE, 1e-3, 0.5, 2.0],
            )

    def start(self, arm: Arm, time_s: float) -> None:
        """Appear in front of the target, moving with it, and start.

        Raises Obstructed if the arm is already there.
        """
        model, data = arm.model, arm.data
        self._joints = (model.joint(f"{self._name}_x").qposadr[0], model.joint(f"{self._name}_x").dofadr[0])
        self._geom = model.geom(self._name).id
        self._links = {model.geom(geom_name(link)).id: link + 1 for link in range(arm.n)}
        self._jacobian = np.zeros((3, model.nv))
        capsule = arm.robot.capsules[self.strike.link - 1]
        self._reach = STANDOFF_M + self._part.radius_m + capsule.radius
        self._target = (1 - self.strike.along) * capsule.p0 + self.strike.along * capsule.p1
        self._soften(arm)
        point, velocity, direction = self._aim(arm)
        position, speed = self._joints
        data.qpos[position : position + 3] = point - self._reach * direction - self._park
        data.qvel[speed : speed + 3] = velocity
        mujoco.mj_kinematics(model, data)
        for geom, link in self._links.items():
            if mujoco.mj_geomDistance(model, data, geom, self._geom, 1.0, None) <= 0.0:
                raise Obstructed(f"the {self.strike.part} would start inside link {link}; strike from elsewhere")
        self.record.sent_s = time_s
        self._enter(_State.APPROACHING, time_s)

    def withdraw(self, time_s: float) -> None:
        """Withdraw, with or without a strike."""
        if self._state in (_State.APPROACHING, _State.PUSHING):
            if self.record.contact_s is None:
                self.record.withdrawn_s = time_s
            self._enter(_State.WITHDRAWING, time_s)

    def before_step(self, arm: Arm, time_s: float) -> None:
        """Drive the part: towards its target, then with its push, then away."""
        if self._state is _State.PARKED:
            return
        data, strike, mass = arm.data, self.strike, self._part.mass_kg
        point, velocity, direction = self._aim(arm)
        position, speed = self._joints
        offset = data.qpos[position : position + 3] + self._park - point
        drift = data.qvel[speed : speed + 3] - velocity
        ahead, forward = float(offset @ direction), float(drift @ direction)
        sideways = offset - ahead * direction
        gain = SPEED_RATE_PER_S * mass
        elapsed = time_s - self._since
        if self._state is _State.APPROACHING and elapsed > GIVE_UP_S + STANDOFF_M / strike.speed_m_s:
            self._enter(_State.WITHDRAWING, time_s)
        if self._state is _State.PUSHING and elapsed > strike.duration_s:
            self._enter(_State.WITHDRAWING, time_s)
        if self._state is _State.WITHDRAWING and ahead < -self._reach:
            self._park_it(arm, time_s)
            return
        if self._state is _State.APPROACHING:
            push = float(np.clip(gain * (strike.speed_m_s - forward), -strike.push_n, strike.push_n))
        elif self._state is _State.PUSHING:
            follow = max(strike.speed_m_s, strike.push_n / gain)  # follows a link that yields, but no faster
            half_sine = strike.push_n * math.sin(math.pi * elapsed / strike.duration_s)
            push = float(np.clip(gain * (follow - forward), -strike.push_n, half_sine))
        else:
            push = float(np.clip(gain * (-WITHDRAW_M_S - forward), -strike.push_n, strike.push_n))
        aim = -mass * (AIM_RAD_S**2 * sideways + 2 * AIM_RAD_S * (drift - forward * direction))
        data.qfrc_applied[speed : speed + 3] = push * direction + aim

    def after_step(self, arm: Arm, time_s: float) -> None:
        """Read the contact force and update the record."""
        self.force_n = 0.0
        if self._state is _State.PARKED or arm.data.ncon == 0:
            return
        wrench = np.empty(6)
        largest = 0.0
        for index, (first, second) in enumerate(arm.data.contact.geom):
            if self._geom not in (first, second):
                continue
            mujoco.mj_contactForce(arm.model, arm.data, index, wrench)
            force = float(np.linalg.norm(wrench[:3]))
            self.force_n += force
            if force > largest:
                largest, touched = (force, self._links[int(first if second == self._geom else second)])
        if self.force_n <= 0.0:
            return
        record = self.record
        if record.contact_s is None:
            record.contact_s, record.link = time_s, touched
        record.release_s = time_s + arm.model.opt.timestep
        record.peak_force_n = max(record.peak_force_n, self.force_n)
        if self._state is _State.APPROACHING:
            self._enter(_State.PUSHING, time_s)

    def _enter(self, state: _State, time_s: float) -> None:
        self._state, self._since = state, time_s

    def _park_it(self, arm: Arm, time_s: float) -> None:
        position, speed = self._joints
        arm.data.qpos[position : position + 3] = 0.0
        arm.data.qvel[speed : speed + 3] = 0.0
        arm.data.qfrc_applied[speed : speed + 3] = 0.0
        self._enter(_State.PARKED, time_s)

    def _aim(self, arm: Arm) -> tuple[Vector, Vector, Vector]:
        """Target point m, its velocity m/s and the unit direction of the strike, (3,) each in the base frame."""
        body = arm.link_body(self.strike.link)
        rotation = arm.data.xmat[body].reshape(3, 3)
        point = arm.data.xpos[body] + rotation @ self._target
        mujoco.mj_jac(arm.model, arm.data, self._jacobian, None, point, body)
        direction = np.array(self.strike.direction)
        if self.strike.frame == "link":
            direction = rotation @ direction
        return (point, self._jacobian @ arm.data.qvel, direction / np.linalg.norm(direction))

    def _soften(self, arm: Arm) -> None:
        """Give the contact pairs the tissue's stiffness and damping.

        MuJoCo's direct form solref = (-k, -b) acts per unit of the inverse mass A that it estimates for the pair: at
        constant impedance d the contact is a spring of k / ((1 - d) A) N/m, and likewise a damper.
        """
        model, part = arm.model, self._part
        damping = 2 * TISSUE_DAMPING * math.sqrt(part.stiffness_n_m * part.mass_kg)
        for link in range(arm.n):
            inverse_mass = 1 / part.mass_kg + model.body_invweight0[arm.link_body(link + 1), 0]
            per_newton = (1 - IMPEDANCE) * inverse_mass
            pair = model.pair(f"{self._name}_{geom_name(link)}").id
            model.pair_solref[pair] = (-part.stiffness_n_m * per_newton, -damping * per_newton)
