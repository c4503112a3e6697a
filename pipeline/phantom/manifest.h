// manifest.json and study.json of a phantom: all that is known of it, in the files' NIfTI world (RAS) and
// degrees.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "pipeline/phantom/truth_points.h"

namespace kvx::phantom {

struct PoseRecord {
  PhantomPose pose;
  BodyModel::Posed posed;         // nodes may be empty
  double in_fov = 0, hidden = 0;  // shares of the truth points
  MapFaults faults;
  double soft_vs_blend_mm = 0;  // mean distance of soft points from a blend of the bones by distance
};

struct ManifestInputs {
  const Anatomy& anatomy;
  const Scanner& scanner;
  const TissueModel& tissues;
  const LabelMap& bone_labels;
  uint64_t seed;
  double material_mm, snr;
  const std::vector<PoseRecord>& poses;
};

std::string PoseFileStem(int index);  // "pose03"
nlohmann::ordered_json Manifest(const ManifestInputs& inputs);
nlohmann::ordered_json StudyFile(const Anatomy& anatomy, const std::string& name,
                                 const std::vector<PoseRecord>& poses);

}  // namespace kvx::phantom
