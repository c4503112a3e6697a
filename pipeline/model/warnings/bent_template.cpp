// Angles between the long axes of bones that meet, in the template and in each scan.
#include "pipeline/model/warnings/bent_template.h"

#include <algorithm>
#include <cmath>

#include "pipeline/model/scan_verdict.h"

namespace kvx {
namespace {

constexpr double kLongOfWide = 1.6;  // over both other sides; a bone so long has a long axis
constexpr double kEveryScanRad = RadFromDeg(10), kStraightestRad = RadFromDeg(25),
                 kSomeJointRad = RadFromDeg(45);

bool HasLongAxis(const Bone& bone) {
  const Eigen::Vector3d& mm = bone.box.extent_mm;
  return mm[0] > kLongOfWide * std::max(mm[1], mm[2]);
}

double BendRad(const Bone& parent, const Bone& child, const Eigen::Quaterniond& parent_from_child) {
  const Eigen::Vector3d along = parent.box.axes.col(0), next = parent_from_child * child.box.axes.col(0);
  return std::atan2(along.cross(next).norm(), along.dot(next));
}

// By how much a scan has the joints straighter than the template; negative where it bends them.
struct Straighter {
  double mean_rad = 0, most_rad = 0;
  int joints = 0;
};

Straighter StraighterBy(const BoneSet& bones, const Skeleton& skeleton, const BoneFits& scan) {
  Straighter out;
  for (const Joint& joint : skeleton.joints) {
    if (joint.parent == kNoParent || joint.dofs.empty()) continue;
    const size_t c = size_t(joint.child), p = size_t(joint.parent);
    const Bone &child = bones.bones[c], &parent = bones.bones[p];
    if (!HasLongAxis(child) || !HasLongAxis(parent) || scan[c].Doubtful() || scan[p].Doubtful()) continue;
    const RigidTransform moved = scan[p].scan_from_template.Inverse() * scan[c].scan_from_template;
    const double by_rad =
        BendRad(parent, child, Eigen::Quaterniond::Identity()) - BendRad(parent, child, moved.rotation);
    out.mean_rad += by_rad, out.most_rad = std::max(out.most_rad, by_rad), ++out.joints;
  }
  out.mean_rad /= std::max(1, out.joints);
  return out;
}

}  // namespace

std::vector<std::string> BentTemplateWarnings(const std::string& template_name, const BoneSet& bones,
                                              const Skeleton& skeleton,
                                              const std::vector<std::string>& scan_names,
                                              std::span<const BoneFits> scans) {
  Straighter straightest;
  std::string its_name;
  for (size_t k = 0; k < scans.size(); ++k) {
    if (VerdictOf(bones, scans[k]).kind != ScanVerdict::Kind::kBelongs) continue;
    const Straighter by = StraighterBy(bones, skeleton, scans[k]);
    if (by.joints == 0) continue;
    if (by.mean_rad < kEveryScanRad) return {};
    if (by.mean_rad > straightest.mean_rad) straightest = by, its_name = scan_names[k];
  }
  if (straightest.mean_rad < kStraightestRad || straightest.most_rad < kSomeJointRad) return {};
  return {
      "the template '" + template_name + "' is bent more than every scan; '" + its_name +
      "' is straighter by " + std::to_string(std::lround(DegFromRad(straightest.mean_rad))) +
      " degrees at a joint on average. Tissue that a bent template shows in creases is placed with larger "
      "errors; with a label map made on it, '" +
      its_name + "' may be the better template"};
}

}  // namespace kvx
