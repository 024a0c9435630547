"""The panels of an object and of its material."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from imgui_bundle import imgui

from app.panels.widgets import (
    button,
    choice,
    colour,
    heading,
    hint,
    identity,
    numbers,
    position,
    slider,
)
from app.scene import Material, SceneObject, Vec2
from app.sliders import (
    ROUGHNESS_MIN,
    alpha_from_sliders,
    euler_from_quaternion,
    quaternion_from_euler,
    sliders_from_alpha,
)

PRESETS: tuple[tuple[str, str, Material], ...] = (
    ("Matte", "Chalk: diffuse only in looks",
     Material("", (0.6, 0.6, 0.6), (0.04, 0.04, 0.04), (0.64, 0.64))),
    ("Satin", "Painted wood",
     Material("", (0.35, 0.35, 0.35), (0.04, 0.04, 0.04), (0.09, 0.09))),
    ("Gloss", "Lacquer or wet floor",
     Material("", (0.08, 0.08, 0.09), (0.06, 0.06, 0.06), (0.01, 0.01))),
    ("Steel", "Brushed metal without a direction",
     Material("", (0.0, 0.0, 0.0), (0.56, 0.57, 0.58), (0.09, 0.09))),
    ("Brushed", "Aluminium brushed along the tangent",
     Material("", (0.0, 0.0, 0.0), (0.91, 0.92, 0.92), (0.04, 0.36))),
    ("Gold", "Polished gold",
     Material("", (0.0, 0.0, 0.0), (1.0, 0.71, 0.29), (0.04, 0.04))),
    ("Copper", "Worn copper",
     Material("", (0.0, 0.0, 0.0), (0.95, 0.64, 0.54), (0.16, 0.16))),
    ("Mirror", "Silver, polished",
     Material("", (0.0, 0.0, 0.0), (0.97, 0.96, 0.91), (0.001, 0.001))),
    ("Clay", "Fired, without glaze",
     Material("", (0.45, 0.18, 0.10), (0.04, 0.04, 0.04), (0.36, 0.36))),
)  # fmt: skip
"""Name, tooltip and values; f0 of metals from Akenine-Möller et al. 2018, table 9.2."""


def material_panel(material: Material, anisotropic: bool = False) -> Material:
    """Draw the panel and return the material as edited.

    Parameters
    ----------
    anisotropic : bool
        Whether the technique in use shades anisotropic materials; without it
        those controls are shown only for a material that is anisotropic already.
    """
    with identity(f"material {material.name}"):
        chosen = _presets()
        diffuse = colour("Diffuse", material.diffuse, "Lambert albedo, 0 to 1 per channel")
        f0 = colour(
            "Specular", material.f0,
            "Reflectance f0 at normal incidence: 0.04 for plastic and glass, coloured for metals",
        )  # fmt: skip
        roughness, anisotropy = sliders_from_alpha(material.alpha)
        rough = slider(
            "Roughness", roughness, ROUGHNESS_MIN, 1.0, "%.3f",
            "GGX roughness; the papers' alpha is its square",
        )  # fmt: skip
        stretched, rotation = anisotropy, material.rotation
        if anisotropic or material.is_anisotropic:
            stretched = slider(
                "Anisotropy", anisotropy, -1.0, 1.0, "%.3f",
                "Stretch of the highlight, as brushed metal; Burley 2012",
            )  # fmt: skip
            degrees = math.degrees(material.rotation)
            turned = slider(
                "Rotation", degrees, -180.0, 180.0, "%.1f°", "Turns the brushing about the normal"
            )
            rotation = math.radians(turned) if turned != degrees else material.rotation
        hint(alpha_text(material.alpha))
    alpha = material.alpha
    if (rough, stretched) != (roughness, anisotropy):
        alpha = alpha_from_sliders(rough, stretched)
    if chosen is not None:
        return replace(chosen, name=material.name, rotation=material.rotation)
    return replace(material, diffuse=diffuse, f0=f0, alpha=alpha, rotation=rotation)


def alpha_text(alpha: Vec2) -> str:
    """Return the GGX parameters as a line to read, "αx 0.09, αy 0.36"."""
    if alpha[0] == alpha[1]:
        return f"α {alpha[0]:.4g}"
    return f"αx {alpha[0]:.4g} along the tangent, αy {alpha[1]:.4g} across"


def _presets() -> Material | None:
    """Draw the row of ready-made materials and return the one pressed."""
    chosen = None
    columns = 3
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - (columns - 1) * spacing) / columns
    for i, (name, tip, values) in enumerate(PRESETS):
        if i % columns:
            imgui.same_line()
        if button(name, tip, width=width):
            chosen = values
    imgui.spacing()
    return chosen


def object_panel(item: SceneObject, materials: Sequence[str]) -> SceneObject:
    """Draw the panel of an object's placement and choice of material, return it as edited."""
    with identity(f"object {item.name}"):
        material = choice("Material", item.material, materials, "Which material the object has")
        heading("Placement")
        transform = item.transform
        translate = position("Position", transform.translate, "Where its origin is [m]")
        angles = euler_from_quaternion(transform.rotate)
        degrees = tuple(math.degrees(angle) for angle in angles)
        turned = numbers("Rotation", degrees, 0.5, "%.1f°", "About x, then y, then z [degrees]")
        sx, sy, sz = numbers("Scale", transform.scale, 0.01, "%.3f", "Along its own axes")
    rotate = transform.rotate
    if turned != degrees:
        x, y, z = (math.radians(angle) for angle in turned)
        rotate = quaternion_from_euler((x, y, z))
    scale = (sx, sy, sz) if all((sx, sy, sz)) else transform.scale
    return replace(
        item,
        material=material,
        transform=replace(transform, translate=translate, rotate=rotate, scale=scale),
    )
