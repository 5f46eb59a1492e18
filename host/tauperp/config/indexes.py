"""The indexes: one row each, from the name in TOML to the firmware's number and what it explains."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

Component = Literal["fx", "fy", "fz", "mx", "my", "mz"]
COMPONENTS: dict[Component, int] = {"fx": 0, "fy": 1, "fz": 2, "mx": 3, "my": 4, "mz": 5}  # bits of index_config_t


@dataclass(frozen=True)
class Index:
    """What an index is.

    kind        number in the firmware: index_kind_t
    directions  of torque that it explains at most (columns of eqs. 7 and 20); None: the components that a task names
    components  of the wrench that it explains in every task
    """

    kind: int
    directions: int | None
    components: tuple[Component, ...] = ()


INDEXES = {
    "off": Index(0, 0),
    "r": Index(1, 0),
    "d_p": Index(2, 5),
    "d_r": Index(4, 5),
    "d_e": Index(3, 6, tuple(COMPONENTS)),
    "d_f": Index(3, None),
}
if TYPE_CHECKING:
    IndexName = str
else:
    IndexName = Literal[tuple(INDEXES)]


def components_of(index: str, named: list[Component]) -> tuple[Component, ...]:
    """The wrench components that a task with this index explains; `named` are those of the task."""
    row = INDEXES[index]
    return tuple(named) if row.directions is None else row.components


def explained_directions(index: str, named: list[Component]) -> int:
    """Number of directions of torque that the task explains at most."""
    directions = INDEXES[index].directions
    return len(set(named)) if directions is None else directions


def is_blind(index: str, joints: int, named: list[Component] | None = None) -> bool:
    """True if the task explains every direction of an arm with this many joints."""
    return 0 < joints <= explained_directions(index, named or [])
