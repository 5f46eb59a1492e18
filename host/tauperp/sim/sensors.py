"""Joint sensors between the truth and the wire: what a real arm's readings have that a simulation's have not.

Quantisation is not modelled here: the frames do it. Every random number comes from the generator handed in.
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
    """Errors of every joint's sensors; the zeros of the default are ideal sensors.

    Offset, gain error and ripple differ from joint to joint: drawn once, evenly within plus and minus what is given.
    Ripple is a sine of the joint angle, `ripple_per_turn` periods a turn, as a harmonic drive's sensor shows.
    """

    torque_noise_nm: float = 0.0  # standard deviation
    torque_offset_nm: float = 0.0
    torque_gain_error: float = 0.0
    torque_ripple_nm: float = 0.0
    ripple_per_turn: int = 2
    position_noise_rad: float = 0.0
    velocity_noise_rad_s: float = 0.0
    delay_cycles: int = 0


FaultKind = Literal["offset", "gain", "stuck", "status", "silent", "crc"]


@dataclass(frozen=True)
class SensorFault:
    """Something that goes wrong with joint `joint` (from 1) between two times, s.

    offset: `value` Nm added; gain: torque times `value`; stuck: the torque reading stays; status: the joint reports
    SensorStatus `value`; silent: it sends nothing; crc: its frames arrive with a broken CRC.
    """

    joint: int
    kind: FaultKind
    start_s: float
    end_s: float = math.inf
    value: float = 0.0

    def active(self, time_s: float) -> bool:
        """Whether it is there at this time."""
        return self.start_s <= time_s < self.end_s


class Sensors:
    """The sensors of one arm of `n` joints. `read` is called once a cycle, in order."""

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
        self._late: deque[JointSample] = deque(maxlen=model.delay_cycles + 1)
        self._stuck: dict[int, float] = {}

    def read(self, truth: JointSample, time_s: float) -> JointSample:
        """What the sensors say of `truth`, `delay_cycles` late; the first readings repeat the first truth."""
        self._late.append(truth)
        seen, model, rng = self._late[0], self._model, self._rng
        n = len(seen.torque)
        ripple = self._ripple * np.sin(model.ripple_per_turn * seen.position + self._ripple_phase)
        torque = self._gain * seen.torque + self._offset + ripple + model.torque_noise_nm * rng.standard_normal(n)
        position = seen.position + model.position_noise_rad * rng.standard_normal(n)
        velocity = seen.velocity + model.velocity_noise_rad_s * rng.standard_normal(n)
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
