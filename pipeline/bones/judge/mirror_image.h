// The other hand or leg, or a scan that a tool flipped: mirror images of a whole scan and of single bones.
#pragma once
#include "core/pose.h"
#include "pipeline/bones/template/sought_bones.h"

namespace kvx {

// The mirror image across the plane between the patient's left and right, through the middle of the scan. The
// grid is left-handed where it was right-handed.
Volume Mirrored(Volume scan);

// By how much more evidence the mirror images of the largest bones that are not doubtful lie where these were
// found, each turned and shifted to fit, than the bones themselves; below 0 where the bones fit better.
double MirrorNats(const SoughtBones& sought, const Volume& scan, const BoneFits& fits);

}  // namespace kvx
