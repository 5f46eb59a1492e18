"""Letters, bars and columns of the live view."""

from collections.abc import Sequence
from itertools import zip_longest

from rich.text import Text

STALE = "bright_black"
HEADING = "bold cyan"
ALARM = "bold red"
COLUMN_GAP = 2

_GLYPHS = {
    "M": ("█▄ ▄█", "█ ▀ █", "▀   ▀"),
    "O": ("█▀▀█", "█  █", "▀▀▀▀"),
    "V": ("█  █", "▀▄▄▀", " ▀▀ "),
    "E": ("█▀▀▀", "█▀▀ ", "▀▀▀▀"),
    "S": ("█▀▀▀", "▀▀▀█", "▀▀▀▀"),
    "T": ("▀▀█▀▀", "  █  ", "  ▀  "),
    "P": ("█▀▀█", "█▀▀▀", "▀   "),
}
_EIGHTHS = " ▏▎▍▌▋▊▉"
MARK = "│"
BEYOND = "▶"


def big_word(word: str) -> tuple[str, str, str]:
    """A word in letters of three rows."""
    first, second, third = ("  ".join(rows) for rows in zip(*(_GLYPHS[letter] for letter in word), strict=True))
    return first, second, third


def bar(share: float, width: int, mark: int, style: str) -> Text:
    """A bar of `width` columns that reaches the mark, in column `mark`, at share 1; beyond the end it is marked."""
    filled = max(0.0, share) * mark
    full = min(int(filled), width)
    cells = ["█"] * full
    if full < width:
        cells.append(_EIGHTHS[int(8 * (filled - full))])
    else:
        cells[-1] = BEYOND
    cells += [" "] * (width - len(cells))
    text = Text("".join(cells[:width]), style)
    if full <= mark:
        text = Text.assemble(text[:mark], (MARK, STALE), text[mark + 1 :])
    return text


def dotted(*parts: Text | str) -> Text:
    """The parts that are not empty, with a quiet dot between them."""
    shown = [part if isinstance(part, Text) else Text(part) for part in parts if len(part)]
    return Text(" · ", STALE).join(shown)


def beside(first: Sequence[Text], *others: Sequence[Text], width: int) -> list[Text]:
    """Blocks of lines side by side: the others at the right edge, each as wide as its widest line."""
    left = room_beside(*others, width=width)
    rows = []
    for line, *rest in zip_longest(first, *others, fillvalue=Text()):
        row = line.copy()
        row.truncate(left, overflow="ellipsis", pad=True)
        for cell, block in zip(rest, others, strict=True):
            row.append(" " * COLUMN_GAP).append_text(cell).append(" " * (_width(block) - len(cell)))
        rows.append(row)
    return rows


def room_beside(*others: Sequence[Text], width: int) -> int:
    """Remaining columns for the first block."""
    return max(0, width - sum(_width(block) + COLUMN_GAP for block in others))


def _width(block: Sequence[Text]) -> int:
    return max((len(line) for line in block), default=0)


def fit(line: Text, width: int) -> Text:
    """Not wider than the terminal."""
    line.truncate(width, overflow="ellipsis")
    return line
