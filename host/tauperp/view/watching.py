"""`--view` and `--rerun` of every command that moves a robot."""

import argparse
import contextlib
from collections.abc import Iterator

from tauperp.sim.moment import Moment, Watch


def add_watch_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--view", action="store_true", help="show the robot in MuJoCo's viewer, in real time")
    parser.add_argument(
        "--rerun", metavar="FILE", help="write torques, permission and pose to a rerun recording (.rrd)"
    )


@contextlib.contextmanager
def watching(args: argparse.Namespace, also: Watch | None = None) -> Iterator[Watch | None]:
    """The watches that the arguments request, and `also`, as one; None if there is none.

    Raises InputError for a missing display or extra, before anything has run.
    """
    with contextlib.ExitStack() as stack:
        watches: list[Watch] = [] if also is None else [also]
        if args.view:
            from tauperp.view.window import window

            watches.append(stack.enter_context(window()))
        if args.rerun is not None:
            from tauperp.view.rerun_log import rerun_log

            watches.append(stack.enter_context(rerun_log(args.rerun)))

        def each(moment: Moment) -> None:
            for watch in watches:
                watch(moment)

        yield each if watches else None
