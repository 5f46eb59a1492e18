"""How well the guard identifies a collision: the link, the class, and the direction and size of the force."""

from typing import Any

import numpy as np

from tauperp.kernel import layout
from tauperp.kernel.bench import Rows
from tauperp.wire_values import ContactClass

TRUTH = {"pulse": "COLLISION", "contact": "COLLISION", "touch": "TOUCH", "clamp": "CLAMPING"}


def contact_summary(rows: Rows) -> dict[str, Any]:
    """Confusion matrices of links and classes of collisions that stopped the arm, and errors of the force."""
    links = sorted({int(link) for link in rows["link"]} | {int(link) for link in rows["contact_link"]} - {0})
    told = rows["contact_link"] != 0
    right = told & (rows["contact_link"] == rows["link"])
    near = told & (np.abs(rows["contact_link"].astype(int) - rows["link"].astype(int)) <= 1)
    pushed = rows[right & (rows["push"] != layout.CONTACT)]
    size = np.linalg.norm(pushed["contact_force"], axis=1)
    along = np.einsum("ij,ij->i", pushed["contact_force"], pushed["true_force"]) / np.maximum(size, 1e-9)
    angle = np.degrees(np.arccos(np.clip(along, -1.0, 1.0)))
    return {
        "of": len(rows),
        "told": int(told.sum()),
        "right": int(right.sum()),
        "right_or_next_to_it": int(near.sum()),
        "links": links,
        "link_told": [
            [int(((rows["link"] == link) & (rows["contact_link"] == other)).sum()) for other in (0, *links)]
            for link in links
        ],
        "classes": [one.name for one in ContactClass],
        "class_told": {
            kind: [int(((rows["push"] == number) & (rows["contact_class"] == one)).sum()) for one in ContactClass]
            for kind, number in layout.PUSHES.items()
            if (rows["push"] == number).any()
        },
        "direction_error_deg_p50": None if len(angle) == 0 else round(float(np.median(angle)), 1),
        "force_over_true_p50": _ratio(pushed, size),
    }


def _ratio(pushed: Rows, size: Any) -> float | None:
    """Median ratio of the estimated force to the true one: means over the time in which the guard locates it."""
    true = pushed["mean_force_after_stop_n"]
    known = true > 0
    return None if not known.any() else round(float(np.median(size[known] / true[known])), 2)


def contact_line(one: dict[str, Any]) -> str:
    """For a terminal."""
    if one["of"] == 0:
        return "no contact was judged"
    return (
        f"link identified in {one['told']} of {one['of']}: {one['right']} right, {one['right_or_next_to_it']} right or "
        "the next; class right in "
        + ", ".join(_class_share(kind, counts) for kind, counts in one["class_told"].items())
    )


def _class_share(kind: str, counts: list[int]) -> str:
    return f"{counts[ContactClass[TRUTH[kind]]]} of {sum(counts)} ({kind})"


def link_rows(one: dict[str, Any]) -> list[list[str]]:
    """The confusion matrix of the links: a row for each link that was hit."""
    return [[f"link {link}", *map(str, counts)] for link, counts in zip(one["links"], one["link_told"], strict=True)]


def class_rows(one: dict[str, Any]) -> list[list[str]]:
    """The confusion matrix of the classes: a row for each kind of push."""
    return [[f"{kind} ({TRUTH[kind].lower()})", *map(str, counts)] for kind, counts in one["class_told"].items()]
