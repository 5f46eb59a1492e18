"""Spelling of the wire's and the firmware's names in messages, the same everywhere."""

import re


def spoken(name: str) -> str:
    """ "TickOverBudget" and "TICK_OVER_BUDGET" become "tick over budget"."""
    words = name if name.isupper() else re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return words.replace("_", " ").lower()
