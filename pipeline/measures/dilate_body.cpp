// Dilation by an exact Euclidean distance.
#include "pipeline/measures/dilate_body.h"

#include "pipeline/measures/measures.h"

namespace kvx {

Mask DilateBody::Run(const Inputs& inputs, const Options& options, StageContext&) {
  return Dilated(*inputs.body, options.margin_mm);
}

}  // namespace kvx
