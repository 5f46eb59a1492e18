"""Confidence intervals of counts. Every rate that a command prints has one: 95 % unless stated."""

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

LEVEL = 0.95


def wilson(found: int, of: int, level: float = LEVEL) -> tuple[float, float]:
    """Wilson's score interval of a proportion (E. B. Wilson, JASA 22, 1927). (0, 1) without samples."""
    if of == 0:
        return 0.0, 1.0
    z = NormalDist().inv_cdf(0.5 + level / 2)
    share, scale = found / of, 1 + z * z / of
    middle = (share + z * z / (2 * of)) / scale
    half = z / scale * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of))
    return max(0.0, middle - half), min(1.0, middle + half)


def poisson(count: int, exposure: float, level: float = LEVEL) -> tuple[float, float]:
    """Exact interval of a rate from `count` events in `exposure` hours (F. Garwood, Biometrika 28, 1936).

    Without an event the one-sided upper end is 3 / exposure, within a percent. The two-sided end here is 3.7 /
    exposure.
    """
    from scipy.stats import chi2

    if exposure <= 0:
        return 0.0, math.inf
    tail = (1 - level) / 2
    low = 0.0 if count == 0 else float(chi2.ppf(tail, 2 * count)) / 2
    return low / exposure, float(chi2.ppf(1 - tail, 2 * count + 2)) / 2 / exposure


def quantile(values: Sequence[float] | npt.NDArray[np.float64], share: float, level: float = LEVEL) -> list[float]:
    """[estimate, low, high] of a quantile. The interval is that of its order statistics. NaN without samples."""
    from scipy.stats import binom

    ordered = np.sort(np.asarray(values, float))
    n = len(ordered)
    if n == 0:
        return [math.nan] * 3
    tail = (1 - level) / 2
    low = max(int(binom.ppf(tail, n, share)) - 1, 0)
    high = min(int(binom.ppf(1 - tail, n, share)), n - 1)
    return [float(np.quantile(ordered, share)), float(ordered[low]), float(ordered[high])]
