// Whether a scan shows the template's bones in another size: one of the two voxel sizes is wrong, or the scan
// is another person's.
#pragma once
#include "core/pose.h"
#include "pipeline/bones/template/bone_template.h"

namespace kvx {

// Makes all bones of such a scan doubtful, and says why. `seen`: the template in the scan's contrast.
void NameAnotherSize(const BoneSet& bones, const SeenTemplate& seen, const CubicImage& scan, BoneFits& fits);

}  // namespace kvx
