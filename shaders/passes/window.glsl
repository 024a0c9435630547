// The part of the picture that is drawn: all of it moved by a fraction of a pixel,
// or a single pixel. (scale.xy, offset.xy) in normalised device coordinates.

vec4 to_window(vec4 clip, vec4 window)
{
    return vec4(clip.xy * window.xy + window.zw * clip.w, clip.zw);
}
