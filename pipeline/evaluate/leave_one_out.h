// What a model predicts of a scan that its pose space has not seen.
#pragma once
#include <map>

#include "pipeline/model/model.h"

namespace kvx {

// One scan taken out of the pose space, and predicted from the others: distance from its registered
// correspondence over the body.
struct LeftOutEvaluation {
  std::string name;
  std::map<DeformationMode, double> distance_mm;  // MED
};

// Joint centres and axes stay those of the whole study; what is left out is the example and its place in pose
// space.
std::vector<LeftOutEvaluation> LeaveOneOut(const Model& model, const PosingEngine& engine,
                                           const Progress& progress);

}  // namespace kvx
