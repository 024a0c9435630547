// Tone maps: linear Rec. 709, 0 or more, to linear Rec. 709 in [0, 1].
// Sources and float64 twins: app/render/tone_map.py. Each exists only if its
// feature asks for it.

#if TONE_MAP_AGX
vec3 tone_map_agx(vec3 color)
{
    // Columns. Rec. 709 to Rec. 2020 (ITU-R BT.2407), and AgX's inset and outset.
    const mat3 rec2020_from_rec709 = mat3(
        0.6274, 0.0691, 0.0164, 0.3293, 0.9195, 0.0880, 0.0433, 0.0113, 0.8956);
    const mat3 rec709_from_rec2020 = mat3(
        1.6605, -0.1246, -0.0182, -0.5876, 1.1329, -0.1006, -0.0728, -0.0083, 1.1187);
    const mat3 inset = mat3(
        0.856627153315983, 0.137318972929847, 0.11189821299995,
        0.0951212405381588, 0.761241990602591, 0.0767994186031903,
        0.0482516061458583, 0.101439036467562, 0.811302368396859);
    const mat3 outset = mat3(
        1.1271005818144368, -0.1413297634984383, -0.14132976349843826,
        -0.11060664309660323, 1.157823702216272, -0.11060664309660294,
        -0.016493938717834573, -0.016493938717834257, 1.2519364065950405);
    const float min_ev = -12.47393;
    const float max_ev = 4.026069;

    vec3 v = inset * (rec2020_from_rec709 * color);
    vec3 x = clamp((log2(max(v, 1e-10)) - min_ev) / (max_ev - min_ev), 0.0, 1.0);
    // Wrensch's polynomial for the default contrast, in Horner form.
    vec3 y = 15.5 * x - 40.14;
    y = y * x + 31.96;
    y = y * x - 6.868;
    y = y * x + 0.4298;
    y = y * x + 0.1191;
    y = y * x - 0.00232;
    vec3 linear = pow(max(outset * y, 0.0), vec3(2.2));
    return clamp(rec709_from_rec2020 * linear, 0.0, 1.0);
}
#endif

#if TONE_MAP_ACES
vec3 tone_map_aces(vec3 color)
{
    const mat3 into = mat3(
        0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    const mat3 back = mat3(
        1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    vec3 v = into * color;
    vec3 fit = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return clamp(back * fit, 0.0, 1.0);
}
#endif

#if TONE_MAP_REINHARD
vec3 tone_map_reinhard(vec3 color)
{
    float luminance = dot(color, vec3(0.2126, 0.7152, 0.0722));
    return min(color / (1.0 + luminance), 1.0);
}
#endif

#if TONE_MAP_NONE
vec3 tone_map_none(vec3 color)
{
    return min(color, 1.0);
}
#endif
