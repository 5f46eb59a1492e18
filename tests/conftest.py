"""The test runner: what a test needs, the order of the tests, and the seed of random tests.

Markers:
    quick    no privileges, no network, no emulator; all of them together take less than a minute (`make quick`)
    slow     not quick, only because it takes long
    bus      needs vcan0; runs inside tools/vcan (bus_session.py)
    target   runs the firmware on an emulated controller, or counts its instructions
    gate     judges the sources; a planted violation turns it red (tests/gates/test_planted.py)
    needs    tools by their names in tools/toolbox; skipped in one line where the machine cannot provide the tool
"""

import random
import signal
from collections.abc import Iterator
from typing import Any

import bus_groups
import checkout
import pytest
from xdist.scheduler import LoadScopeScheduling

pytest_plugins = ["unity_items", "bus_session"]

SEED = 4711
# Files whose tests simulate minutes, start clusters, install packages or wait for a real clock.
SLOW = (
    "test_build", "test_calibrate", "test_campaign", "test_docs", "test_experiment", "test_fault_injection",
    "test_front_door", "test_guard_faults", "test_guard_senders", "test_monitor", "test_planted",
    "test_public_arms", "test_real_arms", "test_record", "test_replay_compare", "test_replay_panda",
    "test_run_bus", "test_score", "test_sensitivity", "test_stop_cycles", "test_task_switching", "test_view",
    "test_wheel",
)  # fmt: skip
PLANTED = "tests/gates/test_planted.py"
# The longest tests start first, so that no worker still runs one at the end.
FIRST = ("tests/bus/", "tests/target/test_versal_lockstep.py", "tests/target/", "tests/gates/", "tests/unit/")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--seed", default=str(SEED), help="seed of random tests: a number, or `random` for a new one")


def pytest_configure(config: pytest.Config) -> None:
    # A shell starts its background jobs with SIGINT ignored, and children inherit that. Some tests press Ctrl-C.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if config.getoption("seed") == "random":
        config.option.seed = str(random.SystemRandom().randrange(2**31))


def pytest_report_header(config: pytest.Config) -> str:
    return f"seed {config.getoption('seed')}"


@pytest.fixture(scope="session")
def seed(request: pytest.FixtureRequest) -> int:
    """The seed of a random test: the same in every run, unless --seed sets another."""
    return int(request.config.getoption("seed"))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.nodeid.startswith("tests/target/"):
            item.add_marker("target")
        if item.path.stem in SLOW:
            item.add_marker("slow")
        if not any(item.get_closest_marker(name) for name in ("slow", "bus", "target")):
            item.add_marker("quick")
    items.sort(key=place)


def place(item: pytest.Item) -> tuple[int, str, bool]:
    """Position in the order: by folder, the groups of the bus together, in tests/host the slow files first."""
    folder = next((number for number, start in enumerate(FIRST) if item.nodeid.startswith(start)), len(FIRST))
    group = bus_groups.group_of(item.nodeid) if bus_groups.is_bus_test(item.nodeid) else ""
    return folder, group, item.get_closest_marker("slow") is None


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    reason = checkout.lacking(item)
    if reason:
        pytest.skip(reason)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Iterator[None]:
    """With CI=true a skipped test is a failure, unless its reason starts with "optional:"."""
    report = yield
    if report.skipped and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2].removeprefix("Skipped: ")
        if not checkout.ci_accepts(reason):
            report.outcome, report.longrepr = "failed", checkout.REFUSED.format(reason)
    return report


class Scheduling(LoadScopeScheduling):
    """Tests that share an expensive resource stay on one worker: the bus, a Unity program, the fixtures of a module."""

    def __init__(self, config: pytest.Config, log: Any) -> None:
        super().__init__(config, log)
        config.option.loadscopereorder = False  # in the order of the collection

    def _split_scope(self, nodeid: str) -> str:
        return scope_of(nodeid)


def scope_of(nodeid: str) -> str:
    file, _, test = nodeid.partition("::")
    if bus_groups.is_bus_test(nodeid):
        return bus_groups.group_of(nodeid)
    if file.startswith("tests/unit/"):
        return file + test[test.rfind("[") :]
    if test == "test_lint_types":
        return PLANTED  # whose copies take over the results of mypy
    if file.startswith("tests/host/") or file == PLANTED:
        return file
    return nodeid


@pytest.hookimpl(optionalhook=True)  # the inner run of the bus tests has no xdist
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    return Scheduling(config, log)
