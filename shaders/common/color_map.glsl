// Colours for numbers. `map_colors` are a map of app/colour_maps.py, whose colours_at
// is the twin.

uniform vec3 map_colors[MAP_COLORS];  // sRGB, 0 to 1

// `place`: from one end of the map, 0, to the other, 1; beyond them the ends' colours.
vec3 map_color(float place)
{
    float at = clamp(place, 0.0, 1.0) * float(MAP_COLORS - 1);
    int low = min(int(at), MAP_COLORS - 2);
    return mix(map_colors[low], map_colors[low + 1], at - float(low));
}
