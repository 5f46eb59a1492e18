"""The method in float64, written anew on numpy, Pinocchio and LAPACK: what the firmware's decisions are measured by."""

import numpy as np

from tauperp.config import TASKS, Configuration
from tauperp.config.block import MAX_GAP
from tauperp.robot.check import pinocchio_reader
from tauperp.robot.spatial import Array


class Reference:
    """Observer, index and detector of one installation, one cycle after the other.

    For the instantaneous basis and torques that are means over a cycle, which is what the paper's preset has.
    """

    def __init__(self, configuration: Configuration) -> None:
        settings = configuration.settings
        assert settings.subspace.basis == "instantaneous"
        assert settings.observer.torque_sample == "interval"
        n = configuration.robot.n
        self._subspace = settings.subspace
        self._read = pinocchio_reader(configuration.robot)
        self._down = configuration.robot.gravity / np.linalg.norm(configuration.robot.gravity)
        self._period_s = configuration.period_us * 1e-6
        self._decay = np.exp(-settings.observer.gain_per_s * self._period_s)
        self._task = {number: settings.task[name] for name, number in TASKS.items()}
        self._threshold = {number: configuration.threshold_nm(name) for name, number in TASKS.items()}
        self._before: tuple[Array, Array, Array] | None = None  # momentum, drift and torque of the last step
        self._projector = np.eye(n)
        self._fading = np.zeros(n)
        self._in_force = 0
        self._above = np.zeros(n, int)
        self.residual = np.zeros(n)
        self.index = np.zeros(n)

    def step(self, q: Array, qd: Array, tau: Array, task: int, acceleration: Array, gap: int) -> bool:
        """True if the index says that this is a collision. `gap`: cycles since the last step."""
        terms = self._read(q, qd)
        drift = terms.coriolis - terms.gravity
        if self._before is None or gap > MAX_GAP:
            decay = 0.0
            self.residual = np.zeros(len(q))
        else:
            momentum, drift_before, tau_before = self._before
            decay = self._decay**gap
            share = (gap - 1) / (2 * gap)  # of the mean torque before a gap, if it changed steadily
            mean = share * tau_before + (1 - share) * tau + (drift + drift_before) / 2
            rest = mean - (terms.momentum - momentum) / (gap * self._period_s)
            self.residual = decay * self.residual + (1 - decay) * rest
        self._before = (terms.momentum, drift, tau.copy())
        self._fading = decay * self._fading
        if task != self._in_force != 0:
            self._fading = self.residual - self._projector @ (self.residual - self._fading)
        self._in_force = task
        self._projector = self._complement(self._columns(task, terms.jacobian, acceleration))
        self.index = self._projector @ (self.residual - self._fading)
        self._above = np.where(np.abs(self.index) > self._threshold[task], self._above + 1, 0)
        return bool((self._above >= self._task[task].debounce_ticks).any())

    def _columns(self, task: int, jacobian: Array, acceleration: Array) -> Array:
        linear, moments = jacobian[:3].T, self._subspace.lever_m * jacobian[3:].T
        match self._task[task].index:
            case "d_p":
                across = acceleration - (acceleration @ self._down) * self._down
                return np.column_stack([linear @ self._down, linear @ across, moments])
            case "d_e":
                return np.column_stack([linear, moments])
            case _:
                return np.zeros((len(linear), 0))

    def _complement(self, columns: Array) -> Array:
        left, singular, _ = np.linalg.svd(columns, full_matrices=False)
        explained = left[:, singular > self._subspace.tolerance_nm_per_n]
        return np.eye(len(columns)) - explained @ explained.T
