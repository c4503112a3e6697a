// Bones of which a part moved otherwise than the rest: two bones under one label, or a scan spoilt there.
#pragma once
#include <span>

#include "core/pose.h"
#include "pipeline/bones/template/bone_tissue.h"

namespace kvx {

// Makes them doubtful. `tissue`: of each bone, sampled in the scan's contrast. What a scan does not show of a
// bone, and parts without structure, say nothing.
void NameUnlikeParts(const BoneSet& bones, std::span<const BoneTissue> tissue, const CubicImage& scan,
                     BoneFits& fits);

}  // namespace kvx
