// Ordered dither to 8 bits: the 8x8 matrix of Bayer 1973, "An optimum method for
// two-level rendition of continuous-tone pictures". Integers only, so every GPU and
// every context agree. Twin: app.render.tone_map.quantise.

// Threshold in (0, 1) of a pixel counted from the bottom left.
float bayer_threshold(ivec2 pixel)
{
    int x = pixel.x ^ pixel.y;
    int y = pixel.y;
    int rank = ((x & 1) << 5) | ((y & 1) << 4) |
               ((x & 2) << 2) | ((y & 2) << 1) |
               ((x & 4) >> 1) | ((y & 4) >> 2);
    return (float(rank) + 0.5) / 64.0;
}

// Code values in [0, 1] to multiples of 1/255, less than 1/255 away; 0 and 1 stay.
vec3 quantise(vec3 code, ivec2 pixel)
{
    return floor(code * 255.0 + bayer_threshold(pixel)) / 255.0;
}
