"""docs/guide.md: its code runs, and shows what the text states."""

import re
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from tauperp.files import repository_root

GUIDE = repository_root() / "docs" / "guide.md"


def test_the_guide_runs_and_shows_what_it_says(tmp_path: Path) -> None:
    matplotlib.use("Agg")
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", GUIDE.read_text(), re.DOTALL):
        exec(compile(block, str(GUIDE), "exec"), names)
    time_s, hit = names["time_s"], names["hit"]
    residual, index = (np.abs(values).max(axis=1) for values in (names["step"].residual, names["step"].index))
    carried = (time_s > 2.5) & (time_s < 5.0)
    assert residual[carried].max() > 5.0  # r follows the payload
    assert index[time_s < 5.0].max() < 0.5  # d_p does not
    assert index[hit].max() > 2.0  # but detects the collision
    names["figure"].savefig(tmp_path / "guide.png", dpi=110)
