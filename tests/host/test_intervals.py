"""Confidence intervals of counts, against published values and by simulation."""

import numpy as np
import pytest

from tauperp.intervals import poisson, quantile, wilson


def test_wilson_is_the_published_interval() -> None:
    low, high = wilson(81, 263)  # R. G. Newcombe, Statistics in Medicine 17, 1998, table I
    assert (low, high) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)
    assert wilson(0, 20)[0] == 0.0
    assert wilson(20, 20)[1] == 1.0


def test_without_an_event_the_rate_is_at_most_3_7_over_the_time() -> None:
    low, high = poisson(0, 2.0)
    assert low == 0.0
    assert high == pytest.approx(3.689 / 2.0, abs=1e-3)
    assert poisson(0, 2.0, level=0.90)[1] == pytest.approx(2.996 / 2.0, abs=1e-3)


def test_the_interval_of_a_quantile_has_its_nominal_coverage() -> None:
    rng = np.random.default_rng(5)
    held = 0
    for _ in range(400):
        _, low, high = quantile(rng.uniform(size=120), 0.5)
        held += low <= 0.5 <= high
    assert held / 400 > 0.92
