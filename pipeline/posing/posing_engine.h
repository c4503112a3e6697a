// EVD (eq. 6): v_a = E(v_0 + d_a), as posed volumes on a regular grid and as posed points.
#pragma once
#include <optional>

#include "core/blend.h"
#include "core/scan.h"
#include "kernels/backend.h"
#include "pipeline/posing/resolved_pose.h"

namespace kvx {

struct PosingInputs {
  const Scan& template_scan;
  const Mask& body;
  const BoneSet& bones;
  const WeightMap& weights;
  std::vector<const DisplacementField*> examples;   // d_k per training scan, template grid
};

struct PosedVolume {
  Volume volume;                 // template intensities carried to the pose; `air` where no tissue lands
  double folded_fraction = 0;    // of body cells turned inside out
};

// Uploads once, poses often. Thread-safe: calls queue up on the device. Keeps references to nothing after construction.
class PosingEngine {
 public:
  PosingEngine(Backend& backend, const PosingInputs& inputs);
  ~PosingEngine();

  // The template's grid, origin and size fitted around the posed body when no `grid` is asked for (`level` halves its resolution).
  Grid FittedGrid(const ResolvedPose& pose, int level = 0) const;
  PosedVolume Pose(const ResolvedPose& pose, const std::optional<Grid>& grid = {}, int level = 0) const;
  LabelMap PoseLabels(const ResolvedPose& pose, const std::optional<Grid>& grid = {}, int level = 0) const;
  // Template points to the pose: eq. 6 with weights and displacements interpolated trilinearly at each point.
  std::vector<PointMm> MapPoints(const ResolvedPose& pose, const std::vector<PointMm>& in_template) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
