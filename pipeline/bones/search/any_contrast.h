// How a scan of another contrast shows the template's greys, learnt without knowing where anything is.
#pragma once
#include <optional>

#include "core/pose.h"
#include "pipeline/bones/search/bone_search.h"
#include "pipeline/scans/contrast_map.h"

namespace kvx {

// Air around the body (`OuterAir`), on voxels of about those at which the root is looked for.
struct SeenAir {
  Volume in_template, in_scan;
};

struct LearntContrast {
  ContrastMap scan_of_template;
  RigidTransform root;  // scan_from_template, where it was learnt
  double nats = 0;      // for that place
};

// The root is looked for where the template's greys tell the scan's best, by whatever curve (correlation
// ratio, Roche et al. 1998) and air lies where it shows air; the curve is then read there. Nothing where the
// root is not found so, or where a rising line does as well.
std::optional<LearntContrast> LearnContrast(const BoneSearch& search, const Volume& template_volume,
                                            const Volume& scan, const SeenAir& air, Backend& backend);
// The same curve from all bones that were found without doubt: these have more kinds of tissue around them.
std::optional<ContrastMap> ContrastOfBones(const BoneSearch& search, const BoneFits& fits,
                                           const Volume& template_volume, const Volume& scan);

}  // namespace kvx
