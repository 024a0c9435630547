"""The frame of HTML pages that load nothing from elsewhere, with tables that can be sorted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

STYLE = """
:root { color-scheme: light dark; }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 1200px;
  padding: 0 1rem; background: #fff; color: #1b1f24; }
h2 { margin-top: 3rem; border-top: 1px solid #8886; padding-top: 1rem; }
svg { max-width: 100%; height: auto; }
.side { display: flex; flex-wrap: wrap; gap: 1rem; }
figure { margin: 0; }
figcaption { font-size: 13px; }
figure img { display: block; image-rendering: pixelated; max-width: 100%; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .6rem; text-align: right; border-bottom: 1px solid #8884;
  white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
table.sortable th { cursor: pointer; white-space: normal; vertical-align: bottom; }
th[aria-sort=ascending]::after { content: " \\2191"; }
th[aria-sort=descending]::after { content: " \\2193"; }
tr.front td:first-child { font-weight: bold; }
@media (prefers-color-scheme: dark) { body { background: #14171a; color: #e4e7ea; } }
"""

SCRIPT = """
for (const head of document.querySelectorAll("table.sortable th"))
  head.onclick = () => {
    const table = head.closest("table"), body = table.tBodies[0], column = head.cellIndex;
    const up = head.getAttribute("aria-sort") !== "ascending";
    for (const other of head.parentNode.cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    const key = row => row.cells[column].dataset.value ?? row.cells[column].textContent;
    const text = (a, b) => key(a).localeCompare(key(b), "en");
    const order = (a, b) => isNaN(key(a) - key(b)) ? text(a, b) : key(a) - key(b);
    body.append(...[...body.rows].sort((a, b) => up ? order(a, b) : order(b, a)));
  };
"""


def html_page(title: str, body: Sequence[str]) -> str:
    """Return a whole page of HTML pieces under a plain title."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(body)
        + f"\n<script>{SCRIPT}</script>\n</body>\n</html>\n"
    )


def facts_table(facts: Mapping[str, str]) -> str:
    """Return names and values as a table to unfold."""
    lines = "".join(
        f'<tr><td>{escape(name)}</td><td style="text-align:left;white-space:normal">'
        f"{escape(value)}</td></tr>"
        for name, value in facts.items()
    )
    summary = "<summary>Machine, versions and settings</summary>"
    return f"<details>{summary}<table>{lines}</table></details>"


def sortable_table(heads: Sequence[str], lines: Sequence[str]) -> str:
    """Return a table from plain headings and lines that are ``tr`` elements.

    A cell sorts by its ``data-value``, else by its text; numbers as numbers.
    """
    cells = "".join(f'<th scope="col">{escape(head)}</th>' for head in heads)
    return (
        f'<div class="wide"><table class="sortable"><thead><tr>{cells}</tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )
