"""The stack figure of `make bench`: gcc's call graphs added up, and what is refused because it has no bound."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "bench"))

from library_stack import bound, read_functions, taken  # noqa: E402
from stack import CallGraph, worst_stack  # noqa: E402


def nothing(name: str) -> int:
    raise ValueError(f"{name} was not expected")


def compiled(folder: Path, source: str) -> Path:
    """A folder with the call graph of a C file."""
    (folder / "a.c").write_text(source)
    options = ["-O1", "-fno-inline", "-fno-ipa-pure-const", "-fstack-usage", "-fcallgraph-info=su", "-c"]
    subprocess.run(["gcc", *options, "a.c", "-o", "a.o"], cwd=folder, check=True)
    return folder


def frames(folder: Path) -> dict[str, int]:
    graph = CallGraph(nothing)
    graph.read(folder / "a.ci")
    return graph.frames


KEEP = "void keep(volatile char *p);"


def test_the_worst_path_is_the_sum_of_its_frames_and_not_of_all(tmp_path: Path) -> None:
    source = """
        void deep(void)    { volatile char a[300]; a[0] = 1; }
        void shallow(void) { volatile char a[20]; a[0] = 1; }
        void middle(void)  { volatile char a[50]; a[0] = 1; deep(); a[1] = 2; }
        void root(void)    { volatile char a[10]; a[0] = 1; shallow(); middle(); a[1] = 2; }
    """
    of = frames(compiled(tmp_path, source))
    assert of["deep"] >= 180  # minus the bytes in the red zone
    assert worst_stack(tmp_path, ("root",), nothing) == of["root"] + of["middle"] + of["deep"]
    assert worst_stack(tmp_path, ("shallow", "deep"), nothing) == of["deep"]


def test_recursion_is_refused(tmp_path: Path) -> None:
    source = "int b(int); int a(int n) { return n ? b(n - 1) + 1 : 0; } int b(int n) { return n ? a(n - 1) * 3 : 1; }"
    with pytest.raises(ValueError, match="recursion: a -> b -> a"):
        worst_stack(compiled(tmp_path, source), ("a",), nothing)


def test_a_frame_without_bound_is_refused(tmp_path: Path) -> None:
    source = f"{KEEP} void keep(volatile char *p) {{ *p = 1; }} void root(int n) {{ volatile char a[n]; keep(a); }}"
    with pytest.raises(ValueError, match="root: its frame has no bound"):
        worst_stack(compiled(tmp_path, source), ("root",), nothing)


def test_a_call_through_a_pointer_is_refused(tmp_path: Path) -> None:
    source = "void root(void (*f)(void)) { f(); f(); }"
    with pytest.raises(ValueError, match="root calls through a pointer"):
        worst_stack(compiled(tmp_path, source), ("root",), nothing)


def test_a_function_without_a_graph_counts_with_its_given_bound(tmp_path: Path) -> None:
    source = "int helper(int); int root(int n) { return helper(n) + 1; }"
    folder = compiled(tmp_path, source)
    assert worst_stack(folder, ("root",), {"helper": 1000}.__getitem__) == frames(folder)["root"] + 1000


def test_a_root_without_a_graph_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no call graph of guard_tick"):
        worst_stack(compiled(tmp_path, "void root(void) {}"), ("root", "guard_tick"), nothing)
    with pytest.raises(ValueError, match="no call graphs"):
        worst_stack(tmp_path / "nowhere", ("root",), nothing)


@pytest.mark.parametrize(
    ("instruction", "size"),
    [
        ("push {r4, r5, lr}", 12),
        ("push {r4-r7, fp, lr}", 24),
        ("stmdb sp!, {r4, r5, r6, r7, r8, lr}", 24),
        ("vpush {d8-d15}", 64),
        ("vpush {s16-s17}", 8),
        ("sub sp, #56", 56),
        ("sub.w sp, sp, #1024", 1024),
        ("str.w lr, [sp, #-8]!", 8),
        ("strd r4, r5, [sp, #-16]!", 16),
        ("pop {r4, r5, pc}", 0),
        ("add sp, #56", 0),
        ("ldr.w pc, [sp], #8", 0),
        ("str r0, [sp, #4]", 0),
        ("subs r0, r0, #4", 0),
    ],
)
def test_each_instruction_subtracts_its_bytes_from_the_stack_pointer(instruction: str, size: int) -> None:
    mnemonic, _, operands = instruction.partition(" ")
    assert taken(mnemonic, operands) == size


@pytest.mark.parametrize("instruction", ["mov sp, r7", "sub sp, sp, r3", "bic sp, sp, #7"])
def test_a_stack_pointer_that_is_computed_is_refused(instruction: str) -> None:
    mnemonic, _, operands = instruction.partition(" ")
    with pytest.raises(ValueError, match="is not known"):
        taken(mnemonic, operands)


DISASSEMBLY = """
00008000 <outer>:
    8000:	push	{r4, lr}
    8002:	bl	8010 <inner>
    8006:	pop	{r4, pc}

00008010 <inner>:
    8010:	sub	sp, #8
    8012:	beq.n	8010 <inner>

00008014 <behind>:
    8014:	push	{r3, r4, r5, lr}
    8016:	bx	lr
    8018:	nop

0000801c <odd>:
    801c:	mov	sp, r7
    801e:	bx	lr
"""


def test_a_helpers_bound_includes_its_calls_and_the_function_that_it_falls_into() -> None:
    functions = read_functions(DISASSEMBLY, "00008014 T also_behind\n")
    assert bound(functions, "outer") == 8 + 8 + 16
    assert bound(functions, "also_behind") == bound(functions, "behind") == 16
    assert bound(functions, "not_linked") == 0
    with pytest.raises(ValueError, match="odd"):
        bound(functions, "odd")
