// The body, dilated.
#include "pipeline/measures/dilate_body.h"

#include "core/voxels/dilated.h"

namespace kvx {

Mask DilateBody::Run(const Inputs& inputs, const Options& options, StageContext&) {
  return Dilated(*inputs.body, options.margin_mm);
}

}  // namespace kvx
