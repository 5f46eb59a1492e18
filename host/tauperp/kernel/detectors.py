"""The detectors of a campaign: the guard, and simpler detectors on the same signals that the guards compute.

Every detector is a linear filter of one guard's r or index, with a threshold per joint. A band-pass is a second-order
Butterworth (the paper's related work names 1 to 10 and 3 to 30 Hz). An observer with another gain K follows exactly
from r, because r is the one-tick residual after a first-order low-pass with a known pole.
"""

import dataclasses
import math
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from tauperp.errors import InputError
from tauperp.kernel import layout

FloatArray = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Detector:
    """A signal and its thresholds.

    source        the guard's r, its index, or "own": its index against its own thresholds, whichever channel is nearest
    threshold_nm  (n,), NaN where a calibration has to find it first; of "own" those of all channels, for the report
    guard         counts the configurations from 0
    """

    name: str
    source: Literal["residual", "index", "own"]
    threshold_nm: FloatArray
    guard: int = 0
    sections: FloatArray = dataclasses.field(default_factory=lambda: np.zeros((0, 6)))  # (s, 6), scipy's "sos"
    debounce_ticks: int = 1

    def fill(self, target: Any, joints: int) -> None:
        """Write this to a layout.DETECTOR."""
        if len(self.sections) > layout.SECTIONS:
            raise InputError(f"{self.name}: {len(self.sections)} sections of a filter, {layout.SECTIONS} at most")
        if self.source != "own":
            target["threshold"][:joints] = np.where(np.isfinite(self.threshold_nm), self.threshold_nm, 1.0)
        target["section"][: len(self.sections)] = self.sections
        target["sections"], target["guard"] = len(self.sections), self.guard
        target["source"] = {"residual": layout.RESIDUAL, "index": layout.INDEX, "own": layout.OWN}[self.source]
        target["debounce"] = self.debounce_ticks

    @property
    def is_calibrated(self) -> bool:
        return bool(np.isfinite(self.threshold_nm).all())

    def at(self, threshold_nm: FloatArray) -> "Detector":
        """The same with these thresholds."""
        return dataclasses.replace(self, threshold_nm=threshold_nm)


def band_pass(low_hz: float, high_hz: float, period_s: float) -> FloatArray:
    """Second-order Butterworth band-pass, (2, 6). Raises InputError if the band does not fit under half the rate."""
    from scipy.signal import butter

    if high_hz >= 0.5 / period_s:
        raise InputError(f"a band-pass up to {high_hz:g} Hz needs more than {2 * high_hz:g} cycles a second")
    sections: FloatArray = butter(2, [low_hz, high_hz], "bandpass", fs=1.0 / period_s, output="sos")
    return sections


def other_gain(gain_per_s: float, of_gain_per_s: float, period_s: float) -> FloatArray:
    """The filter that turns r of one observer gain into r of another, (1, 6)."""
    new, old = math.exp(-gain_per_s * period_s), math.exp(-of_gain_per_s * period_s)
    scale = (1 - new) / (1 - old)
    return np.array([[scale, -scale * old, 0.0, 1.0, -new, 0.0]])
