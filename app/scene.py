"""What is rendered: frozen data, free of files, windows and GPUs.

A `Scene` says what there is, `RenderSettings` how to compute it; with a size
they make a `Shot`, which determines an image completely. Window, snapshots,
`shot` and `bench` all render a `Shot`.

Everything is a frozen, slotted dataclass of numbers, strings and tuples, so
``==`` compares values and unchanged parts are shared between edits
(`dataclasses.replace`). Units: metres, radians, linear Rec. 709 radiance in
W m^-2 sr^-1. Degrees exist only in scene files and panels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

Vec2: TypeAlias = tuple[float, float]
Vec3: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]
FillRule: TypeAlias = Literal["evenodd", "nonzero"]
ToneMap: TypeAlias = Literal["agx", "aces", "reinhard", "none"]

CubicCurve: TypeAlias = tuple[Vec2, Vec2, Vec2, Vec2]
TextAlign: TypeAlias = Literal["left", "center", "right"]
AnchorKind: TypeAlias = Literal["corner", "smooth", "symmetric"]
PixelView: TypeAlias = Literal["radiance", "cost"]
ColorSpace: TypeAlias = Literal["auto", "srgb", "linear"]
PictureFit: TypeAlias = Literal["stretch", "fit", "fill", "tile"]

FILL_RULES: tuple[FillRule, ...] = ("evenodd", "nonzero")
TONE_MAPS: tuple[ToneMap, ...] = ("agx", "aces", "reinhard", "none")
ANCHOR_KINDS: tuple[AnchorKind, ...] = ("corner", "smooth", "symmetric")
TEXT_ALIGNS: tuple[TextAlign, ...] = ("left", "center", "right")
PIXEL_VIEWS: tuple[PixelView, ...] = ("radiance", "cost")
COLOR_SPACES: tuple[ColorSpace, ...] = ("auto", "srgb", "linear")
PICTURE_FITS: tuple[PictureFit, ...] = ("stretch", "fit", "fill", "tile")
BUILT_IN_MESHES = ("plane", "sphere", "disc", "box")

ALPHA_MIN = 1e-4
"""Smallest GGX alpha the techniques are specified and tested for."""

MAX_SAMPLES = 65536
MAX_IMAGE_SIDE = 16384
MAX_FRAMES_PER_SECOND = 1000.0


class SceneError(ValueError):
    """A value that a scene cannot hold. The message is one sentence for the user."""


def _finite(owner: str, field: str, values: tuple[float, ...], length: int) -> None:
    if len(values) != length:
        raise SceneError(f"{owner}: {field} has {len(values)} numbers, expected {length}")
    if not all(math.isfinite(x) for x in values):
        raise SceneError(f"{owner}: {field} is {values}, expected finite numbers")


def _non_negative(owner: str, field: str, values: Vec3, upper: float = math.inf) -> None:
    _finite(owner, field, values, 3)
    if not all(0.0 <= x <= upper for x in values):
        bound = "0 or more" if math.isinf(upper) else f"between 0 and {upper:g}"
        raise SceneError(f"{owner}: {field} is {values}, expected numbers {bound}")


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@dataclass(frozen=True, slots=True)
class Camera:
    """A perspective camera; ``fov_y`` is the full vertical angle in radians."""

    eye: Vec3 = (0.0, 1.2, 4.0)
    target: Vec3 = (0.0, 0.8, 0.0)
    up: Vec3 = (0.0, 1.0, 0.0)
    fov_y: float = math.radians(45.0)

    def __post_init__(self) -> None:
        for field in ("eye", "target", "up"):
            _finite("camera", field, getattr(self, field), 3)
        forward = (
            self.target[0] - self.eye[0],
            self.target[1] - self.eye[1],
            self.target[2] - self.eye[2],
        )
        if not any(forward):
            raise SceneError(f"camera: target equals eye {self.eye}, expected two different points")
        side = math.hypot(*_cross(forward, self.up))
        if side <= 1e-6 * math.hypot(*forward) * math.hypot(*self.up) or not any(self.up):
            raise SceneError(
                f"camera: up {self.up} is parallel to the view direction, "
                "expected another direction"
            )
        if not math.radians(1.0) <= self.fov_y <= math.radians(170.0):
            raise SceneError(
                f"camera: fov_y is {math.degrees(self.fov_y):g} degrees, expected between 1 and 170"
            )


@dataclass(frozen=True, slots=True)
class Material:
    """Lambert plus GGX. ``f0`` is Schlick's normal-incidence reflectance, f90 = 1.

    ``alpha`` is (alpha_x, alpha_y), GGX's parameters along tangent and
    bitangent, from `ALPHA_MIN` to 1; ``rotation`` turns the tangent about the
    normal, in radians.
    """

    name: str
    diffuse: Vec3 = (0.5, 0.5, 0.5)
    f0: Vec3 = (0.04, 0.04, 0.04)
    alpha: Vec2 = (0.25, 0.25)
    rotation: float = 0.0

    def __post_init__(self) -> None:
        owner = f"material '{self.name}'"
        _non_negative(owner, "diffuse", self.diffuse, 1.0)
        _non_negative(owner, "f0", self.f0, 1.0)
        _finite(owner, "alpha", self.alpha, 2)
        if not all(ALPHA_MIN <= a <= 1.0 for a in self.alpha):
            raise SceneError(
                f"{owner}: alpha is {self.alpha}, expected numbers between {ALPHA_MIN:g} and 1"
            )
        _finite(owner, "rotation", (self.rotation,), 1)

    @property
    def is_anisotropic(self) -> bool:
        return self.alpha[0] != self.alpha[1]


@dataclass(frozen=True, slots=True)
class Transform:
    """Scale, then rotate (unit quaternion w, x, y, z), then translate."""

    translate: Vec3 = (0.0, 0.0, 0.0)
    rotate: Quaternion = (1.0, 0.0, 0.0, 0.0)
    scale: Vec3 = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        _finite("transform", "translate", self.translate, 3)
        _finite("transform", "rotate", self.rotate, 4)
        _finite("transform", "scale", self.scale, 3)
        norm = math.hypot(*self.rotate)
        if abs(norm - 1.0) > 1e-3:
            raise SceneError(
                f"transform: rotate {self.rotate} has length {norm:g}, expected a unit quaternion"
            )
        if not all(self.scale):
            raise SceneError(f"transform: scale is {self.scale}, expected no zero")


@dataclass(frozen=True, slots=True)
class SceneObject:
    """A mesh in the world: ``mesh`` is a built-in name or an absolute file path."""

    name: str
    mesh: str
    material: str
    transform: Transform = Transform()


@dataclass(frozen=True, slots=True)
class Plane:
    """The points origin + s u + t v; u x v points to the emitting side."""

    origin: Vec3 = (0.0, 1.0, 0.0)
    u: Vec3 = (1.0, 0.0, 0.0)
    v: Vec3 = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        for field in ("origin", "u", "v"):
            _finite("plane", field, getattr(self, field), 3)
        area = math.hypot(*_cross(self.u, self.v))
        if area <= 1e-9 * math.hypot(*self.u) * math.hypot(*self.v):
            raise SceneError(
                f"plane: u {self.u} and v {self.v} are parallel or zero, "
                "expected two independent directions"
            )


@dataclass(frozen=True, slots=True)
class PolygonContour:
    """A closed polygon in plane coordinates (s, t), any winding."""

    points: tuple[Vec2, ...]

    def __post_init__(self) -> None:
        if len(self.points) < 3:
            raise SceneError(f"polygon has {len(self.points)} points, expected 3 or more")
        for i, point in enumerate(self.points):
            _finite("polygon", f"point {i}", point, 2)


@dataclass(frozen=True, slots=True)
class BezierContour:
    """A closed chain of cubic Bézier curves in plane coordinates (s, t), any winding.

    Each curve is (start anchor, handle, handle, end anchor) and begins exactly
    where the one before it ends. A straight line has its handles on the chord.

    ``kinds`` says how the editor keeps the handles at the anchor where curve i
    begins: free (``corner``), in line (``smooth``), or in line and equally long
    (``symmetric``). Empty means all corners.
    """

    curves: tuple[CubicCurve, ...]
    kinds: tuple[AnchorKind, ...] = ()

    def __post_init__(self) -> None:
        if not self.curves:
            raise SceneError("bezier has no curves, expected one or more")
        for i, curve in enumerate(self.curves):
            if len(curve) != 4:
                raise SceneError(f"bezier: curve {i} has {len(curve)} points, expected 4")
            for j, point in enumerate(curve):
                _finite("bezier", f"curve {i}, point {j}", point, 2)
        for i, curve in enumerate(self.curves):
            before = self.curves[i - 1][3]
            if curve[0] != before:
                raise SceneError(
                    f"bezier: curve {i} begins at {curve[0]}, expected {before}, "
                    "where the one before it ends"
                )
        if self.kinds and len(self.kinds) != len(self.curves):
            raise SceneError(
                f"bezier: there are {len(self.kinds)} kinds for {len(self.curves)} anchors, "
                "expected one for each"
            )
        for kind in self.kinds:
            if kind not in ANCHOR_KINDS:
                raise SceneError(
                    f"bezier: '{kind}' is no kind of anchor, expected one of "
                    f"{', '.join(ANCHOR_KINDS)}"
                )

    @property
    def anchors(self) -> tuple[Vec2, ...]:
        """Where the curves begin."""
        return tuple(curve[0] for curve in self.curves)


Contour: TypeAlias = PolygonContour | BezierContour
"""One closed curve of an outline."""


@dataclass(frozen=True, slots=True)
class Outline:
    """Closed contours whose inside is decided by ``fill_rule``; holes are contours."""

    contours: tuple[Contour, ...]
    fill_rule: FillRule = "evenodd"

    def __post_init__(self) -> None:
        if not self.contours:
            raise SceneError("outline has no contours, expected one or more")
        if self.fill_rule not in FILL_RULES:
            raise SceneError(
                f"outline: fill_rule is '{self.fill_rule}', expected one of {', '.join(FILL_RULES)}"
            )


@dataclass(frozen=True, slots=True)
class TextSource:
    """What a text light's outline was made from; `app.text` makes it again.

    ``font`` is an absolute file path, or empty for the font in ``assets/``;
    ``size`` is the em in units of the plane, ``line_height`` in ems, ``spacing``
    what is added between letters, in ems. Lines end with ``\\n``.
    """

    text: str
    font: str = ""
    size: float = 1.0
    align: TextAlign = "center"
    spacing: float = 0.0
    line_height: float = 1.2

    def __post_init__(self) -> None:
        for field in ("size", "spacing", "line_height"):
            _finite("text", field, (getattr(self, field),), 1)
        if not self.size > 0.0:
            raise SceneError(f"text: size is {self.size:g}, expected a number above 0")
        if self.align not in TEXT_ALIGNS:
            raise SceneError(
                f"text: align is '{self.align}', expected one of {', '.join(TEXT_ALIGNS)}"
            )


@dataclass(frozen=True, slots=True)
class SvgSource:
    """The file (absolute path) that a light's outline was read from.

    ``size`` is the longer side of the drawing in units of the plane.
    """

    path: str
    size: float = 2.0

    def __post_init__(self) -> None:
        _finite("svg", "size", (self.size,), 1)
        if not self.size > 0.0:
            raise SceneError(f"svg: size is {self.size:g}, expected a number above 0")


OutlineSource: TypeAlias = TextSource | SvgSource


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture file on a light, and how it lies there; `app.pictures` reads and places it.

    Seen from the emitting side, u to the right and v up, an unturned picture stands upright.

    Attributes
    ----------
    file : str
        Absolute path of a still or animated picture; with ``%d`` or ``%04d`` in its name, the
        numbered frames of a sequence.
    color_space : str
        How the file's numbers stand for light; ``auto`` is linear for numbers in floating
        point, sRGB for whole ones.
    fit : str
        Within the box around the outline: ``stretch`` to its sides, whole (``fit``), without a
        gap (``fill``), or whole and repeated for ever (``tile``).
    offset : (right, up)
        Moves the picture, in widths and heights of that box.
    scale : (width, height)
        Sizes of the picture relative to what ``fit`` gives, above 0.
    rotation : float
        Counter-clockwise about the picture's middle [rad].
    mirror : (left and right, top and bottom)
        Whether they change places, before the rotation.
    frames_per_second : float
        Of an animation; 0 is what the file says, 25 where it says nothing.
    start : float
        The moment of the animation [s] that is shown at time 0.
    """

    file: str
    color_space: ColorSpace = "auto"
    fit: PictureFit = "stretch"
    offset: Vec2 = (0.0, 0.0)
    scale: Vec2 = (1.0, 1.0)
    rotation: float = 0.0
    mirror: tuple[bool, bool] = (False, False)
    frames_per_second: float = 0.0
    start: float = 0.0

    def __post_init__(self) -> None:
        if not self.file.strip() or "\0" in self.file:
            raise SceneError(f"picture: file is {self.file!r}, expected the path of a file")
        if self.color_space not in COLOR_SPACES:
            raise SceneError(
                f"picture: color_space is '{self.color_space}', "
                f"expected one of {', '.join(COLOR_SPACES)}"
            )
        if self.fit not in PICTURE_FITS:
            raise SceneError(
                f"picture: fit is '{self.fit}', expected one of {', '.join(PICTURE_FITS)}"
            )
        _finite("picture", "offset", self.offset, 2)
        _finite("picture", "scale", self.scale, 2)
        if not all(x > 0.0 for x in self.scale):
            raise SceneError(f"picture: scale is {self.scale}, expected numbers above 0")
        if len(self.mirror) != 2:
            raise SceneError(f"picture: mirror has {len(self.mirror)} values, expected 2")
        for field in ("rotation", "frames_per_second", "start"):
            _finite("picture", field, (getattr(self, field),), 1)
        if not 0.0 <= self.frames_per_second <= MAX_FRAMES_PER_SECOND:
            raise SceneError(
                f"picture: frames_per_second is {self.frames_per_second:g}, "
                f"expected between 0 and {MAX_FRAMES_PER_SECOND:g}"
            )


@dataclass(frozen=True, slots=True)
class AreaLight:
    """A planar light that emits radiance towards u x v, or to both sides.

    ``visible`` says whether the camera sees the light itself. ``source`` is what the
    outline was made from, if it was; editing the outline itself forgets it. A ``picture`` on it
    multiplies the radiance; where it is transparent there is no light.
    """

    name: str
    outline: Outline
    plane: Plane = Plane()
    radiance: Vec3 = (1.0, 1.0, 1.0)
    two_sided: bool = False
    visible: bool = True
    source: OutlineSource | None = None
    picture: Picture | None = None

    def __post_init__(self) -> None:
        _non_negative(f"light '{self.name}'", "radiance", self.radiance)


@dataclass(frozen=True, slots=True)
class Display:
    """From linear radiance to the screen: exposure in stops, then the tone map."""

    exposure: float = 0.0
    tone_map: ToneMap = "agx"

    def __post_init__(self) -> None:
        _finite("display", "exposure", (self.exposure,), 1)
        if not -32.0 <= self.exposure <= 32.0:
            raise SceneError(f"display: exposure is {self.exposure:g}, expected between -32 and 32")
        if self.tone_map not in TONE_MAPS:
            raise SceneError(
                f"display: tone_map is '{self.tone_map}', expected one of {', '.join(TONE_MAPS)}"
            )


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything in a scene file. Names are unique within their kind."""

    materials: tuple[Material, ...] = ()
    objects: tuple[SceneObject, ...] = ()
    lights: tuple[AreaLight, ...] = ()
    camera: Camera = Camera()
    display: Display = Display()

    def __post_init__(self) -> None:
        for kind, items in (
            ("materials", self.materials),
            ("objects", self.objects),
            ("lights", self.lights),
        ):
            names: set[str] = set()
            for item in items:
                if item.name in names:
                    raise SceneError(
                        f"{kind}: the name '{item.name}' is used twice, expected unique names"
                    )
                names.add(item.name)
        known = {material.name for material in self.materials}
        for drawn in self.objects:
            if drawn.material not in known:
                raise SceneError(
                    f"object '{drawn.name}': material '{drawn.material}' is not among the scene's "
                    f"materials ({', '.join(sorted(known)) or 'none'})"
                )

    def object_materials(self) -> tuple[Material, ...]:
        """Return each object's material, in the order of the objects."""
        by_name = {material.name: material for material in self.materials}
        return tuple(by_name[item.material] for item in self.objects)

    def material_of(self, item: SceneObject) -> Material:
        return next(m for m in self.materials if m.name == item.material)


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """How to compute the picture: technique by name, and samples per pixel.

    Technique ``auto`` is whichever suits the scene (`app.render.techniques`).

    One sample is exactly the pixel centre. ``view`` is what a pixel shows: its radiance, or its
    cost, the number of evaluations of the contour integral that its lights took.

    ``cull`` is the radiance that all that is skipped at a pixel may add up to, as a share of
    display white (radiance 1 at the scene's exposure): lights that a certified bound puts below
    their part of it are not integrated. 0 integrates everything.

    ``positions`` is how many places in a pixel the samples take in turn, 0 for one of its own
    each: pictures of different techniques with unequal numbers of samples differ by nothing but
    the technique if they share it, and their samples are multiples of it.

    ``time`` [s] is the moment of animated pictures that is shown.
    """

    technique: str = "auto"
    samples: int = 1
    view: PixelView = "radiance"
    positions: int = 0
    cull: float = 0.0
    time: float = 0.0

    def __post_init__(self) -> None:
        _finite("settings", "time", (self.time,), 1)
        if self.view not in PIXEL_VIEWS:
            raise SceneError(f"view is '{self.view}', expected one of {', '.join(PIXEL_VIEWS)}")
        if not 1 <= self.samples <= MAX_SAMPLES:
            raise SceneError(f"samples is {self.samples}, expected between 1 and {MAX_SAMPLES}")
        if not 0 <= self.positions <= MAX_SAMPLES:
            raise SceneError(f"positions is {self.positions}, expected between 0 and {MAX_SAMPLES}")
        if not 0.0 <= self.cull <= 1.0:
            raise SceneError(f"cull is {self.cull:g}, expected between 0 and 1")


@dataclass(frozen=True, slots=True)
class Shot:
    """A scene, settings and a size in pixels: one image, completely determined."""

    scene: Scene
    settings: RenderSettings = RenderSettings()
    width: int = 1280
    height: int = 720

    def __post_init__(self) -> None:
        for field in ("width", "height"):
            value = getattr(self, field)
            if not 1 <= value <= MAX_IMAGE_SIDE:
                raise SceneError(f"{field} is {value}, expected between 1 and {MAX_IMAGE_SIDE}")
