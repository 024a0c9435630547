"""``ltc-viewer compare``: how far a technique's picture is from another's, or a file from one."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.table import Table

from app.cli.common import (
    DEFAULT_SIZE,
    SizeOption,
    Steps,
    TechniqueOption,
    headless_renderer,
    image_size,
    named_scene,
    results,
    whole_number,
)
from app.colour_maps import SEQUENTIAL
from app.errors import InputError, expected_one_of
from app.images import IMAGE_SUFFIXES, check_image_path, read_image, save_image
from app.render.breakdown import Breakdown, break_down
from app.render.comparison import (
    SAMPLED,
    Pictures,
    earlier_samples,
    estimated_error,
    shared_samples,
)
from app.render.difference import (
    DIFFERENCE_VIEWS,
    LUMINANCE,
    DifferenceView,
    Measure,
    Numbers,
    Scale,
    robust_high,
)
from app.render.gathering import Gathering, Points, check_breakdown, random_places
from app.render.techniques import AUTOMATIC, find_technique, suited_technique, technique_of
from app.render.tone_map import display_codes, linear_from_srgb, quantise
from app.scene import MAX_SAMPLES, Display, RenderSettings, Shot

if TYPE_CHECKING:
    from app.render.renderer import Renderer

MAX_POINTS = 100_000
VIEWS = (*DIFFERENCE_VIEWS, "split", "a", "b")


def compare(
    first: Annotated[
        str,
        typer.Argument(
            metavar="SCENE|A.exr", help="Scene file or demo scene; or a picture, .exr or .png."
        ),
    ],
    second: Annotated[
        str | None,
        typer.Argument(metavar="B.exr", help="With a picture: the one to compare it with."),
    ] = None,
    technique: TechniqueOption = AUTOMATIC,
    against: Annotated[
        str, typer.Option("--against", metavar="NAME[:N]", help="Technique to measure it by.")
    ] = "reference",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write the difference: .png or .exr."),
    ] = None,
    view: Annotated[
        str,
        typer.Option("--view", metavar="VIEW", help=f"What to write: {', '.join(VIEWS)}."),
    ] = "absolute",
    measure: Annotated[
        str,
        typer.Option("--of", metavar="WHAT", help="What to compare: luminance or channel."),
    ] = "luminance",
    high: Annotated[
        float,
        typer.Option(
            "--range", metavar="X", help="Value at the end of the colours.", show_default="fitting"
        ),
    ] = 0.0,
    colours: Annotated[
        str, typer.Option("--map", metavar="MAP", help=f"Colours: {', '.join(SEQUENTIAL)}.")
    ] = "magma",
    size: SizeOption = DEFAULT_SIZE,
    samples: Annotated[
        int,
        typer.Option(
            "--samples",
            metavar="N",
            help="Positions in a pixel, the same for both; 1 is the pixel centre.",
            parser=whole_number("--samples", 1, MAX_SAMPLES),
        ),
    ] = 16,
    estimates: Annotated[
        int,
        typer.Option(
            "--estimates",
            metavar="N",
            help="Least samples of a technique that is a random estimate.",
            parser=whole_number("--estimates", 1, MAX_SAMPLES),
        ),
    ] = SAMPLED,
    count: Annotated[
        int,
        typer.Option(
            "--breakdown",
            metavar="N",
            help="Tell at N random pixels which part of A's error is whose.",
            parser=whole_number("--breakdown", 0, MAX_POINTS),
            show_default=False,
        ),
    ] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Say how far a picture is from another technique's, or from another file.

    Without a second picture the scene is rendered twice, by --technique (A) and by
    --against (B), at the same positions in every pixel, and the differences of A to B are
    told: mean, root of the mean square, percentiles and largest, as radiance and as shares
    of B's mean and of the brightest light. Where B is a random estimate, its own standard
    error stands beside them: what is not above it is noise.

    --breakdown takes N random pixels and computes the radiance in float64 with one of A's
    approximations after another: Fresnel's term apart from the lobe, the fitted lobe, the
    table, the textures, the outline; what is left is float32's.

    -o writes a picture of --view: signed, absolute or relative difference or FLIP in
    false colours with their legend; both halves side by side (split); or one of the
    two. An .exr gets the numbers instead.

    Two .exr are compared as linear radiance, two .png as the light that a display
    emits, 1 its white.

    \b
    Examples:
      ltc-viewer compare 06-grazing --technique ltc --against ggx:4 -o error.png
      ltc-viewer compare 06-grazing --technique ltc --breakdown 100
      ltc-viewer compare mine.exr theirs.exr --view signed -o signed.png
    """
    chosen = _choices(view, measure, colours, high)
    if output is not None:
        check_image_path(output)
    is_picture = Path(first).suffix.lower() in IMAGE_SUFFIXES
    if is_picture:
        if second is None:
            raise InputError(f"{first}: this is one picture, expected two to compare, or a scene")
        if count:
            raise InputError("--breakdown needs a scene, found two pictures")
        pictures, parts = read_pictures(Path(first), Path(second)), None
    else:
        if second is not None:
            raise InputError(
                f"{first}: a scene is compared with itself by two techniques, found {second} "
                "beside it, expected --technique and --against"
            )
        width, height = image_size(size)
        for name in (technique, against):
            suited_technique(name, anisotropic=False)
        if count:
            check_breakdown(technique)
        scene = named_scene(first)
        if count:
            check_breakdown(technique, scene)
        shot = Shot(scene, RenderSettings(technique, samples), width, height)
        pictures, parts = render_pictures(shot, against, estimates, count)
    found = pictures.numbers(chosen.measure)
    seen = pictures.flip() if view == "flip" or as_json or output is None else None
    mean_flip = None if seen is None else float(seen.mean())
    if output is not None:
        save_image(_picture(pictures, found, view, chosen, seen), output)
    if as_json:
        typer.echo(json.dumps(_json(pictures, found, mean_flip, parts), indent=2))
    else:
        results().print(numbers_table(pictures, found, mean_flip))
        if parts is not None:
            results().print(breakdown_table(parts))
        if output is not None:
            typer.echo(output)


def _choices(view: str, measure: str, colours: str, high: float) -> Scale:
    """Return the scale that options ask for; ``high`` is 0 where it shall fit."""
    if view not in VIEWS:
        raise InputError(f"--view is '{view}', {expected_one_of(view, VIEWS)}")
    names: dict[str, Measure] = {"luminance": "luminance", "channel": "largest channel"}
    if measure not in names:
        raise InputError(f"--of is '{measure}', {expected_one_of(measure, names)}")
    if colours not in SEQUENTIAL:
        raise InputError(f"--map is '{colours}', {expected_one_of(colours, SEQUENTIAL)}")
    if not 0.0 <= high < np.inf:
        raise InputError(f"--range is {high:g}, expected a number above 0")
    kind: DifferenceView = view if view in DIFFERENCE_VIEWS else "absolute"
    return Scale(kind, high, names[measure], colours)


def read_pictures(first: Path, second: Path) -> Pictures:
    """Return two picture files to compare.

    Raises
    ------
    InputError
        If one cannot be read, or they differ in size or in kind.
    """
    a, b = read_image(first), read_image(second)
    if a.dtype != b.dtype:
        raise InputError(
            f"{second}: found a {second.suffix.lower()} beside {first}, expected another "
            f"{first.suffix.lower()}: radiance and display colours cannot be compared"
        )
    if a.shape != b.shape:
        sizes = [f"{p.shape[1]}x{p.shape[0]}" for p in (a, b)]
        raise InputError(f"{second}: the picture is {sizes[1]}, expected {sizes[0]} as {first}")
    names = (first.name, second.name) if first.name != second.name else (str(first), str(second))
    if a.dtype == np.uint8:
        linear = [linear_from_srgb(p / 255.0).astype(np.float32) for p in (a, b)]
        return Pictures(names, linear[0], linear[1], a.astype(np.uint8), b.astype(np.uint8))
    shown = [_shown(p) for p in (a, b)]
    return Pictures(names, a.astype(np.float32), b.astype(np.float32), shown[0], shown[1])


def _shown(radiance: NDArray[Any]) -> NDArray[np.uint8]:
    """Return what the display pass would show of radiance; not finite is black."""
    good = np.nan_to_num(radiance.astype(np.float64), nan=0.0, posinf=1e9, neginf=0.0)
    return quantise(display_codes(np.clip(good, 0.0, 1e9), Display()))


def render_pictures(
    shot: Shot, against: str, estimates: int, count: int = 0
) -> tuple[Pictures, Breakdown | None]:
    """Render a shot and what to compare it with.

    Parameters
    ----------
    shot : Shot
        With A's technique; its samples are the positions that both take.
    against : str
        B's technique.
    estimates : int
        Least samples of a technique that samples.
    count : int
        Pixels at which A's error is broken down, 0 for none.
    """
    scene = shot.scene
    names = technique_of(scene, shot.settings.technique), technique_of(scene, against)
    sampled = [find_technique(name).is_sampled for name in names]
    a, b, positions = shared_samples(shot.settings.samples, (sampled[0], sampled[1]), estimates)
    radiance, shown, noise, points = [], [], [], None
    with headless_renderer() as (ctx, renderer), Steps("rendering", a + b) as steps:
        for name, samples in zip(names, (a, b), strict=True):
            settings = replace(shot.settings, technique=name, positions=positions, samples=1)
            wanted = replace(shot, settings=settings)
            before = steps.count
            random = find_technique(name).is_sampled
            fewer = earlier_samples(samples, positions) if random else 0
            error = None
            while (done := renderer.accumulate(wanted, samples)) < samples:
                ctx.finish()
                steps.done(before + done)
                if done == fewer:
                    error = renderer.radiance()
            steps.done(before + samples)
            radiance.append(renderer.radiance())
            if error is not None:
                error = estimated_error(radiance[-1], samples, error, fewer)
            noise.append(error)
            shown.append(renderer.display())
            if count and name == names[0] and points is None:
                points = _points(renderer, wanted, count)
    pictures = Pictures(
        names, radiance[0], radiance[1], shown[0], shown[1], scene.lights, (noise[0], noise[1])
    )
    if points is None:
        return pictures, None
    if not points.count:
        raise InputError("--breakdown: the picture shows no surface, expected one that does")
    total = points.count + len(scene.lights)
    with Steps("breaking the error down", total) as steps:
        return pictures, break_down(points, scene, names[0], lambda done, _: steps.done(done))


def _points(renderer: Renderer, shot: Shot, count: int) -> Points:
    """Return random points of the picture rendered last, which shows ``shot``."""
    places = random_places((shot.width, shot.height))
    gathering = Gathering(renderer, shot, places, count)
    while not gathering.step():
        pass
    return gathering.points()


class _Picture:
    """What ``-o`` writes: colours to a .png, numbers to an .exr."""

    def __init__(self, colours: NDArray[np.uint8], values: NDArray[Any]) -> None:
        self._colours, self._values = colours, values

    def display(self) -> NDArray[np.uint8]:
        return self._colours

    def radiance(self) -> NDArray[np.float32]:
        return np.asarray(self._values, dtype=np.float32)


def _picture(
    pictures: Pictures,
    found: Numbers,
    view: str,
    scale: Scale,
    seen: NDArray[np.float64] | None,
) -> _Picture:
    if view == "split":
        middle = pictures.a.shape[1] // 2
        both = np.concatenate([pictures.a[:, :middle], pictures.b[:, middle:]], axis=1)
        return _Picture(pictures.split(), both)
    if view in ("a", "b"):
        shown = pictures.shown_a if view == "a" else pictures.shown_b
        return _Picture(shown, pictures.a if view == "a" else pictures.b)
    kind = scale.view
    values = seen if seen is not None and kind == "flip" else None
    if values is None:
        values = pictures.values(kind, scale.measure, found.floor)
    if not scale.high:
        high = robust_high(kind, pictures.a, pictures.b, scale.measure, found.floor)
        scale = replace(scale, high=high)
    return _Picture(pictures.coloured(values, scale), np.repeat(values[..., None], 3, axis=2))


def numbers_table(pictures: Pictures, found: Numbers, mean_flip: float | None) -> Table:
    """Return the numbers of a comparison as a table."""
    a, b = pictures.names
    height, width = pictures.a.shape[:2]
    table = Table(title=f"{a} compared with {b}: {found.measure}, {width}x{height} pixels")
    table.add_column("difference")
    table.add_column("radiance", justify="right")
    table.add_column(f"of the mean of {b}", justify="right")
    if found.light is not None:
        table.add_column("of the brightest light", justify="right")
    for name, value, of_b, of_light in found.rows():
        shares = [of_b, of_light] if found.light is not None else [of_b]
        name = name.replace("A ", f"{a} ").replace("A's", f"{a}'s").replace("B's", f"{b}'s")
        table.add_row(name, f"{value:.3g}", *(_percent(share) for share in shares))
    empty = [""] * (len(table.columns) - 2)
    table.add_row(f"mean of {b}", f"{found.mean_b:.3g}", *empty)
    if mean_flip is not None:
        table.add_row("mean FLIP", f"{mean_flip:.3g}", *empty)
    if found.bad:
        table.add_row("pixels not finite", str(found.bad), *empty)
    return table


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.3g} %"


def breakdown_table(parts: Breakdown) -> Table:
    """Return what each approximation adds to a technique's error as a table."""
    count, mean = len(parts.exact), float(np.mean(parts.exact @ np.array(LUMINANCE)))
    table = Table(
        title=f"Whose {parts.technique}'s error is: luminance at {count} random pixels' points, "
        f"where {mean:.3g} is exact on average"
    )
    table.add_column("part")
    for head in ("mean", "95 % below", "largest", "brighter by"):
        table.add_column(head, justify="right")
    for name, *values in parts.rows():
        if name == "all":
            table.add_section()
        table.add_row(name, *(f"{value:.2g}" for value in values))
    return table


def _json(
    pictures: Pictures, found: Numbers, mean_flip: float | None, parts: Breakdown | None
) -> dict[str, Any]:
    a, b = pictures.names
    height, width = pictures.a.shape[:2]
    told = {"a": a, "b": b, "size": [width, height], **asdict(found), "flip": mean_flip}
    if parts is not None:
        heads = ("mean", "p95", "max", "bias")
        told["breakdown"] = {
            "points": len(parts.exact),
            "exact": float(np.mean(parts.exact @ np.array(LUMINANCE))),
            "parts": {
                name: dict(zip(heads, values, strict=True)) for name, *values in parts.rows()
            },
        }
    return told
