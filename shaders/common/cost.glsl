// How often the contour integral is evaluated: once an edge in closed form, once a node of a
// quadrature. Programs that do not show it count nothing.

#if COUNTS_EVALUATIONS
int evaluations = 0;

void count_evaluations(int more)
{
    evaluations += more;
}
#else
void count_evaluations(int more)
{
}
#endif
