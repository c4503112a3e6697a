// Bones of which the same is to be said share a line, so that what stands out is seen: a scan that is lost
// has twenty doubtful bones, and of a hand at coarse voxels most are known less than surely.
#include "pipeline/model/warnings/bone_warnings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/text/listed.h"
#include "core/text/sayings.h"
#include "pipeline/model/scan_verdict.h"
#include "pipeline/skeleton/bone_certainty.h"

namespace kvx {

namespace {

constexpr double kMuchUnsure = 0.25;  // of the body; phantoms without added noise have a sixth at most
constexpr double kMuchLess = 0.03;    // of a measure; noise and sampling take less

// "scan 'a', bones 'x', 'y' are doubtful: ..."
std::vector<std::string> Lines(const std::string& scan, const Sayings& doubtful) {
  std::vector<std::string> lines;
  for (const auto& [note, bones] : doubtful.all()) {
    const bool one = bones.size() == 1;
    const std::string names = Listed(bones, [](const std::string& name) { return "'" + name + "'"; });
    lines.push_back("scan '" + scan + (one ? "', bone " : "', bones ") + names +
                    (one ? " is doubtful: " : " are doubtful: ") + note);
  }
  return lines;
}

bool IsUncertain(const BoneSet& bones, const BoneFits& fits, size_t bone) {
  return fits[bone].doubt != Doubt::kBone &&
         CertaintyOf(bones.bones.at(bone), fits[bone], bones.labels.grid.MeanSpacingMm()) ==
             Certainty::kUncertain;
}

}  // namespace

std::vector<std::string> BoneWarnings(const std::string& scan, const BoneSet& bones, const BoneFits& fits) {
  const ScanVerdict verdict = VerdictOf(bones, fits);
  Sayings doubtful;
  std::vector<std::string> uncertain;
  for (size_t j = 0; j < fits.size(); ++j) {
    const std::string& name = bones.bones.at(j).name;
    if (fits[j].doubt == Doubt::kBone) doubtful.Add(name, fits[j].note);
    if (IsUncertain(bones, fits, j)) uncertain.push_back(name);
  }
  std::vector<std::string> warnings = Lines(scan, doubtful);
  if (!verdict.note.empty()) warnings.insert(warnings.begin(), "scan '" + scan + "': " + verdict.note);
  if (!uncertain.empty())
    warnings.push_back(
        "scan '" + scan +
        "': these bones may well be turned by more than 1.5 degrees or lie half a voxel off; " +
        "look before relying on them, and give initial poses for those that are wrong: " + Listed(uncertain));
  const std::string coarse = CoarseBonesText(bones, fits);
  if (!coarse.empty()) warnings.push_back("scan '" + scan + "': " + coarse);
  return warnings;
}

std::string UncertainBonesAdvice(const BoneSet& bones, const std::vector<BoneFits>& scans) {
  for (const BoneFits& fits : scans) {
    for (size_t j = 0; j < fits.size(); ++j) {
      if (IsUncertain(bones, fits, j))
        return "of uncertain bones one in ten or more is not right: lay 'kinevox pose MODEL --scan NAME "
               "--label' over the scan, and give initial poses (initial_poses of the study) for those that "
               "are wrong";
    }
  }
  return {};
}

std::vector<std::string> TemplateWarnings(const BoneSet& bones, const std::vector<BoneFits>& scans) {
  const bool any_belongs = std::ranges::any_of(scans, [&](const BoneFits& fits) {
    return VerdictOf(bones, fits).kind == ScanVerdict::Kind::kBelongs;
  });
  if (scans.size() < 2 || any_belongs) return {};
  return {
      "no scan fits the template: it may be the template that is mirrored, another person's or of wrong "
      "voxel sizes, or its label map was made on another scan; check it, or choose another template"};
}

std::vector<std::string> UnusedHintWarnings(const std::string& scan, const BoneSet& bones,
                                            const BoneFits& fits, const PoseHints& hints) {
  std::vector<std::string> unused;
  for (const auto& [name, hint] : hints) {
    const int j = bones.IndexOf(name);
    const Bone& bone = bones.bones.at(j);
    const RigidTransform& found = fits.at(j).scan_from_template;
    if (IsNearHint(bone, hint, found)) continue;
    const double turn_rad = (hint * found.Inverse()).AngleRad();
    const double shift_mm = ((hint * bone.centroid).lps - (found * bone.centroid).lps).norm();
    char apart[60];
    std::snprintf(apart, sizeof apart, " (%.0f degrees and %.0f mm)", DegFromRad(turn_rad), shift_mm);
    unused.push_back(name + apart);
  }
  if (unused.empty()) return {};
  return {"scan '" + scan +
          "': these bones were found where they match the scan better or suit the bones beside them, so far "
          "from the initial poses given for them, which were not used; check the initial poses, which are "
          "scan_from_template, LPS mm: " +
          Listed(unused)};
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

std::vector<std::string> UnsureTissueWarnings(const std::string& scan, double part) {
  if (part < kMuchUnsure) return {};
  return {"scan '" + scan + "': where tissue went is not sure in " + std::to_string(std::lround(100 * part)) +
          " % of the body, outside the scan's view, or since ghosts, motion, noise or shading hide it; "
          "'kinevox field --scan --confidence', or of a service's model '/registration?map=confidence', "
          "shows where"};
}

std::vector<std::string> LessAlikeWarnings(const std::string& scan,
                                           const std::map<std::string, Measures>& by_stage) {
  const Measures &bones = by_stage.at("initialise"), &all = by_stage.at("register");
  const bool less = all.ssd > (1 + kMuchLess) * bones.ssd && all.cc < (1 - kMuchLess) * bones.cc &&
                    all.mi < (1 - kMuchLess) * bones.mi;
  if (!less) return {};
  return {
      "scan '" + scan +
      "': registration left it less like the template than the bones alone did, so tissue away from bones "
      "may be far off in it; look at both ('kinevox evaluate --pictures'), and leave the scan out of the "
      "study where they do not fit"};
}

std::string HiddenTissueText(const std::string& scan, double part) {
  const long percent = std::max(1L, std::lround(100 * part));
  if (percent == 100)
    return "scan '" + scan + "': posing does without it, as it does not show where its bones are";
  return "scan '" + scan +
         "': doubtful bones match too badly for posing to learn from the tissue near them; in " +
         std::to_string(percent) + " % of the body the other scans alone decide";
}

}  // namespace kvx
