// The truth that comes with a phantom: bone motions and material points of every pose, in our frames (LPS
// mm).
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/rigid_transform.h"

namespace kvx {

struct TruthPose {
  std::string name;                                          // as the scan in the study: "pose01"
  std::map<std::string, RigidTransform> scan_from_template;  // by bone name
  std::filesystem::path points;
  bool bent_for_a_pair = false;  // the paper's Table 2: compared where it is a scan, asked from no model
};

struct Truth {
  std::vector<std::string> tissues;               // names by number
  std::map<std::string, PointMm> bone_centroids;  // template world
  std::vector<TruthPose> poses;
};

// How the scans of a model and the poses of a truth go together: by their names alone.
struct MatchedNames {
  std::vector<std::string> without_truth;  // scans, the template among them
  // Poses that the model has not learnt from. None where a scan is without truth: it may be one of them.
  std::vector<size_t> unseen;
};
// Throws InputError where the truth's template is another pose than the model's.
MatchedNames MatchNames(const Truth& truth, const std::string& template_scan,
                        const std::vector<std::string>& scans);

// Material points, index for index.
struct TruthPoints {
  std::vector<PointMm> in_template, in_scan;
  std::vector<uint8_t> tissue;
  std::vector<uint8_t> bone;             // label, 0 = soft tissue
  std::vector<uint8_t> counts;           // 1: inside the scan's field of view and not hidden by other tissue
  std::vector<float> joint_distance_mm;  // to the nearest joint, in the template
};

// `folder` holds manifest.json and the points files it names; both are in RAS, as NIfTI. Throws NotFound,
// InputError.
Truth ReadTruth(const std::filesystem::path& folder);
TruthPoints ReadTruthPoints(const TruthPose& pose);

}  // namespace kvx
