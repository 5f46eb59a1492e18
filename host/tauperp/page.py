"""Self-contained HTML pages: one file with its figures inside, readable without a network, printable."""

import base64
import html
from collections.abc import Sequence

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;color:#22272e;max-width:1120px;margin:2em auto;padding:0 1.2em}
h1{font-size:1.5em;margin-bottom:.2em}h2{font-size:1.15em;margin-top:2em}
p.note{color:#5a6572}table{border-collapse:collapse;margin:.6em 0}
td,th{padding:.25em .8em;text-align:right;border-bottom:1px solid #e6eaee}
th{color:#5a6572;font-weight:600}td:first-child,th:first-child{text-align:left}
img{max-width:100%;height:auto}code{background:#f5f7f9;padding:.1em .3em}
@media print{body{margin:0}}
"""


def table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """An HTML table; cells are escaped."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in header)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def figure(png: bytes, text: str) -> str:
    """A PNG inside the page."""
    data = base64.b64encode(png).decode()
    return f'<p><img alt="{html.escape(text)}" src="data:image/png;base64,{data}"></p>'


def heading(text: str) -> str:
    return f"<h2>{html.escape(text)}</h2>"


def note(text: str) -> str:
    return f'<p class="note">{html.escape(text)}</p>'


def page(title: str, parts: Sequence[str]) -> str:
    """The whole page."""
    name = html.escape(title)
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{name}</title><style>{_STYLE}</style>'
        f"</head><body><h1>{name}</h1>{''.join(parts)}</body></html>\n"
    )
