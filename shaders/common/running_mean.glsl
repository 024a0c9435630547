// A mean of very many samples in float32. Alone it is off by a unit or more in the last place
// each time, which after a million samples is 1e-5 of it, and once 1 / samples is below 1e-7 it
// stands still; what rounding took is therefore carried along. Twin: tests/gl/test_noise.py.

// The mean with one more value of the given weight, 1 / samples. `rest` is what rounding took
// from the mean before, and then from the new one (Knuth's TwoSum).
vec4 next_mean(vec4 mean, inout vec4 rest, vec4 value, float weight)
{
    precise vec4 step = ((value - mean) - rest) * weight + rest;
    precise vec4 sum = mean + step;
    precise vec4 back = sum - mean;
    rest = (mean - (sum - back)) + (step - back);
    return sum;
}
