"""Shader code that samples an exported table, in GLSL, HLSL and WGSL.

There is one source, in a dialect of GLSL that `translate` turns into the other two word by
word: every local is declared on a line of its own, nothing is written that one of
the three has not (no matrices, no ternaries, no vectors from one scalar). What
comes out is plain code without uniforms, entry points or preprocessor.

The mathematics is that of ``shaders/ltc/table.glsl`` and ``shaders/ltc/lobe.glsl`` for the
isotropic table. The anisotropic one needs M0^-1 in full. With T, D, R, N of
`ltc.table.closed_form_guess`, M0 = T D R N diag(2, 2, 1), e_1 along v'_xy, e_2 across:

    N^-1 = diag(2 / (1 + v'_z), 1, 1) in the basis e_1, e_2, z,
    T = c I + [k]x with k = v x h, so p T^-1 = (c^2 p + (p.k) k - c p x k) / (c |h|^2).

The rows p_i of R^T D^-1 are D^-1 R e_i with h = D m, so p_1.h = p_2.h = 0, p_3.h = 1 and
p x k = (p.h) v - (p.v) h. What cancels at grazing views is written out, by
det(D) D^-1 (a x b) = D a x D b (w = ax ay / |D v|, m_s and v'_s the parts along e_1):

    w p_1.k = (m.v') m_s e_1x e_1y (ax^2 - ay^2),
    w p_2.k = v'_z m_s |D e_1|^2 - v'_s m_z,
    w p_3.k = -(m x v').e_2 m_s e_1x e_1y (ax^2 - ay^2),
    p_2.v = v_x v_y (ax^2 - ay^2) / (ax ay |D v_xy|), k_z = -m_s v_x v_y (ax^2 - ay^2) / |D v_xy|.

(I + X)^-1 is the adjugate over a determinant of .3 or more.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

LANGUAGES = ("glsl", "hlsl", "wgsl")

_ISOTROPIC = """\
// Linearly transformed cosine of an isotropic GGX lobe, from the table's two textures.
//
// Shading frame: z the surface's normal, the view at (sin theta, 0, cos theta), that is
// x along the view's part in the surface, or anything at normal incidence.
// residual: @residual@ x @residual@, four floats; albedo: @albedo@ x @albedo@, two; 16 or 32 bits.
// Nothing is filtered by the sampler: eight bits of weight cost 1e-3 of a lobe's width.
//
// Radiance that a polygon light of radiance L adds, f0 the reflectance at normal incidence:
//   clip the light to z > 0, multiply its corners by the rows, clip to z > 0 again,
//   E = form factor of that (edge terms / 2 pi; all of the sphere's upper half gives 1),
//   L (f0 (albedo - fresnel) + fresnel) E / above.

const int LTC_RESIDUAL = @residual@;
const int LTC_ALBEDO = @albedo@;

struct LtcLobe {
    vec3 row0;      // rows of M^-1, shading frame to cosine, up to a positive factor
    vec3 row1;
    vec3 row2;
    float above;    // share of the lobe above the surface
    float albedo;   // directional albedo for F = 1
    float fresnel;  // its part under (1 - cos)^5
};

vec4 ltc_bilinear(sampler2D tex, int size, vec2 t)
{
    vec2 node = clamp(t, vec2(0.0, 0.0), vec2(1.0, 1.0)) * float(size - 1);
    ivec2 low = min(ivec2(node), ivec2(size - 2, size - 2));
    vec2 f = node - vec2(low);
    vec4 first = mix(FETCH2(tex, low), FETCH2(tex, low + ivec2(1, 0)), f.x);
    vec4 second = mix(FETCH2(tex, low + ivec2(0, 1)), FETCH2(tex, low + ivec2(1, 1)), f.x);
    return mix(first, second, f.y);
}

// alpha: the GGX parameter (roughness squared, in most programs), not its root. Take
// sin_theta from the length of the view's part in the surface, not from cos_theta.
LtcLobe ltc_lobe(
    sampler2D residual, sampler2D albedo, float alpha, float sin_theta, float cos_theta)
{
    float a = clamp(alpha, 1e-4, 1.0);
    float s = sin_theta;
    float c = clamp(cos_theta, 0.0, 1.0);

    float p = s * sqrt(a / (1.0 + c));
    float r = sqrt(c * (1.0 + a));
    vec2 t = vec2(sqrt(a), p / (p + r));
    vec4 x = ltc_bilinear(residual, LTC_RESIDUAL, t);
    vec4 stored = ltc_bilinear(albedo, LTC_ALBEDO, t);

    // v': the view stretched by alpha; m: between v' and the normal.
    float stretched = sqrt(a * a * s * s + c * c);
    float vx = a * s / stretched;
    float vz = c / stretched;
    float mz = vz + 0.7 * vx * vx / (1.0 + vz);
    float inv = inversesqrt(vx * vx + mz * mz);
    float mx = vx * inv;
    mz *= inv;
    float q = 0.5 * (1.0 + vz);
    // The lobe's centre as a half vector.
    float hx = a * mx;
    float k = s * hx + c * mz;
    float w = c * hx - s * mz;

    // alpha M0^-1 (xz block and y), and the z row of M0.
    float h2 = hx * hx + mz * mz;
    vec2 r2 = vec2(mx * k + a * mz * w, a * mz * k - mx * w);
    vec2 r0 = vec2(mz * k - hx * w, -(mz * w + hx * k));
    vec2 z_row = vec2(-2.0 * q * r2.x, r0.x);
    r0 = r0 / (2.0 * q);

    float x00 = 1.0 + x.x;
    float x02 = s * x.y;
    float x11 = 1.0 + x.z;
    float x20 = s * x.w;
    float inv_det = 1.0 / (x00 - x02 * x20);
    vec2 top = (r0 - x02 * r2) * inv_det;
    vec2 bottom = (x00 * r2 - x20 * r0) * inv_det;
    float m20 = z_row.x * x00 + z_row.y * x20;
    float m22 = z_row.x * x02 + z_row.y;

    float u = 1.0 - min(stretched * stored.y, 1.0);
    float u2 = u * u;

    LtcLobe lobe;
    lobe.row0 = vec3(top.x, 0.0, top.y);
    lobe.row1 = vec3(0.0, 0.5 * h2 / (k * x11), 0.0);
    lobe.row2 = vec3(bottom.x, 0.0, bottom.y);
    lobe.above = 0.5 + 0.5 * m22 * inversesqrt(m20 * m20 + m22 * m22);
    lobe.albedo = stored.x;
    lobe.fresnel = stored.x * u2 * u2 * u;
    return lobe;
}
"""

_ANISOTROPIC = """\
// Linearly transformed cosine of an anisotropic GGX lobe, from the table's three textures.
//
// Tangent frame: x the tangent, z the surface's normal; the view may have any azimuth.
// residual_1, residual_2: @n3@ x @n2@ x @n01@, four floats; albedo: @m3@ x @m2@ x @m01@, two; 16 or
// 32 bits. Width: alpha, height: view, depth: slabs of one azimuth, in each the ratio of alphas.
//
// Radiance that a polygon light of radiance L adds, f0 the reflectance at normal incidence:
//   clip the light to z > 0, multiply its corners by the rows, clip to z > 0 again,
//   E = form factor of that (edge terms / 2 pi; all of the sphere's upper half gives 1),
//   L (f0 (albedo - fresnel) + fresnel) E / above.

struct LtcLobe {
    vec3 row0;      // rows of M^-1, tangent frame to cosine, up to a positive factor
    vec3 row1;
    vec3 row2;
    float above;    // share of the lobe above the surface
    float albedo;   // directional albedo for F = 1
    float fresnel;  // its part under (1 - cos)^5
};

vec4 ltc_slice(sampler3D tex, int z, ivec2 low, vec2 f)
{
    ivec3 place = ivec3(low.x, low.y, z);
    vec4 first = mix(
        FETCH3(tex, place), FETCH3(tex, place + ivec3(1, 0, 0)), f.x);
    vec4 second = mix(
        FETCH3(tex, place + ivec3(0, 1, 0)), FETCH3(tex, place + ivec3(1, 1, 0)), f.x);
    return mix(first, second, f.y);
}

// n, t: nodes and coordinates of azimuth, ratio, view, alpha.
vec4 ltc_quadrilinear(sampler3D tex, ivec4 n, vec4 t)
{
    vec4 one = vec4(1.0, 1.0, 1.0, 1.0);
    vec4 node = clamp(t, one - one, one) * (vec4(n) - one);
    ivec4 low = min(ivec4(node), n - ivec4(2, 2, 2, 2));
    vec4 f = node - vec4(low);
    ivec2 place = ivec2(low.w, low.z);
    vec2 within = vec2(f.w, f.z);
    int z = low.x * n.y + low.y;
    vec4 first = mix(
        ltc_slice(tex, z, place, within), ltc_slice(tex, z + 1, place, within), f.y);
    z += n.y;
    vec4 second = mix(
        ltc_slice(tex, z, place, within), ltc_slice(tex, z + 1, place, within), f.y);
    return mix(first, second, f.x);
}

// alpha_x, alpha_y: the GGX parameters, not their roots; view: unit, to the viewer, z >= 0.
LtcLobe ltc_lobe(
    sampler3D residual_1, sampler3D residual_2, sampler3D albedo,
    float alpha_x, float alpha_y, vec3 view)
{
    float ax = clamp(alpha_x, 1e-4, 1.0);
    float ay = clamp(alpha_y, 1e-4, 1.0);
    vec3 v = view;

    // Coordinates: b is the axis of the smaller alpha.
    float a = max(ax, ay);
    float b = min(ax, ay);
    float va = abs(v.x);
    float vb = abs(v.y);
    float swapped = 0.0;
    if (ay > ax) {
        va = abs(v.y);
        vb = abs(v.x);
        swapped = 1.0;
    }
    float s = length(vec2(va, vb));
    float across = length(vec2(a * va, b * vb));
    float along = a;
    float azimuth = 0.0;
    if (s > 0.0) {
        along = across / s;
        azimuth = vb / (va + vb);
    }
    float p = sqrt(across * s / (1.0 + v.z));
    float r = sqrt(v.z * (1.0 + along));
    float ratio = (sqrt(b / a) - @root@) / (1.0 - @root@);
    vec4 t = vec4(azimuth, ratio, p / (p + r), sqrt(a));
    vec4 x = ltc_quadrilinear(residual_1, ivec4(@n0@, @n1@, @n2@, @n3@), t);
    vec4 y = ltc_quadrilinear(residual_2, ivec4(@n0@, @n1@, @n2@, @n3@), t);
    vec4 stored = ltc_quadrilinear(albedo, ivec4(@m0@, @m1@, @m2@, @m3@), t);

    // I + X: channels p, d, r, e_a, e_b, g_a, g_b.
    float d = x.y * (1.0 - 2.0 * swapped);
    float ex = mix(x.w, y.x, swapped) * v.x;
    float ey = mix(y.x, x.w, swapped) * v.y;
    float gx = mix(y.y, y.z, swapped) * v.x;
    float gy = mix(y.z, y.y, swapped) * v.y;
    vec3 i0 = vec3(1.0 + x.x + d + x.z * v.x * v.x, x.z * v.x * v.y, ex);
    vec3 i1 = vec3(x.z * v.x * v.y, 1.0 + x.x - d + x.z * v.y * v.y, ey);
    vec3 i2 = vec3(gx, gy, 1.0);

    // v' = (vs, vz) and m = (ms, mz) in the plane of e1 and the normal; h: the lobe's centre.
    float n = length(vec2(ax * v.x, ay * v.y));
    float stretched = length(vec2(n, v.z));
    float vs = n / stretched;
    float vz = v.z / stretched;
    vec2 e1 = vec2(1.0, 0.0);
    float mixed = 0.0;
    float skew = (ax - ay) * (ax + ay);
    if (n > 0.0) {
        e1 = vec2(ax * v.x / n, ay * v.y / n);
        mixed = v.x * v.y * skew / n;
    }
    vec2 e2 = vec2(-e1.y, e1.x);
    float tilt = 0.7 * vs * vs / (1.0 + vz);
    float inv = inversesqrt(vs * vs + (vz + tilt) * (vz + tilt));
    float ms = vs * inv;
    float mz = (vz + tilt) * inv;
    vec3 h = vec3(ax * ms * e1.x, ay * ms * e1.y, mz);
    float c = dot(v, h);
    vec3 k = vec3(v.y * h.z - v.z * h.y, v.z * h.x - v.x * h.z, -ms * mixed);

    // alpha_x times rows of R^T D^-1, their products with v and k, and themselves times T^-1.
    float q = ax / ay;
    vec3 p1 = vec3(mz * e1.x, mz * e1.y * q, -ms * ax);
    vec3 p2 = vec3(e2.x, e2.y * q, 0.0);
    vec3 p3 = vec3(ms * e1.x, ms * e1.y * q, mz * ax);
    float turn = skew * e1.x * e1.y * ms * stretched / ay;
    float across1 = (ms * vs + mz * vz) * turn;
    float across2 = stretched / ay * (vz * dot(h.xy, vec2(ax * e1.x, ay * e1.y)) - vs * mz);
    float across3 = -tilt * inv * vs * turn;
    vec3 a1 = c * (c * p1 + dot(p1, v) * h) + across1 * k;
    vec3 a2 = c * (c * p2 + mixed / ay * h) + across2 * k;
    vec3 a3 = c * (c * p3 + dot(p3, v) * h - ax * v) + across3 * k;
    // N^-1 and the diagonal.
    float narrow = 0.5 * (1.0 + vz);
    a1 = a1 * (0.5 / narrow);
    a2 = 0.5 * a2;
    vec3 z0 = e1.x * a1 + e2.x * a2;
    vec3 z1 = e1.y * a1 + e2.y * a2;
    // Columns of the adjugate of I + X are cross products of its rows.
    vec3 c0 = cross(i1, i2);
    vec3 c1 = cross(i2, i0);
    vec3 c2 = cross(i0, i1);

    // The z row of M0, then of M.
    vec2 tz = vec2(ax * (h.z * v.x - v.z * h.x), ay * (h.z * v.y - v.z * h.y));
    float r1 = 2.0 * narrow * (mz * dot(e1, tz) - ms * c);
    float r2 = 2.0 * dot(e2, tz);
    vec3 z_row = vec3(e1.x * r1 + e2.x * r2, e1.y * r1 + e2.y * r2, ms * dot(e1, tz) + mz * c);
    vec3 m_row = z_row.x * i0 + z_row.y * i1 + z_row.z * i2;

    float u = 1.0 - min(stretched * stored.y, 1.0);
    float u2 = u * u;

    LtcLobe lobe;
    lobe.row0 = c0.x * z0 + c1.x * z1 + c2.x * a3;
    lobe.row1 = c0.y * z0 + c1.y * z1 + c2.y * a3;
    lobe.row2 = c0.z * z0 + c1.z * z1 + c2.z * a3;
    lobe.above = 0.5 + 0.5 * m_row.z / length(m_row);
    lobe.albedo = stored.x;
    lobe.fresnel = stored.x * u2 * u2 * u;
    return lobe;
}
"""

_TYPES = r"float|int|i?vec[234]|LtcLobe"
_HLSL = {
    "vec2": "float2",
    "vec3": "float3",
    "vec4": "float4",
    "ivec2": "int2",
    "ivec3": "int3",
    "ivec4": "int4",
    "sampler2D": "Texture2D<float4>",
    "sampler3D": "Texture3D<float4>",
    "mix": "lerp",
    "inversesqrt": "rsqrt",
}
_WGSL = {
    "vec2": "vec2f",
    "vec3": "vec3f",
    "vec4": "vec4f",
    "ivec2": "vec2i",
    "ivec3": "vec3i",
    "ivec4": "vec4i",
    "sampler2D": "texture_2d<f32>",
    "sampler3D": "texture_3d<f32>",
    "float": "f32",
    "int": "i32",
    "inversesqrt": "inverseSqrt",
}


def isotropic_snippet(language: str, residual: int, albedo: int) -> str:
    """Return code for the isotropic table.

    Parameters
    ----------
    language : str
        One of `LANGUAGES`.
    residual, albedo : int
        Texels on each side of the two textures.
    """
    return translate(_filled(_ISOTROPIC, {"residual": residual, "albedo": albedo}), language)


def anisotropic_snippet(
    language: str, residual: Sequence[int], albedo: Sequence[int], root: float
) -> str:
    """Return code for the anisotropic table.

    Parameters
    ----------
    language : str
        One of `LANGUAGES`.
    residual, albedo : four ints
        Nodes by axis, as in `ltc.anisotropic`.
    root : float
        Where the axis of the ratio begins, `ltc.formats.smallest_ratio_root`.
    """
    sizes: dict[str, float] = {f"n{i}": n for i, n in enumerate(residual)}
    sizes |= {f"m{i}": n for i, n in enumerate(albedo)}
    sizes |= {"n01": residual[0] * residual[1], "m01": albedo[0] * albedo[1], "root": root}
    return translate(_filled(_ANISOTROPIC, sizes), language)


def _filled(source: str, sizes: Mapping[str, float]) -> str:
    return re.sub(r"@(\w+)@", lambda found: str(sizes[found[1]]), source)


def translate(source: str, language: str) -> str:
    """Return source of the dialect above in a language.

    Raises
    ------
    ValueError
        If the language is none of `LANGUAGES`.
    """
    if language == "glsl":
        return _fetches(source, "texelFetch({tex}, {place}, 0)")
    if language == "hlsl":
        code = _fetches(source, "{tex}.Load(int{lanes}({place}, 0))")
        code = re.sub(r"^const ", "static const ", code, flags=re.M)
        return _words(code, _HLSL)
    if language == "wgsl":
        code = _fetches(source, "textureLoad({tex}, {place}, 0)")
        code = re.sub(r"^const (\w+) (\w+)", r"const \2: \1", code, flags=re.M)
        code = re.sub(r"^struct \w+ \{.*?^\};", _fields, code, flags=re.M | re.S)
        code = re.sub(r"^(\w+) (\w+)\(([^)]*)\)$", _signature, code, flags=re.M)
        code = re.sub(rf"^( +)({_TYPES}) (\w+)( =|;)", r"\1var \3: \2\4", code, flags=re.M)
        return _words(code, _WGSL)
    raise ValueError(f"language is {language!r}, expected one of {', '.join(LANGUAGES)}")


def _fetches(source: str, form: str) -> str:
    """Replace FETCH2(texture, place) and FETCH3 by a language's own reads of a texel."""
    result, at = "", 0
    for found in re.finditer(r"FETCH([23])\((\w+), ", source):
        end, depth = found.end(), 1
        while depth:
            depth += {"(": 1, ")": -1}.get(source[end], 0)
            end += 1
        place = source[found.end() : end - 1]
        result += source[at : found.start()]
        result += form.format(tex=found[2], place=place, lanes=int(found[1]) + 1)
        at = end
    return result + source[at:]


def _words(source: str, names: Mapping[str, str]) -> str:
    """Replace words of the code, not of its comments."""
    pieces = re.split(r"(//[^\n]*)", source)
    for i in range(0, len(pieces), 2):
        pieces[i] = re.sub(r"\w+", lambda found: names.get(found[0], found[0]), pieces[i])
    return "".join(pieces)


def _fields(struct: re.Match[str]) -> str:
    text = re.sub(r"^( +)(\w+) (\w+);", r"\1\3: \2,", struct[0], flags=re.M)
    return text.removesuffix(";")


def _signature(found: re.Match[str]) -> str:
    parameters = [parameter.split() for parameter in found[3].split(",")]
    listed = ", ".join(f"{name}: {kind}" for kind, name in parameters)
    return f"fn {found[2]}({listed}) -> {found[1]}"
