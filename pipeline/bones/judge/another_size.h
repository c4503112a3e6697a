// Whether a scan shows the template's bones in another size: one of the two voxel sizes is wrong, or the scan
// is another person's.
#pragma once
#include <span>

#include "core/pose.h"
#include "pipeline/bones/template/bone_tissue.h"

namespace kvx {

// Makes all bones of such a scan doubtful, and says why. `tissue`: of each bone, sampled in the scan's
// contrast.
void NameAnotherSize(const BoneSet& bones, std::span<const BoneTissue> tissue, const CubicImage& scan,
                     BoneFits& fits);

}  // namespace kvx
