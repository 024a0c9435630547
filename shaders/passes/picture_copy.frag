// A texture into its place in the atlas. `source_size` is what is repeated, or whose edge goes
// on, in the border around it.

uniform sampler2D source;
uniform ivec2 source_size;
uniform ivec2 corner;   // in the target, of texel (0, 0)
uniform bool tiles;
uniform vec2 factors;   // of colour and alpha

layout(location = 0) out vec4 value;

void main()
{
    ivec2 place = ivec2(gl_FragCoord.xy) - corner;
    place = tiles ? (place + source_size) % source_size : clamp(place, ivec2(0), source_size - 1);
    value = texelFetch(source, place, 0) * factors.xxxy;
}
