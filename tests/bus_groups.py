"""The tests that need vcan0, and the groups that share one."""

LOCKSTEP = "tests/target/test_versal_lockstep.py"
# With the lockstep on the emulated Versal, these take about as long as the other files of tests/bus together.
SECOND_GROUP = ("tests/bus/test_identity.py", "tests/bus/test_run.py")


def is_bus_test(nodeid: str) -> bool:
    return nodeid.startswith(("tests/bus/", LOCKSTEP))


def group_of(nodeid: str) -> str:
    """The tests of a group run one after the other on one vcan0."""
    return "bus 2" if nodeid.startswith((LOCKSTEP, *SECOND_GROUP)) else "bus 1"
