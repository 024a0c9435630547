"""Linearly transformed cosines and the mathematics around them, in float64.

Conventions, stated once and used everywhere (``app`` and ``shaders`` too):

Space
    Right-handed, +y up, metres, radians. Column vectors; components on the
    last array axis, every function batched over the leading axes.
Matrices
    Read right to left: ``clip_from_world = clip_from_view @ view_from_world``.
    The paper's M (Heitz et al. 2016, section 3) is ``shading_from_cosine``;
    its inverse is ``cosine_from_shading``.
Shading frame
    Origin at the shaded point, +z the surface normal. For isotropic materials
    the view lies in the xz half-plane x >= 0; with anisotropy +x is the
    tangent, and a docstring says so.
Directions
    ``wo`` points to the viewer, ``wi`` to the light; both unit, both leave the
    surface.
Winding
    A light's outline runs counter-clockwise seen from its emitting side,
    which is clockwise about +z in the shading frame of a point that it
    lights. `ltc.polygon` returns form factors that are positive for
    counter-clockwise about +z; callers that hold light outlines flip the sign
    in one named place.
Roughness
    ``alpha`` (or ``alpha_x, alpha_y``) is the GGX parameter of the papers,
    never a slider's roughness nor its square root.
Light
    Radiance is linear Rec. 709 in W m^-2 sr^-1. A form factor is the integral
    of the normalised clamped cosine, in [0, 1]; times pi and radiance it is
    irradiance.
"""
