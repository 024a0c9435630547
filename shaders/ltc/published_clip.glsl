// A variant of `ltc` to measure, as published (Heitz et al. 2016): lights are cut where the lobe's
// own cosine ends, not at the surface, so that light leaks in from below it.
// Twin: app.render.truth.exact_radiance.

vec2 form_factors_at(PlanarLight light, SurfacePoint point, CosineTransform specular)
{
    PlaneView view = plane_view(light, point.position);
    vec2 factors = vec2(0.0);
#if HAS_SPECULAR
    // The third row of the lobe's cosine_from_world.
    mat3 points = specular.points;
    vec3 up = normalize(vec3(points[0].z, points[1].z, points[2].z));
    if (!is_unseen(light, view, up)) {
        factors.x = light_form_factor(light, specular, view, up);
    }
#endif
#if HAS_DIFFUSE
    vec3 normal = point.world_from_shading[2];
    if (!is_unseen(light, view, normal)) {
        mat3 shading_from_world = transpose(point.world_from_shading);
        CosineTransform diffuse = CosineTransform(shading_from_world, shading_from_world);
        factors.y = light_form_factor(light, diffuse, view, normal);
    }
#endif
    return clamp(light_winding(view) * factors, 0.0, 1.0);
}
