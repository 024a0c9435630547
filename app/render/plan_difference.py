"""Two plans of one shot side by side: what it needs, and with nothing left out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from app.plan_rows import format_bytes
from app.render.plan import Plan, PlannedResource


class Pair(NamedTuple):
    """A size in both plans, 0 where a plan has no such thing."""

    name: str
    needed: int
    everything: int


def program_lines(plan: Plan, everything: Plan) -> list[Pair]:
    """Return the lines of each program."""
    return _pairs(
        {program.name: program.lines for program in plan.programs},
        {program.name: program.lines for program in everything.programs},
    )


def resource_bytes(
    plan: tuple[PlannedResource, ...], everything: tuple[PlannedResource, ...]
) -> list[Pair]:
    """Return the bytes of each attachment, table or buffer."""
    return _pairs(
        {part.label: part.bytes for part in plan}, {part.label: part.bytes for part in everything}
    )


def _pairs(needed: dict[str, int], everything: dict[str, int]) -> list[Pair]:
    names = list(dict.fromkeys([*everything, *needed]))
    return [Pair(name, needed.get(name, 0), everything.get(name, 0)) for name in names]


def _total(pairs: list[Pair]) -> Pair:
    return Pair("all", sum(p.needed for p in pairs), sum(p.everything for p in pairs))


def difference_text(plan: Plan, everything: Plan) -> str:
    """Return both plans' sizes in plain text: needed, everything, saved."""
    lines = [
        f"{plan.title} ({plan.technique})",
        "",
        f"{'':<24} {'needed':>10} {'everything':>12} {'left out':>12}",
    ]
    lines += _section("Programs, lines", program_lines(plan, everything))
    characters = Pair(
        "all, characters",
        sum(program.characters for program in plan.programs),
        sum(program.characters for program in everything.programs),
    )
    lines.append(_row(characters, str))
    total = []
    for title, needed, full in (
        ("Attachments", plan.attachments, everything.attachments),
        ("Tables", plan.tables, everything.tables),
        ("Buffers", plan.buffers, everything.buffers),
    ):
        pairs = resource_bytes(needed, full)
        total += pairs
        if pairs:
            lines += _section(title, pairs, in_bytes=True)
    lines += ["", _row(_total(total)._replace(name="Allocated"), format_bytes, indent=0)]
    return "\n".join(lines) + "\n"


def _section(title: str, pairs: list[Pair], in_bytes: bool = False) -> Iterator[str]:
    form: Callable[[int], str] = format_bytes if in_bytes else str
    yield ""
    yield title
    for pair in pairs:
        yield _row(pair, form)
    yield _row(_total(pairs), form)


def _row(pair: Pair, form: Callable[[int], str], indent: int = 2) -> str:
    saved = pair.everything - pair.needed
    left = "-" if not saved else f"{form(saved)}"
    share = f" {100.0 * saved / pair.everything:4.0f} %" if pair.everything and saved else ""
    needed = form(pair.needed) if pair.needed else "-"
    name = " " * indent + pair.name
    return f"{name:<24} {needed:>10} {form(pair.everything):>12} {left:>12}{share}"
