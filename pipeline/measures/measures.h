// SSD, CC and MI between the template carried into a scan's pose and the scan,
// inside the template's body mask.
#pragma once
#include "core/image.h"
#include "core/measures.h"
#include "kernels/device/backend.h"
#include "pipeline/measures/similarity.h"

namespace kvx {

// Two images to compare, which outlive this, and how their greys are scaled.
struct ComparedImages {
  ComparedImages(const Volume& template_volume, const Volume& scan);
  const Volume &template_volume, &scan;
  ByteScale template_scale, scan_scale;
};

// `body_dilated`: body mask of the template dilated by 3 mm. At every such template voxel v the pair
// (template(v), scan(v + u(v))) is compared; voxels that land outside the scan do not count; where all of
// them do, the worst values come back (SSD 255, CC 0, MI 0). Intensities are scaled to 0..255: see
// ByteScaleOf.
Measures Measure(Backend& backend, const ComparedImages& images, const Mask& body_dilated,
                 const DisplacementField& scan_from_template);

}  // namespace kvx
