"""The method in float64 on numpy, Pinocchio and LAPACK, written independently of the firmware: the tests' reference."""

import numpy as np

from tauperp.config import TASKS, Configuration
from tauperp.config.block import MAX_GAP
from tauperp.config.configuration import TASK_DWELL_S
from tauperp.robot.check import pinocchio_reader
from tauperp.robot.spatial import Array


class Reference:
    """Observer, projection, limits and detector of one installation in the paper's order, one cycle after the other.

    Valid for torques that are means over a cycle, as in the paper's preset.
    """

    def __init__(self, configuration: Configuration) -> None:
        settings = configuration.settings
        assert settings.subspace.order == "filter_first"
        assert settings.observer.torque_sample == "interval"
        n = configuration.robot.n
        self._subspace = settings.subspace
        self._acceleration = settings.acceleration
        self._read = pinocchio_reader(configuration.robot)
        self._g = float(np.linalg.norm(configuration.robot.gravity))
        self._down = configuration.robot.gravity / self._g
        self._period_s = configuration.period_us * 1e-6
        self._decay = np.exp(-settings.observer.gain_per_s * self._period_s)
        self._task = {number: settings.task[name] for name, number in TASKS.items()}
        self._threshold = {number: configuration.threshold_nm(name) for name, number in TASKS.items()}
        self._residual_max = {number: configuration.residual_max_nm(name) for name, number in TASKS.items()}
        self._dwell = round(TASK_DWELL_S / self._period_s)
        self._before: tuple[Array, Array, Array] | None = None  # momentum, drift and torque of the last step
        self._velocity = np.zeros(3)
        self._measured, self._commanded = np.zeros(3), np.zeros(3)
        self._in_force, self._dwelt = 0, 0
        self._above = np.zeros(n, int)
        self._beyond = 0
        self.residual = np.zeros(n)
        self.index = np.zeros(n)

    def step(self, q: Array, qd: Array, tau: Array, task: int, acceleration: Array, gap: int) -> bool:
        """True if this is a collision, or if the explained part exceeds the limits of the task.

        `gap`: cycles since the last step.
        """
        terms = self._read(q, qd)
        drift = terms.coriolis - terms.gravity
        velocity = terms.jacobian[:3] @ qd
        if self._before is None or gap > MAX_GAP:
            self.residual = np.zeros(len(q))
            self._measured, self._commanded = np.zeros(3), np.zeros(3)
        else:
            decay = self._decay**gap
            momentum, drift_before, tau_before = self._before
            share = (gap - 1) / (
                2 * gap
            )  # weight of the first torque in the mean over a gap, if the torque changed linearly
            mean = share * tau_before + (1 - share) * tau + (drift + drift_before) / 2
            span = gap * self._period_s
            rest = mean - (terms.momentum - momentum) / span
            self.residual = decay * self.residual + (1 - decay) * rest
            self._measured = decay * self._measured + (1 - decay) * (velocity - self._velocity) / span
            self._commanded = decay * self._commanded + (1 - decay) * acceleration
        self._before, self._velocity = (terms.momentum, drift, tau.copy()), velocity
        self._dwelt += gap
        if task != self._in_force and (self._in_force == 0 or self._dwelt >= self._dwell):
            self._in_force, self._dwelt = task, 0
        row = self._task[self._in_force]
        agrees = bool(np.linalg.norm(self._commanded - self._measured) <= self._acceleration.error_max_m_s2)
        across = acceleration - (acceleration @ self._down) * self._down
        size = float(np.linalg.norm(across))
        used = agrees and row.limits.mass_max_kg * size >= self._acceleration.force_floor_n
        columns = self._columns(terms.jacobian, across / size if used else np.zeros(3))
        self.index = self._complement(columns) @ self.residual
        self._above = np.where(np.abs(self.index) > self._threshold[self._in_force], self._above + 1, 0)
        total = float(np.linalg.norm(acceleration)) if agrees else 0.0
        excess = self._exceeds(columns, self.residual - self.index, size if used else 0.0, total)
        self._beyond = self._beyond + 1 if excess else 0
        return bool((self._above >= row.debounce_ticks).any()) or self._beyond >= row.debounce_ticks

    def _columns(self, jacobian: Array, sideways: Array) -> Array:
        linear, moments = jacobian[:3].T, self._subspace.lever_m * jacobian[3:].T
        match self._task[self._in_force].index:
            case "d_p":
                return np.column_stack([moments, linear @ self._down, linear @ sideways])
            case "d_e":
                return np.column_stack([linear, moments])
            case _:
                return np.zeros((len(linear), 0))

    def _complement(self, columns: Array) -> Array:
        left, singular, _ = np.linalg.svd(columns, full_matrices=False)
        explained = left[:, singular > self._subspace.tolerance_nm_per_n]
        return np.eye(len(columns)) - explained @ explained.T

    def _exceeds(self, columns: Array, explained: Array, across: float, total: float) -> bool:
        """Whether the explained part exceeds the limits of the task, as in explained.h."""
        task, k = self._task[self._in_force], columns.shape[1]
        limits, lever = task.limits, self._subspace.lever_m
        soft = self._subspace.softness_nm_per_n**2 * np.eye(k)
        w = np.linalg.solve(columns.T @ columns + soft, columns.T @ explained)
        beyond = bool((np.abs(self.residual) > self._residual_max[self._in_force]).any())
        if task.index == "d_p":
            weight = limits.mass_max_kg * (self._g + total)
            moment = limits.arm_max_m * weight + limits.moment_slack_nm
            beyond |= -w[3] > weight + limits.force_slack_n or w[3] > limits.force_slack_n
            beyond |= abs(w[4]) > limits.mass_max_kg * across + limits.force_slack_n
            beyond |= lever * float(np.linalg.norm(w[:3])) > moment
        elif task.index == "d_e":
            beyond |= float(np.linalg.norm(w[:3])) > limits.force_max_n
            beyond |= lever * float(np.linalg.norm(w[3:])) > limits.moment_max_nm
        return bool(beyond)
