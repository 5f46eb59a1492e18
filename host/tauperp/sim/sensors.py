"""Joint sensors: the errors that the readings of a real arm have.

The frames apply the wire's own quantisation. Every random number comes from the generator argument.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tauperp.sim.arm import JointSample


@dataclass(frozen=True)
class SensorModel:
    """Errors of every joint's sensors. The zeros of the default are ideal sensors.

    Offset, gain error and ripple differ between joints: drawn once, uniformly within plus and minus the given value.
    Coulomb friction between sensor and link is drawn uniformly from half to all of the given value. It has the sign of
    the velocity and decreases below FRICTION_RAD_S. Ripple is a sine of the joint angle with `ripple_per_turn` periods
    per turn, as sensors at a harmonic drive show it.
    """

    torque_noise_nm: float = 0.0  # standard deviation
    torque_offset_nm: float = 0.0
    torque_gain_error: float = 0.0
    torque_ripple_nm: float = 0.0
    ripple_per_turn: int = 2
    position_noise_rad: float = 0.0
    velocity_noise_rad_s: float = 0.0
    delay_cycles: int = 0
    torque_quantum_nm: float = 0.0  # resolution of the reading; 0: only the wire's
    velocity_quantum_rad_s: float = 0.0
    torque_friction_nm: float = 0.0


FRICTION_RAD_S = 0.01  # velocity at which the friction has reached three quarters of its value

# Errors as real arms show them. Velocity noise is that of the reported joint velocity: Panda 2.7 to 3.8 mrad/s, Rokae
# xMate 1.1 to 1.9, Kinova Gen3 0.95 to 4.4; torque noise 0.01 to 0.08 Nm in steps of 0.03 to 0.05 Nm; Coulomb friction
# left in a link-side sensor 0.13 to 0.65 Nm. Offsets and friction are those that remain after `tauperp calibrate`.
# `harsh` has more of everything but the velocity noise. `paper` is better than real sensors: it has
# no velocity noise.
SensorPreset = Literal["ideal", "paper", "harsh", "panda", "xmate", "gen3"]
SENSOR_PRESETS: dict[SensorPreset, SensorModel] = {
    "ideal": SensorModel(),
    "paper": SensorModel(
        torque_noise_nm=0.05,
        torque_offset_nm=0.05,
        torque_gain_error=0.005,
        torque_ripple_nm=0.05,
    ),
    "harsh": SensorModel(
        torque_noise_nm=0.08,
        torque_offset_nm=0.15,
        torque_gain_error=0.01,
        torque_ripple_nm=0.15,
        velocity_noise_rad_s=0.002,
    ),
    "panda": SensorModel(
        torque_noise_nm=0.03,
        torque_offset_nm=0.1,
        torque_gain_error=0.01,
        torque_ripple_nm=0.1,
        velocity_noise_rad_s=0.0033,
        torque_quantum_nm=0.03,
        torque_friction_nm=0.2,
    ),
    "xmate": SensorModel(
        torque_noise_nm=0.05,
        torque_offset_nm=0.1,
        torque_gain_error=0.01,
        torque_ripple_nm=0.15,
        velocity_noise_rad_s=0.0015,
        torque_quantum_nm=0.05,
        torque_friction_nm=0.3,
    ),
    "gen3": SensorModel(
        torque_noise_nm=0.08,
        torque_offset_nm=0.15,
        torque_gain_error=0.01,
        torque_ripple_nm=0.2,
        velocity_noise_rad_s=0.0027,
        torque_quantum_nm=0.05,
        torque_friction_nm=0.3,
    ),
}


def stepped(values: np.ndarray, quantum: float) -> np.ndarray:
    """Rounded to whole steps. A quantum of 0 changes nothing."""
    return quantum * np.rint(values / quantum) if quantum > 0 else values


FaultKind = Literal["offset", "gain", "stuck", "status", "silent", "crc"]


@dataclass(frozen=True)
class SensorFault:
    """A fault of joint `joint` (from 1) between two times, s.

    offset: `value` Nm added; gain: torque times `value`; stuck: the torque reading stays; status: the joint reports
    SensorStatus `value`; silent: it sends nothing; crc: its frames arrive with a broken CRC.
    """

    joint: int
    kind: FaultKind
    start_s: float
    end_s: float = math.inf
    value: float = 0.0

    def active(self, time_s: float) -> bool:
        """Whether it acts at this time."""
        return self.start_s <= time_s < self.end_s


class Sensors:
    """The sensors of one arm of `n` joints. Call `read` once per cycle, in order."""

    def __init__(
        self, model: SensorModel, n: int, rng: np.random.Generator, faults: Sequence[SensorFault] = ()
    ) -> None:
        self._model = model
        self._rng = rng
        self._faults = tuple(faults)
        self._offset = model.torque_offset_nm * rng.uniform(-1, 1, n)
        self._gain = 1 + model.torque_gain_error * rng.uniform(-1, 1, n)
        self._ripple = model.torque_ripple_nm * rng.uniform(-1, 1, n)
        self._ripple_phase = rng.uniform(0, 2 * math.pi, n)
        share = rng.uniform(0.5, 1, n) if model.torque_friction_nm > 0 else np.zeros(n)  # drawn only if used
        self._friction = model.torque_friction_nm * share
        self._late: deque[JointSample] = deque(maxlen=model.delay_cycles + 1)
        self._stuck: dict[int, float] = {}

    def read(self, truth: JointSample, time_s: float) -> JointSample:
        """Readings of `truth`, `delay_cycles` late. The first readings repeat the first true values."""
        self._late.append(truth)
        seen, model, rng = self._late[0], self._model, self._rng
        n = len(seen.torque)
        ripple = self._ripple * np.sin(model.ripple_per_turn * seen.position + self._ripple_phase)
        friction = self._friction * np.tanh(seen.velocity / FRICTION_RAD_S)
        noise = model.torque_noise_nm * rng.standard_normal(n)
        torque = stepped(self._gain * seen.torque + self._offset + ripple + friction + noise, model.torque_quantum_nm)
        position = seen.position + model.position_noise_rad * rng.standard_normal(n)
        noisy = seen.velocity + model.velocity_noise_rad_s * rng.standard_normal(n)
        velocity = stepped(noisy, model.velocity_quantum_rad_s)
        self._break(torque, time_s)
        return JointSample(position, velocity, torque)

    def _break(self, torque: np.ndarray, time_s: float) -> None:
        for fault in self._faults:
            joint = fault.joint - 1
            if not fault.active(time_s):
                if fault.kind == "stuck":
                    self._stuck.pop(joint, None)
            elif fault.kind == "offset":
                torque[joint] += fault.value
            elif fault.kind == "gain":
                torque[joint] *= fault.value
            elif fault.kind == "stuck":
                torque[joint] = self._stuck.setdefault(joint, float(torque[joint]))
