"""Reader of Vector's .asc format. It reads frames, and ignores and counts everything else that a tool may write.

It replaces python-can's reader, which treats the first frame of a file without a trigger block as part of the header,
knows neither relative time stamps nor headers in other languages, and does not report what it ignores. These are
damage: a line that looks like a frame but is not one, a line that is not text, and a file that ends within a line.
"""

import re
from collections.abc import Callable, Iterator

import can

_NUMBER = r"\s*(?P<time>\d+[.,]\d+)\s+"
_CLASSIC = re.compile(
    _NUMBER + r"(?P<channel>\d+)\s+(?P<id>[0-9a-f]+)(?P<extended>x?)\s+(?P<way>Rx|Tx)\s+(?P<kind>[dr])\b(?P<rest>.*)$",
    re.IGNORECASE,
)
_FD = re.compile(
    _NUMBER + r"CANFD\s+(?P<channel>\d+)\s+(?P<way>Rx|Tx)\s+(?P<id>[0-9a-f]+)(?P<extended>x?)\s+(?P<rest>.*)$",
    re.IGNORECASE,
)
_ERROR = re.compile(_NUMBER + r"(CANFD\s+)?(?P<channel>\d+)\s+((Rx|Tx)\s+)?ErrorFrame", re.IGNORECASE)
_EVENT = re.compile(_NUMBER)
_LIKE_A_FRAME = re.compile(_NUMBER + r"(CANFD\s+\d+\s|\d+\s+[0-9a-f]+x?\s)(?!.*TxRq)", re.IGNORECASE)
_HEADER = re.compile(r"\s*($|//|date\s|(no\s+)?internal\s+events|begin\s+trigger|end\s+trigger)", re.IGNORECASE)
_BASE = re.compile(r"\s*base\s+(?P<base>hex|dec)(\s+timestamps\s+(?P<stamps>absolute|relative))?", re.IGNORECASE)
_FD_REST = re.compile(
    r"((?P<name>[A-Za-z_]\w*)\s+)?(?P<brs>[01])\s+(?P<esi>[01])\s+(?P<dlc>[0-9a-f]+)\s+(?P<length>\d+)(?P<data>.*)$",
    re.IGNORECASE,
)
BEGIN, END = "begin trigger", "end trigger"  # "Begin Triggerblock", "End TriggerBlock"
_FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)


class AscReader:
    """Frames of the lines that `next_line` gives, the empty string at the end; times from the beginning of the file, s.

    Raises ValueError, with a readable message, for a line that looks like a frame but is not one.
    """

    def __init__(self, next_line: Callable[[], str]) -> None:
        self.passed_over = 0  # lines that are neither a frame nor of the header
        self._next_line = next_line
        self._base = 16
        self._is_relative = False
        self._time_s = 0.0

    def __iter__(self) -> Iterator[can.Message]:
        while line := self._next_line():
            if found := _BASE.match(line):
                self._base = 10 if found["base"].lower() == "dec" else 16
                self._is_relative = (found["stamps"] or "").lower() == "relative"
            elif found := _FD.match(line):
                yield self._fd(found)
            elif found := _CLASSIC.match(line):
                yield self._classic(found)
            elif found := _ERROR.match(line):
                channel = int(found["channel"]) - 1
                yield can.Message(timestamp=self._stamp(found), channel=channel, is_error_frame=True)
            elif _LIKE_A_FRAME.match(line):
                raise ValueError(f"{line.strip()[:48]!r} is not a frame")
            elif not _HEADER.match(line):
                self.passed_over += 1
                if found := _EVENT.match(line):
                    self._stamp(found)

    def _stamp(self, found: re.Match[str]) -> float:
        time_s = float(found["time"].replace(",", "."))
        self._time_s = self._time_s + time_s if self._is_relative else time_s
        return self._time_s

    def _classic(self, found: re.Match[str]) -> can.Message:
        length, *words = found["rest"].split() or ["0"]
        announced = _number(length, self._base)
        if found["kind"].lower() == "r":
            return self._message(found, is_remote_frame=True, dlc=min(announced, 8))
        if announced > 15:
            raise ValueError(f"{announced} data bytes are announced")
        return self._message(found, data=self._data(words, min(announced, 8)))

    def _fd(self, found: re.Match[str]) -> can.Message:
        rest = _FD_REST.match(found["rest"])
        if rest is None:
            raise ValueError(f"{found[0].strip()[:48]!r} is not a frame")
        length = int(rest["length"])
        if length not in _FD_LENGTHS:
            raise ValueError(f"{length} data bytes are announced")
        return self._message(
            found,
            is_fd=True,
            bitrate_switch=rest["brs"] == "1",
            error_state_indicator=rest["esi"] == "1",
            data=self._data(rest["data"].split(), length),
        )

    def _data(self, words: list[str], length: int) -> bytes:
        values: list[int] = []
        for word in words[:length]:
            try:
                values.append(_number(word, self._base))
            except ValueError:
                break
        if len(values) != length:
            raise ValueError(f"{len(values)} data bytes where {length} are announced")
        if max(values, default=0) > 255:
            raise ValueError(f"a data byte of {max(values)}")
        return bytes(values)

    def _message(self, found: re.Match[str], **more: object) -> can.Message:
        identifier = _number(found["id"], self._base)
        is_extended = bool(found["extended"])
        if identifier >= 1 << (29 if is_extended else 11):
            raise ValueError(f"{found['id']} is not an identifier")
        return can.Message(
            timestamp=self._stamp(found),
            channel=int(found["channel"]) - 1,
            arbitration_id=identifier,
            is_extended_id=is_extended,
            is_rx=found["way"].lower() == "rx",
            **more,  # type: ignore[arg-type]
        )


def _number(word: str, base: int) -> int:
    if not word.isalnum():
        raise ValueError(f"{word!r} is not a number")
    return int(word, base)
