"""The response of the guard's index to a torque, measured with the compiled firmware.

For one posture and task the guard receives the frames of an arm at rest. A torque is added to one joint after the
other: first a half-sine of 50 ms, then a constant torque until the index has settled. For a fixed posture everything in
the firmware is linear in the torque. These responses therefore give the index for any force on any link, for any
filters and projection.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tauperp.config import TASKS, Configuration, Numeric, TaskName
from tauperp.errors import InputError
from tauperp.kernel.bench import Bench
from tauperp.sim.dynamics import Dynamics

FloatArray = npt.NDArray[np.float64]

PULSE_S = 0.05
TAIL_S = 0.15  # after the pulse, for slow filters
SETTLE_S = 1.0  # until a constant torque is through every filter
START_S = 0.3
SHARE = 0.3  # of a joint's largest torque: far above the wire's steps


@dataclass(frozen=True, eq=False)
class Response:
    """Response of the index to 1 Nm on each joint.

    settled  (c n, n): index of each channel and joint for a constant torque on joint j
    pulse    (t, c n, n): the same over time for a half-sine of 50 ms with a peak of 1 Nm, t cycles from its start
    """

    settled: FloatArray
    pulse: FloatArray


class Prober:
    """Measures responses of one configuration. Its bench is made once."""

    def __init__(self, configuration: Configuration, numeric: Numeric = "float32") -> None:
        quiet = {"offset_nm": [0.0], "friction_nm": [0.0]}
        self._configuration = configuration.changed(sensor=quiet)
        self._bench = Bench([self._configuration], [], numeric=numeric)
        self._dynamics = Dynamics(configuration.robot)

    def measure(self, posture: FloatArray, task: TaskName) -> Response:
        """At one posture (n,) rad. Raises InputError if the wire cannot carry its torques."""
        configuration, n = self._configuration, self._configuration.robot.n
        period_s = configuration.period_us * 1e-6
        start, pulse, tail, settle = (round(span / period_s) for span in (START_S, PULSE_S, TAIL_S, SETTLE_S))
        block = start + pulse + tail + start + settle
        size = np.array([SHARE * joint.torque_max for joint in configuration.robot.joints])
        weight = self._dynamics.bias(posture, np.zeros(n))
        tau = np.tile(weight, (n * block, 1))
        shape = np.sin(np.pi * np.arange(pulse) / pulse)
        for joint in range(n):
            first = joint * block + start
            towards_zero = -np.sign(weight[joint]) or 1.0  # away from the limits of the joint and of the wire
            tau[first : first + pulse, joint] += towards_zero * size[joint] * shape
            held = first + pulse + tail + start
            tau[held : held + settle, joint] += towards_zero * size[joint]
            size[joint] *= towards_zero
        rows = len(tau)
        cycles = np.arange(1, rows + 1, dtype=np.uint32)
        heard = self._bench.listen((np.tile(posture, (rows, 1)), np.zeros((rows, n)), tau), cycles, TASKS[task])
        if heard.rows < rows:
            raise InputError("the posture's torques are beyond the wire, or the guard went to FAULT")
        index = heard.index.reshape(rows, -1)
        settled, answers = np.empty((index.shape[1], n)), np.empty((pulse + tail, index.shape[1], n))
        for joint in range(n):
            first = joint * block + start
            answers[:, :, joint] = (index[first : first + pulse + tail] - index[first - 1]) / size[joint]
            held = first + pulse + tail + start
            settled[:, joint] = (index[held + settle - 1] - index[held - 1]) / size[joint]
        return Response(settled, answers)


def smallest_static(response: Response, levers: FloatArray, threshold: FloatArray) -> FloatArray:
    """Forces (k,) N that just reach a threshold (channels, n), for torques per newton `levers` (k, n); infinite if
    none does."""
    ratio = (np.abs(levers @ response.settled.T) / threshold.ravel()).max(axis=1)
    with np.errstate(divide="ignore"):
        result: FloatArray = 1.0 / ratio
    return result


def smallest_pulse(response: Response, levers: FloatArray, threshold: FloatArray, debounce: int) -> FloatArray:
    """Peaks (k,) N of half-sines of 50 ms that stay above a threshold for `debounce` ticks in a row."""
    index = np.abs(np.einsum("tij,kj->tki", response.pulse, levers)) / threshold.ravel()
    ratio = index.max(axis=2)
    held = ratio.copy()
    for later in range(1, debounce):
        held[later:] = np.minimum(held[later:], ratio[:-later])
        held[:later] = 0.0
    with np.errstate(divide="ignore"):
        result: FloatArray = 1.0 / held.max(axis=0)
    return result
