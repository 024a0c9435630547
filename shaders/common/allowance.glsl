// How much radiance may be left out at a point without anybody seeing it.
//
// Every light brings an equal part of what is allowed in all; what one does not use up serves
// those after it. So the sum of the bounds of all that is skipped, and with it the error, stays
// within what was allowed, whatever the lights and their order.

float allowance_per_light = 0.0;  // set by the pass
float allowance = 0.0;            // what is left of it now

void allow_for_a_light()
{
    allowance += allowance_per_light;
}

// Whether a contribution of at most `most` is skipped; then that is used up. Where nothing is
// allowed nothing is skipped, not even nothing.
bool is_skipped(float most)
{
    bool skipped = allowance > 0.0 && most <= allowance;
    allowance -= skipped ? most : 0.0;
    return skipped;
}
