// The greatest of a colour's channels.

float greatest(vec3 v)
{
    return max(v.x, max(v.y, v.z));
}
