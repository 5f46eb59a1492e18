"""Worst stack of a program from gcc's -fcallgraph-info=su files: the heaviest path through the call graph."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

_NODE = re.compile(r'node: \{ title: "([^"]+)" label: "([^"]*)"')
_EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')
_BYTES = re.compile(r"(\d+) bytes \((static|dynamic|dynamic,bounded)\)")


@dataclass
class CallGraph:
    """Functions by gcc's names (`file:function` where static) with their frames in bytes and the functions they call.

    `library` gives the bytes of a function without a graph by gcc: a helper of libgcc or newlib.
    """

    library: Callable[[str], int]
    frames: dict[str, int] = field(default_factory=dict)
    calls: dict[str, set[str]] = field(default_factory=dict)
    unbounded: list[str] = field(default_factory=list)
    known: dict[str, int] = field(default_factory=dict)

    def read(self, path: Path) -> None:
        text = path.read_text()
        for title, label in _NODE.findall(text):
            size = _BYTES.search(label)
            if size:
                self.frames[title] = max(int(size[1]), self.frames.get(title, 0))  # clones share a name
                if size[2] == "dynamic":
                    self.unbounded.append(title)
        for source, target in _EDGE.findall(text):
            self.calls.setdefault(source, set()).add(target)

    def worst(self, root: str, below: tuple[str, ...] = ()) -> int:
        """Bytes that a call of `root` needs at most. Raises ValueError for recursion and for a frame without bound."""
        if root in self.known:
            return self.known[root]
        if root in below:
            raise ValueError(f"recursion: {' -> '.join((*below, root))}")
        if root in self.unbounded:
            raise ValueError(f"{root}: its frame has no bound")
        if root not in self.frames:
            return self.library(root)
        callees = self.calls.get(root, set())
        if "__indirect_call" in callees:
            raise ValueError(f"{root} calls through a pointer")
        deepest = max((self.worst(callee, (*below, root)) for callee in callees), default=0)
        self.known[root] = self.frames[root] + deepest
        return self.known[root]


def worst_stack(folder: Path, roots: tuple[str, ...], library: Callable[[str], int], pattern: str = "**/*.ci") -> int:
    """The largest need of the roots, from every .ci file of `folder` that matches the pattern."""
    graph = CallGraph(library)
    files = sorted(folder.glob(pattern))
    if not files:
        raise ValueError(f"{folder}: no call graphs")
    for path in files:
        graph.read(path)
    missing = [root for root in roots if root not in graph.frames]
    if missing:
        raise ValueError(f"{folder}: no call graph of {', '.join(missing)}")
    return max(graph.worst(root) for root in roots)
