"""Sums over the last seconds, in slices of time: frames per second of each message, and their time on the bus."""

from collections import defaultdict, deque

SLICE_S = 0.1
WINDOW_S = 2.0
_SLICES = round(WINDOW_S / SLICE_S)


class Rates:
    """Adds up amounts by name; `rate` is the amount a second over the last WINDOW_S, or since the start if shorter.

    Time s, of any clock that does not go back.
    """

    def __init__(self, now_s: float) -> None:
        self._slice_end_s = now_s + SLICE_S
        self._open: defaultdict[str, float] = defaultdict(float)
        self._closed: deque[dict[str, float]] = deque(maxlen=_SLICES)

    def add(self, name: str, now_s: float, amount: float = 1.0) -> None:
        """Count `amount` as of now."""
        if now_s >= self._slice_end_s:
            self.advance(now_s)
        self._open[name] += amount

    def advance(self, now_s: float) -> None:
        """Close every finished slice; after a long silence at most as many as the window has."""
        over = int((now_s - self._slice_end_s) / SLICE_S) + 1 if now_s >= self._slice_end_s else 0
        for _ in range(min(over, _SLICES)):
            self._closed.append(dict(self._open))
            self._open.clear()
        self._slice_end_s += over * SLICE_S

    def rate(self, name: str) -> float:
        """Amount a second; 0 before the first slice is over."""
        if not self._closed:
            return 0.0
        return sum(one.get(name, 0.0) for one in self._closed) / (len(self._closed) * SLICE_S)
