// A tiny study with a closed-form truth: two bones in a textured limb that bends about one hinge.
#pragma once
#include <filesystem>

#include "core/image.h"
#include "core/rigid_transform.h"

namespace kvx::testing_support {

struct HingePose {
  double flexion_rad = 0;          // of the lower bone about the hinge
  RigidTransform scan_from_upper;  // whole-body motion
};

class Hinge {
 public:
  // Template world: limb along z, hinge at `centre` about `axis`, bones above and below it.
  static PointMm Centre();
  static Eigen::Vector3d Axis();
  static Grid ScanGrid();

  static RigidTransform ScanFromLower(const HingePose& pose);
  // Where a template point goes: rigid with the bones, blended in a thin slab at the hinge.
  static PointMm Moved(const PointMm& in_template, const HingePose& pose);
  static Volume ScanOf(const HingePose& pose);
  static LabelMap Labels();  // 1 upper, 2 lower
};

// The poses of the study below, template first.
std::vector<HingePose> HingePoses();
// Writes pose00.nii.gz (template), pose01.nii.gz, pose02.nii.gz, bones.nii.gz and study.json; returns the
// path of study.json.
std::filesystem::path WriteHingeStudy(const std::filesystem::path& folder);

}  // namespace kvx::testing_support
