#!/usr/bin/env python3
"""build: writes the Markdown sources of the documentation site.

    tools/docs/build.py OUTPUT

Copies docs/, writes the reference pages from the sources that they describe (pages.py), and copies the files outside
docs/ to which the pages link: Markdown files become pages under source/, others become text files that a browser shows.
Fails on a link to a file that does not exist.
"""

import re
import shutil
import sys
from pathlib import Path
from posixpath import normpath, relpath

import pages

from tauperp.files import repository_root, write_atomically

ROOT = repository_root()
DOCS = "docs"
LINK = re.compile(r"(!?\[[^\]]*\]\()(?!https?:|#|mailto:)([^)#\s]+)(#[^)\s]*)?(\))")
CODE = re.compile(r"(^```.*?^```$|^(?:    [^\n]*\n)+|`[^`\n]*`)", re.MULTILINE | re.DOTALL)
GENERATED = {
    f"{DOCS}/troubleshooting.md": pages.troubleshooting,
    f"{DOCS}/reference/settings.md": pages.settings,
    f"{DOCS}/reference/commands.md": pages.commands,
    f"{DOCS}/reference/wire.md": pages.wire,
    f"{DOCS}/reference/python.md": pages.python,
    f"{DOCS}/reference/c.md": pages.c,
}


def site_path(path: str) -> str:
    """Path of a file of the repository in the site's sources."""
    if path.startswith(f"{DOCS}/"):
        return path.removeprefix(f"{DOCS}/")
    return f"source/{path}" + ("" if Path(path).suffix in (".md", ".png", ".svg") else ".txt")


class Site:
    """The files of the site; `problems` has one line for each broken link."""

    def __init__(self) -> None:
        self.text: dict[str, str] = {}  # by path in the repository
        self.other: set[str] = set()
        self.problems: list[str] = []

    def add(self, path: str, text: str | None = None) -> None:
        """A page, and every file to which it links."""
        if path not in self.text:
            self.text[path] = ""
            self.text[path] = self._with_links((ROOT / path).read_text() if text is None else text, path)

    def _with_links(self, text: str, path: str) -> str:
        parts = CODE.split(text)
        return "".join(
            part if CODE.fullmatch(part) else LINK.sub(lambda link: self._link(link, path), part) for part in parts
        )

    def _link(self, link: re.Match[str], path: str) -> str:
        target = normpath(f"{Path(path).parent.as_posix()}/{link[2]}")
        if target == "README.md":
            target = f"{DOCS}/index.md"
        if (ROOT / target).is_dir():
            target = f"{target}/README.md"
        if target in GENERATED:
            pass
        elif not (ROOT / target).is_file():
            self.problems.append(f"{path}: {link[2]} does not exist")
            return link[0]
        elif target.endswith(".md"):
            self.add(target)
        else:
            self.other.add(target)
        return f"{link[1]}{relpath(site_path(target), Path(site_path(path)).parent.as_posix())}{link[3] or ''}{link[4]}"


def build() -> Site:
    """The whole site."""
    site = Site()
    for file in sorted((ROOT / DOCS).rglob("*.md")):
        site.add(file.relative_to(ROOT).as_posix())
    for path, page in GENERATED.items():
        site.add(path, page())
    for path in ("CONTRIBUTING.md", "CHANGELOG.md", "firmware/hosts/linux/README.md"):
        site.add(path)
    return site


def main(arguments: list[str]) -> int:
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    site = build()
    if site.problems:
        print("\n".join(site.problems), file=sys.stderr)
        return 1
    folder = Path(arguments[0])
    shutil.rmtree(folder, ignore_errors=True)
    for path, text in site.text.items():
        write_atomically(folder / site_path(path), text)
    for path in site.other:
        write_atomically(folder / site_path(path), (ROOT / path).read_bytes())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
