"""What can be measured against each other: techniques, and random ones by samples.

An entry is written as a technique is, ``ltc``, ``uniform:30`` or ``ltc/table-8``. A technique
that samples takes no number of its own, and here its number is the samples of a pixel:
``reference:64`` is what 64 samples give, in the time that 64 take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.errors import InputError, quote
from app.render.pack import has_curves
from app.render.techniques import (
    AUTOMATIC,
    TECHNIQUES,
    VARIANTS,
    Technique,
    find_technique,
    parse_technique,
    suited_technique,
)
from app.scene import MAX_SAMPLES, PixelView, RenderSettings, Scene

NUMBERS = ("ltc", "ltc:2", "ltc:3", "ltc:5", "ltc:6", "ggx:1", "ggx:2", "ggx:3", "ggx:4")
CURVED = (
    "adaptive", "adaptive-extrapolated", "uniform:6", "uniform:18", "uniform:30", "uniform:96",
)  # fmt: skip
"""What differs from ``ltc`` only where outlines have curves, as ``ltc``'s own number does."""
TABLES = ("ltc/no-table", "ltc/table-4", "ltc/table-8", "ltc/table-32")
"""Of the isotropic table: what an anisotropic scene looks up has one size."""
PICTURES = ("ltc/foot-tap", "ltc/taps-1", "ltc/taps-3", "ltc/taps-9")
"""What differs from ``ltc`` only where lights have pictures."""
OTHERS = (
    "ltc/undivided", "ltc/published-clip",
    "representative-point",
    "ltc+residual:1", "ltc+residual:4", "ltc+residual:16", "ltc+residual:64",
    "reference:1", "reference:4", "reference:16", "reference:64", "reference:256",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Entry:
    """A technique in canonical form and the samples of a pixel, 1 unless it samples."""

    technique: str
    samples: int = 1

    @property
    def known(self) -> Technique:
        """What the renderer knows of it."""
        return find_technique(self.technique)

    @property
    def name(self) -> str:
        """The technique's bare name."""
        return parse_technique(self.technique).name

    @property
    def number(self) -> int:
        """The number of its technique, or of samples; 0 where there is neither."""
        return (
            self.samples if self.known.is_sampled else parse_technique(self.technique).number or 0
        )

    @property
    def looks_up(self) -> bool:
        """Whether what it converges to is the fitted lobe of tables."""
        return self.known.has_tables and not self.known.is_sampled

    @property
    def variant(self) -> str:
        """The variant of its technique, empty for none."""
        return parse_technique(self.technique).variant

    def place(self) -> tuple[int, int, int]:
        """Return where it stands among others: in the order of help, then of numbers."""
        variant = [*VARIANTS].index(self.variant) if self.variant else -1
        return [*TECHNIQUES].index(self.name), variant, self.number

    def settings(self, samples: int | None = None, view: PixelView = "radiance") -> RenderSettings:
        """Return settings that render it, with other samples if those are given."""
        return RenderSettings(self.technique, samples or self.samples, view)

    def __str__(self) -> str:
        return f"{self.technique}:{self.samples}" if self.known.is_sampled else self.technique


def parse_entry(text: str) -> Entry:
    """Return the entry that a text such as ``ltc``, ``uniform:30`` or ``reference:64`` names.

    Raises
    ------
    InputError
        If there is no technique of this name, or its number is wrong.
    """
    name, colon, number = text.partition(":")
    if name not in TECHNIQUES or not TECHNIQUES[name].is_sampled:
        return Entry(str(parse_technique(text)))
    if not colon:
        return Entry(name)
    whole = number.isascii() and number.isdigit() and len(number) <= 9
    if not whole or not 1 <= int(number) <= MAX_SAMPLES:
        raise InputError(
            f"technique '{name}': the number of samples is {quote(number)}, expected a whole "
            f"number from 1 to {MAX_SAMPLES}"
        )
    return Entry(name, int(number))


def entries_of(scene: Scene, wanted: Sequence[str] = ()) -> tuple[Entry, ...]:
    """Return what to compare in a scene, each once: ``wanted``, or all that makes a difference,
    in the order of `Entry.place`.

    Raises
    ------
    InputError
        As `parse_entry`.
    """
    used = scene.object_materials()
    anisotropic = any(m.is_anisotropic and any(m.f0) for m in used)
    curved = has_curves(scene.lights)
    pictures = any(light.picture is not None and any(light.radiance) for light in scene.lights)
    names = wanted or (
        *NUMBERS,
        *CURVED,
        *(() if anisotropic else TABLES),
        *(PICTURES if pictures else ()),
        *OTHERS,
    )
    found = []
    for name in names:
        resolved = suited_technique(name, anisotropic) if name == AUTOMATIC else name
        entry = parse_entry(resolved)
        # Without curves these are the very programs of "ltc".
        choice = parse_technique(entry.technique)
        alike = not curved and entry.looks_up and not wanted
        found.append(Entry(str(choice.without_curves)) if alike else entry)
    return tuple(sorted(dict.fromkeys(found), key=Entry.place))
