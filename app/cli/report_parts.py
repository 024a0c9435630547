"""What a report has measured, in files: a run that was interrupted goes on with what is there.

A part says what it was measured with, its origin; where that is not what is asked for now, it
counts for nothing and is measured again.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from app.cli.report_pictures import Pictures
from app.files import replace_file
from app.measure.errors import SurfacePoints, Truth

PART_FORMAT = "ltc-report-part/2"
KIND = "a part of a report"
POINT_FIELDS = ("position", "normal", "tangent", "view", "alpha")

Row = dict[str, Any]
"""One measured scene and technique: what a line of ``results.csv`` holds, by column."""

Origin = Mapping[str, Any]
Part = tuple[Row, Pictures]


def part_path(folder: Path, scene: str, what: str, suffix: str) -> Path:
    """Return where the part of a scene lies: ``what`` is a technique, or the truth."""
    safe = what.replace(":", "-").replace("/", "--")
    return folder / f"{scene}--{safe}{suffix}"


def read_part(path: Path, origin: Origin) -> Part | None:
    """Return what an earlier run measured, or None if there is nothing that can be used."""
    try:
        part = json.loads(path.read_text(encoding="utf-8"))
        if part["format"] != PART_FORMAT or part["origin"] != origin:
            return None
        return part["figures"], Pictures(part["picture"], part["difference"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def write_part(path: Path, origin: Origin, figures: Row, pictures: Pictures) -> Part:
    """Write a part, and return it as it will be read: so a resumed report has the same figures."""
    part = {"format": PART_FORMAT, "origin": origin, "figures": figures, **asdict(pictures)}
    text = json.dumps(part, indent=1, allow_nan=False) + "\n"
    replace_file(path, text.encode("utf-8"), KIND)
    return json.loads(text)["figures"], pictures


def read_truth(path: Path, origin: Origin) -> tuple[SurfacePoints, Truth] | None:
    """Return a truth and its points from an earlier run, or None as `read_part`."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            said = json.loads(str(arrays["origin"]))
            if said != {"format": PART_FORMAT, **origin}:
                return None
            position, normal, tangent, view, alpha = (arrays[name] for name in POINT_FIELDS)
            points = SurfacePoints(
                position, normal, tangent, view, alpha, bool(arrays["anisotropic"])
            )
            uncertainty = float(arrays["uncertainty"])
            values = arrays["specular"], arrays["diffuse"]
            return points, Truth(*values, uncertainty, bool(arrays["sampled"]))
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile):
        return None


def write_truth(path: Path, origin: Origin, points: SurfacePoints, truth: Truth) -> None:
    """Write a truth with its points."""
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {
        **points.inputs(),
        "origin": json.dumps({"format": PART_FORMAT, **origin}),
        "anisotropic": points.anisotropic,
        "specular": truth.specular,
        "diffuse": truth.diffuse,
        "uncertainty": truth.uncertainty,
        "sampled": truth.sampled,
    }
    np.savez_compressed(buffer, **arrays)
    replace_file(path, buffer.getvalue(), KIND)
