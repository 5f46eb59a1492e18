"""How names of the wire and of the firmware are said to people: one spelling everywhere."""

import re


def spoken(name: str) -> str:
    """ "TickOverBudget" and "TICK_OVER_BUDGET" are "tick over budget"."""
    words = name if name.isupper() else re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return words.replace("_", " ").lower()
