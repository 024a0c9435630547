// What full coverage, and a picture's largest value, are stored as: half floats then hold a
// coverage of 1e-8. Twin: ltc.prefilter.HALF_SCALE.

const float PICTURE_ONE = 16384.0;
