// How far off tissue may be where the images show too little of it, so that its place is carried over from
// what lies around it.
#pragma once
#include "pipeline/registration/images/shared_slopes.h"

namespace kvx {

// mm^2, summed over the axes, per block: the least that any cube of blocks around it leaves open. The wider
// the cube, the more both images show of it, but the more may tissue bend between its middle and what they
// show, or, where they show nothing on one side as at the end of a view, move on. How much it does is read
// from how it has moved in this scan. `moved_mm`: per block, how far it lies from where the bones alone would
// put it; not a number outside the body.
Volume CarriedVariancesMm2(const Image<SharedSlopes>& slopes, const Image<Eigen::Vector3f>& moved_mm);

}  // namespace kvx
