"""A threshold for a wanted rate of false alarms: block maxima and their extreme-value tail.

The signal is divided into blocks that are longer than its memory. The block maxima follow a generalised extreme-value
distribution (S. Coles, An Introduction to Statistical Modeling of Extreme Values, 2001, chapter 3). The threshold is a
quantile of it. T hours without an alarm do not exclude a rate of 3 / T (95 %): the tail is an extrapolation, and is
reported as one.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

SHAPES = (-0.2, 0.2)  # bound of the tail's shape; a few dozen maxima support no heavier one
FEWEST_FOR_SHAPE = 60  # number of maxima; with fewer the tail is Gumbel's
RESAMPLES = 200
SMALLEST_NM = 0.1
FARTHEST = 10.0  # record lengths over which the tail is extrapolated


@dataclass(frozen=True)
class Tail:
    """A generalised extreme-value distribution in scipy's convention: its c is minus the usual shape."""

    shape: float
    location: float
    scale: float

    def quantile(self, above: float) -> float:
        """The value that one block's maximum exceeds with probability `above`."""
        from scipy.stats import genextreme

        return float(genextreme.isf(above, self.shape, self.location, self.scale))

    def above(self, value: float) -> float:
        """The probability that one block's maximum exceeds `value`."""
        from scipy.stats import genextreme

        return float(genextreme.sf(value, self.shape, self.location, self.scale))


def block_maxima(signal: FloatArray, block_rows: int) -> FloatArray:
    """Largest |signal| (m, n) in each whole block, (blocks, n)."""
    blocks = len(signal) // block_rows
    if blocks == 0:
        return np.zeros((0, signal.shape[1]))
    cut = np.abs(signal[: blocks * block_rows])
    result: FloatArray = cut.reshape(blocks, block_rows, -1).max(axis=1)
    return result


def fit_tail(maxima: FloatArray) -> Tail:
    """Fit one joint's block maxima (blocks,) by L-moments (J. R. M. Hosking, Technometrics 27, 1985)."""
    ordered = np.sort(maxima)
    n = len(ordered)
    rank = np.arange(n)
    b0 = float(ordered.mean())
    b1 = float((rank / max(n - 1, 1) * ordered).mean())
    b2 = float((rank * (rank - 1) / max((n - 1) * (n - 2), 1) * ordered).mean())
    l2, l3 = 2 * b1 - b0, 6 * b2 - 6 * b1 + b0
    if l2 <= 1e-12:
        return Tail(0.0, b0, max(1e-6, abs(b0) * 1e-3))
    shape = 0.0
    if n >= FEWEST_FOR_SHAPE:
        c = 2 / (3 + l3 / l2) - math.log(2) / math.log(3)
        shape = min(max(7.8590 * c + 2.9554 * c * c, SHAPES[0]), SHAPES[1])
    if abs(shape) < 1e-3:
        scale = l2 / math.log(2)
        return Tail(0.0, b0 - 0.5772156649 * scale, scale)
    gamma = math.gamma(1 + shape)
    scale = l2 * shape / ((1 - 2**-shape) * gamma)
    return Tail(shape, b0 - scale * (1 - gamma) / shape, scale)


def thresholds(maxima: FloatArray, block_s: float, alarms_per_hour: float) -> FloatArray:
    """One threshold per signal, (n,), so that all together are exceeded in this many blocks per hour; from maxima
    (blocks, n).

    The rate is never below one block in FARTHEST lengths of the record, because the tail is unknown beyond.
    """
    n = maxima.shape[1]
    rate = max(alarms_per_hour, reachable_rate(len(maxima) * block_s / 3600))
    above = -math.expm1(-rate / n * block_s / 3600)
    values = [max(fit_tail(column).quantile(above), float(column.max()), SMALLEST_NM) for column in maxima.T]
    return np.array(values)


def expected_rate(maxima: FloatArray, limits: FloatArray, block_s: float) -> float:
    """Alarms per hour that the fitted tails expect of these thresholds."""
    kept = 1.0
    for column, limit in zip(maxima.T, limits, strict=True):
        kept *= 1.0 - fit_tail(column).above(float(limit))
    return (1.0 - kept) * 3600 / block_s


def rate_interval(maxima: FloatArray, limits: FloatArray, block_s: float, seed: int = 1) -> tuple[float, float]:
    """95 % interval of `expected_rate` over resampled blocks."""
    rng = np.random.default_rng(seed)
    blocks = len(maxima)
    rates = [expected_rate(maxima[rng.integers(0, blocks, blocks)], limits, block_s) for _ in range(RESAMPLES)]
    return float(np.quantile(rates, 0.025)), float(np.quantile(rates, 0.975))


def speed_gain(fitted: FloatArray, speed: FloatArray, held: FloatArray, held_speed: FloatArray) -> FloatArray:
    """How much lower thresholds on held-out blocks would be if they grew with the joint's speed, (n,), as a share.

    Block maxima and largest speeds (blocks, n), fitted and held out. Both thresholds are the lowest ones above every
    fitted maximum. 0 if the speed-dependent threshold is exceeded more often on the held-out blocks, or is not lower
    there.
    """
    gains = np.zeros(fitted.shape[1])
    for k in range(len(gains)):
        x, y = speed[:, k], fitted[:, k]
        if not len(held) or float(np.var(x)) < 1e-9:
            continue
        slope = max(0.0, float(np.mean((x - x.mean()) * (y - y.mean())) / np.var(x)))
        constant = max(float(y.max()), SMALLEST_NM)
        limits = np.maximum(float((y - slope * x).max()) + slope * held_speed[:, k], SMALLEST_NM)
        if (held[:, k] > limits).sum() <= (held[:, k] > constant).sum():
            gains[k] = max(0.0, 1 - float(limits.mean()) / constant)
    return gains


def reachable_rate(hours: float) -> float:
    """The smallest rate per hour to which a tail from this many hours is extrapolated."""
    return 1.0 / (FARTHEST * hours) if hours > 0 else math.inf


def supported_rate(hours: float) -> float:
    """The largest rate per hour that this many hours without an alarm do not exclude (95 %): 3 / T."""
    return 3.0 / hours if hours > 0 else math.inf
