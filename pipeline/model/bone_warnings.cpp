// Most bones of a hand at coarse voxels are known less than surely: they share a line, so that those that
// stand out are seen.
#include "pipeline/model/bone_warnings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "pipeline/skeleton/bone_certainty.h"

namespace kvx {

std::vector<std::string> BoneWarnings(const std::string& scan, const BoneSet& bones, const BoneFits& fits) {
  std::vector<std::string> warnings;
  std::string uncertain;
  for (size_t j = 0; j < fits.size(); ++j) {
    const Bone& bone = bones.bones.at(j);
    const Certainty certainty = CertaintyOf(bone, fits[j], bones.labels.grid.MeanSpacingMm());
    if (certainty == Certainty::kDoubtful)
      warnings.push_back("scan '" + scan + "', bone '" + bone.name + "' is doubtful: " + fits[j].note);
    else if (certainty == Certainty::kUncertain)
      uncertain += (uncertain.empty() ? "" : ", ") + bone.name;
  }
  if (!uncertain.empty())
    warnings.push_back(
        "scan '" + scan +
        "': these bones may well be turned by more than 1.5 degrees or lie half a voxel off; " +
        "look before relying on them: " + uncertain);
  const std::string coarse = CoarseBonesText(bones, fits);
  if (!coarse.empty()) warnings.push_back("scan '" + scan + "': " + coarse);
  return warnings;
}

std::vector<std::string> UnusedHintWarnings(const std::string& scan, const BoneSet& bones,
                                            const BoneFits& fits,
                                            const std::map<std::string, RigidTransform>& hints) {
  std::vector<std::string> warnings;
  for (const auto& [name, hint] : hints) {
    const int j = bones.IndexOf(name);
    const Bone& bone = bones.bones.at(j);
    const RigidTransform& found = fits.at(j).scan_from_template;
    const double turn_rad = (hint * found.Inverse()).AngleRad();
    const double shift_mm = ((hint * bone.centroid).lps - (found * bone.centroid).lps).norm();
    const double apart_mm = std::hypot(shift_mm, bone.box.extent_mm.maxCoeff() / std::sqrt(12.0) * turn_rad);
    if (apart_mm <= 0.5 * bone.box.extent_mm.minCoeff()) continue;
    char apart[60];
    std::snprintf(apart, sizeof apart, "%.0f degrees and %.0f mm", DegFromRad(turn_rad), shift_mm);
    warnings.push_back("scan '" + scan + "': the initial pose of bone '" + name +
                       "' was not used; the bone was found where it matches the scan better, " + apart +
                       " from it. Check the initial pose: it is scan_from_template, LPS mm");
  }
  return warnings;
}

std::string CoarseBonesText(const BoneSet& bones, const BoneFits& fits) {
  const double voxel_mm = bones.labels.grid.MeanSpacingMm();
  size_t count = 0;
  PoseBounds widest;
  for (size_t j = 0; j < fits.size(); ++j) {
    const Bone& bone = bones.bones.at(j);
    if (CertaintyOf(bone, fits[j], voxel_mm) != Certainty::kCoarse) continue;
    const PoseBounds bounds = BoundsOf(bone, fits[j]);
    widest.turn_rad = std::max(widest.turn_rad, bounds.turn_rad);
    widest.surface_mm = std::max(widest.surface_mm, bounds.surface_mm);
    ++count;
  }
  if (count == 0) return {};
  char size[40];
  std::snprintf(size, sizeof size, "%.1f mm", voxel_mm);
  return "at voxels of " + std::string(size) + " and this noise, " + std::to_string(count) + " of " +
         std::to_string(fits.size()) + " bones may be " + Text(widest) +
         "; the model's document (JSON) states it for each";
}

}  // namespace kvx
