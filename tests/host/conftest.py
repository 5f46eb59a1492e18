"""Fixtures that several files of tests share."""

from collections.abc import Callable
from pathlib import Path

import pytest
from bus_logs import scenario

from tauperp.cli import main


@pytest.fixture(scope="session")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario of one collision, run once in each frame format and recorded as candump does."""
    folder = tmp_path_factory.mktemp("logs")
    for form in ("fd", "classic"):
        assert main(["run", str(scenario(folder, form)), "--record", str(folder / f"{form}.log"), "--json"]) == 0
    return folder


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    """write(text) makes a file with this text; the text decides between URDF and MJCF."""

    def writer(text: str) -> Path:
        path = tmp_path / ("robot.urdf" if "<robot" in text else "robot.xml")
        path.write_text(text)
        return path

    return writer
