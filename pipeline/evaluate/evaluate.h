// How good a model is: the paper's measures, and distances from the truth where it is known.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/evaluate/leave_one_out.h"
#include "pipeline/evaluate/truth.h"

namespace kvx {

// Distances between mapped and true points, mm (MED: mean Euclidean distance).
struct Distances {
  int64_t points = 0;        // counted: in the field of view and mapped to somewhere
  double lost_fraction = 0;  // of those in the field of view, mapped to nowhere
  // NaN where there is no such point. MED of all; of soft tissue; of soft tissue within 10 mm of a joint.
  double all = 0, soft = 0, joint = 0;
  double p95 = 0, max = 0;
  std::map<std::string, double> by_tissue;  // MED
};

struct BoneError {
  std::string bone;
  double rotation_deg = 0;
  double translation_mm = 0;  // at the bone's centroid
};

struct ScanEvaluation {
  std::string name;
  std::map<std::string, Measures> measures;  // by stage: source, initialise, register
  int64_t control_points = 0;
  std::vector<int64_t> control_points_per_level;  // coarse to fine (paper, section 6.1)
  double folded_fraction = 0;
  std::map<std::string, double> folded_by_stage;  // of the body: source, initialise, register
  std::map<std::string, Distances> distances;     // by stage; empty without truth
  std::vector<BoneError> bone_errors;             // empty without truth
  std::optional<ConfidenceSummary> confidence;    // as the method states it
  // Of the registration, in voxels of the body where it is sure and where not; empty without truth.
  std::map<std::string, Distances> by_confidence;  // sure, unsure
};

// A pose the model has not learnt from, set by its true bone motions.
struct UnseenEvaluation {
  std::string name;
  double extrapolation = 0;                    // largest over the bones, see PoseSpace
  std::map<std::string, Distances> distances;  // by mode
};

struct Evaluation {
  std::vector<ScanEvaluation> scans;
  std::vector<UnseenEvaluation> unseen;
  std::vector<LeftOutEvaluation> left_out;
  std::map<std::string, double> seconds;  // of the build, by stage
  std::vector<std::string> warnings;
};

Distances Compare(const TruthPoints& truth, const std::vector<PointMm>& mapped,
                  const std::vector<std::string>& tissues);
BoneError Compare(const std::string& bone, const RigidTransform& found, const RigidTransform& truth,
                  const PointMm& centroid);

// `truth` may be absent: then only what the model itself knows. `engine` may be null when there is no truth.
// Throws InputError where the truth is of another template.
Evaluation Evaluate(Backend& backend, const Model& model, const PosingEngine* engine, const Truth* truth,
                    const Progress& progress);

}  // namespace kvx
