"""The text of a robot file: its encoding, its first element, and XML as the usual robot readers accept it.

The file is read once, as bytes, so that a pipe works like a file. The usual readers (tinyxml2) do not know name spaces,
and accept a comment that contains `--`. This one does, too.
"""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from xml.parsers import expat

from tauperp.errors import InputError

MAX_BYTES = 64 << 20  # a robot of a hundred links has less than one
_MARKS = ((b"\xef\xbb\xbf", "utf-8"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))
_DECLARED = re.compile(rb"""^\s*<\?xml[^>]*?\sencoding\s*=\s*["']([A-Za-z0-9._:-]+)["']""")
_DECLARATION = re.compile(r"^\s*<\?xml.*?\?>", re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_FIRST = re.compile(r"<([A-Za-z_][\w:.-]*)")


def read_bytes(path: Path) -> bytes:
    """The file's content. Raises InputError if it cannot be read or is too large for a robot."""
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    if len(data) > MAX_BYTES:
        raise InputError(f"{path}: larger than {MAX_BYTES >> 20} MB: no robot file")
    return data


def text_of(data: bytes, path: Path) -> str:
    """The characters, by byte order mark, by the XML declaration, or as UTF-8. Without the mark and the declaration.

    Raises InputError for an encoding that is unknown or that the bytes are not in.
    """
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), None)
    declared = _DECLARED.match(data)
    if encoding is None:
        encoding = declared.group(1).decode("ascii") if declared else "utf-8"
    try:
        text = data.decode(encoding)
    except LookupError:
        raise InputError(f"{path}: encoding '{encoding}' is not known: save the file in UTF-8") from None
    except ValueError:
        raise InputError(f"{path}: not a text file in {encoding}: save it in UTF-8") from None
    return _DECLARATION.sub(_blank, text.removeprefix("\ufeff"))


def first_element(text: str, path: Path) -> str:
    """The name of the outermost element. Raises InputError if there is no element."""
    found = _FIRST.search(_COMMENT.sub(_blank, text))
    if found is None:
        raise InputError(f"{path}: not well-formed XML (no element found)")
    return found.group(1)


def parse(text: str, path: Path) -> ElementTree.Element:
    """The elements with their names as written: a prefix is kept, and a default name space has no effect.

    Raises InputError, with line and column, for text that is not well-formed.
    """
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(_COMMENT.sub(_blank, text).encode("utf-8"), True)
        return builder.close()
    except (expat.ExpatError, UnicodeEncodeError, AssertionError) as error:
        raise InputError(f"{path}: not well-formed XML ({' '.join(str(error).split())})") from None


def _blank(match: re.Match[str]) -> str:
    """As many empty lines, so that the places in messages stay correct."""
    return "\n" * match.group().count("\n")
