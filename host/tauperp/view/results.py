"""Files of a run in its folder: NAME.json, NAME.png and, on request, NAME.html."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from tauperp.experiment import Outcome
from tauperp.files import write_atomically
from tauperp.sim.moment import Watch

if TYPE_CHECKING:
    from tauperp.view.film import Camera


def add_result_arguments(parser: argparse.ArgumentParser, command: str) -> None:
    parser.add_argument(
        "--out", default=f"out/{command}", metavar="DIR", help=f"folder for the results (out/{command})"
    )
    parser.add_argument(
        "--report", action="store_true", help="also write NAME.html: one page with figures, tables and a film"
    )


class Results:
    """Results of one run. `watch` must receive every cycle, if it is needed."""

    def __init__(self, args: argparse.Namespace) -> None:
        self._folder = Path(args.out)
        self._camera: Camera | None = None
        if args.report:
            from tauperp.view import film  # imports the drawing library only on request

            film.choose_driver()
            self._camera = film.Camera()

    @property
    def watch(self) -> Watch | None:
        return None if self._camera is None else self._camera.watch

    def write(self, outcome: Outcome, name: str) -> str:
        """Write all files with this name. Returns their names as text."""
        from tauperp.view.experiment_figure import run_figure  # matplotlib is slow to import: only if needed

        write_atomically(self._folder / f"{name}.json", json.dumps(outcome.report, indent=2) + "\n")
        write_atomically(self._folder / f"{name}.png", run_figure(outcome))
        kinds = "json,png"
        if self._camera is not None:
            from tauperp.view.run_page import run_page

            write_atomically(self._folder / f"{name}.html", run_page(outcome, self._camera))
            kinds += ",html"
        return f"{self._folder / name}.{{{kinds}}}"
