// How remote a place is from a bone's strokes: about 1 where a bone usually ends, more outside.
#pragma once
#include "core/image.h"

namespace kvx {

// By the distance from the nearest stroke, in the spacing and the spread of the strokes.
Image<float> RemotenessFromLines(const Mask& strokes);
// By the distance outside the hull of all strokes, in their mean spread. Stricter between and beside them;
// wrong for a bone that is hollow, or drawn at one end only.
Image<float> RemotenessFromHull(const Mask& strokes);

}  // namespace kvx
