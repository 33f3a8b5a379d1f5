// Tolerances of grains; as in vdi/reference/Segmenter.h.

const int toleranceLevels = 8;
const float finestTolerance = 0.002;
const float toleranceRatio = 4.0;
const float unlimitedTolerance = 3.4e38;
