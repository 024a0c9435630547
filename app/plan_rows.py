"""Rows of a plan, as ``ltc-viewer explain`` prints them and the window's panel shows them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PlanRow:
    """One thing that the renderer makes or does for a scene, or does without.

    Attributes
    ----------
    name : str
    figure : str
        Its size: bytes, or lines of a program; empty where it has none.
    why : str
        What in the scene asks for it, or spares it.
    form : str
        What it is made of: a format, the files of a program.
    more : tuple of str
        Further lines for those who want to know everything.
    """

    name: str
    figure: str
    why: str
    form: str = ""
    more: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PlanSection:
    """Rows under one title."""

    title: str
    rows: tuple[PlanRow, ...]


def format_bytes(count: int) -> str:
    """Return a number of bytes in B, KB (1024 B) or MB."""
    if count < 10_000:
        return f"{count} B"
    if count < 10_000_000:
        return f"{count / 1024:.1f} KB"
    return f"{count / 1024**2:.1f} MB"


def share_text(share: float) -> str:
    """Return a share as people write it: 1/1024, or a decimal number."""
    parts = round(1.0 / share) if share else 0
    return f"1/{parts}" if parts > 1 and abs(share * parts - 1.0) < 1e-9 else f"{share:g}"


def section_lines(section: PlanSection) -> list[str]:
    """Return a section in plain text, a few columns wide."""
    lines = [section.title]
    wide = max((len(row.name) for row in section.rows), default=0)
    for row in section.rows:
        size = f"{row.figure:>10}  " if row.figure else ""
        text = ": ".join(part for part in (row.form, row.why) if part)
        lines.append(f"  {row.name:<{wide}}  {size}{text}".rstrip())
        lines += [f"  {'':<{wide}}  {'':>10}  {more}" for more in row.more]
    return lines if section.rows else [*lines, "  nothing"]
