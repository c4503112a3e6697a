// EVD (eq. 6): v_a = E(v_0 + d_a), as posed volumes on a regular grid and as posed points.
#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "core/scan.h"
#include "core/weight_map.h"
#include "kernels/added_displacement.h"
#include "kernels/device/backend.h"
#include "kernels/sampling.h"
#include "pipeline/posing/resolved_pose.h"

namespace kvx {

struct BrickedBody;

struct PosingInputs {
  const Scan& template_scan;
  const Mask& body;
  const BoneSet& bones;
  const WeightMap& weights;
  std::vector<const DisplacementField*> examples;  // d_k per training scan, template grid
};

struct PosedVolume {
  Volume volume;               // template intensities carried to the pose; `air` where no tissue lands
  double folded_fraction = 0;  // of body cells turned inside out
};

// What an elastic pose adds to its examples' displacements.
using ElasticAddition = std::function<std::shared_ptr<const AddedDisplacement>(const ResolvedPose&)>;

// What lands on a posed voxel: a template place, or nothing (NaN).
using PlaceField = Image<Eigen::Vector3f>;  // template world, mm

// Uploads once, poses often; its buffers are kept, so a steady stream of poses allocates nothing.
// Thread-safe: calls are served in the order in which they come.
// Keeps references to nothing after construction.
class PosingEngine {
 public:
  // Raised when posed numbers change, those of elastic poses (model/pose_equilibrium.h) too: results kept
  // elsewhere are known by it
  static constexpr int kVersion = 13;
  static constexpr double kMostVoxels = 1e9;  // of a posed grid: beyond it the pose is a mistake

  // A posed grid of more than `most_voxels` is refused with InputError.
  PosingEngine(Backend& backend, const PosingInputs& inputs, double most_voxels = kMostVoxels);
  // The same of what was cut before. `labels`: of the bones on the template's grid; empty: no labels are
  // posed, and no pose is elastic.
  PosingEngine(Backend& backend, const Scan& template_scan, const LabelMap& labels,
               std::shared_ptr<const BrickedBody> body, ElasticAddition elastic_addition = {},
               double most_voxels = kMostVoxels);
  ~PosingEngine();

  // The template's grid, origin and size fitted around the posed body when no `grid` is asked for (`level`
  // halves its resolution: each voxel is the mean of the voxels it covers). Any grid will do: a region,
  // another spacing, or one oblique plane; only the bricks that may reach it are posed. Bones are rigid out
  // to their borders.
  Grid FittedGrid(const ResolvedPose& pose, int level = 0) const;
  PosedVolume Pose(const ResolvedPose& pose, const std::optional<Grid>& grid = {}, int level = 0,
                   Sampling sampling = Sampling::kLinear) const;
  // The same into a volume that is used again and again: no memory is taken when its size stays.
  void PoseInto(PosedVolume& out, const ResolvedPose& pose, const std::optional<Grid>& grid = {},
                int level = 0, Sampling sampling = Sampling::kLinear) const;
  LabelMap PoseLabels(const ResolvedPose& pose, const std::optional<Grid>& grid = {}, int level = 0) const;
  // The inverse map on a grid: for tests and benchmarks, which ask where the engine's volumes come from.
  PlaceField InversePlaces(const ResolvedPose& pose, const Grid& grid) const;
  // Template points to the pose: eq. 6 with weights and displacements interpolated trilinearly at each point,
  // and bones rigid up to their borders (map_points.h).
  std::vector<PointMm> MapPoints(const ResolvedPose& pose, const std::vector<PointMm>& in_template) const;

  float air() const;
  double most_voxels() const;
  // Device buffers taken since construction: in a steady state the number stands still.
  int64_t allocations() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
