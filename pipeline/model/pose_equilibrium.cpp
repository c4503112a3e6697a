// The registration's elastic start (elastic_start.h) on a lattice of its own, of tissue alone.
#include "pipeline/model/pose_equilibrium.h"

#include <algorithm>

#include "core/dilated.h"
#include "core/parallel.h"
#include "pipeline/registration/region/blend_table.h"
#include "pipeline/registration/tissue/bone_coat.h"

namespace kvx {
namespace {

constexpr double kReachVoxels = 4;    // of the template, beyond the body: posed bricks reach no farther
constexpr double kMostNodes = 80000;  // of the body: about a tenth of a second for a pose on two cores

// The least steps that leave the body no more nodes than that, all about as long in mm: a lattice of cubes
// bends alike in all directions.
Eigen::Vector3i StepOf(const Mask& body) {
  const auto voxels = double(std::ranges::count_if(body.values, [](uint8_t v) { return v != 0; }));
  const Eigen::Array3d share = body.grid.spacing_mm.minCoeff() / body.grid.spacing_mm.array();
  Eigen::Vector3i step = Eigen::Vector3i::Ones();
  for (int times = 2; voxels > kMostNodes * step.cast<double>().prod(); ++times)
    step = (times * share).round().max(1).cast<int>().matrix();
  return step;
}

template <class T>
Image<T> Every(const Eigen::Vector3i& step, const Image<T>& image) {
  Grid grid = image.grid;
  grid.size = (grid.size + step - Eigen::Vector3i::Ones()).cwiseQuotient(step);
  grid.spacing_mm = grid.spacing_mm.cwiseProduct(step.cast<double>());
  Image<T> out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v).cwiseProduct(step);
    out.values[v] = image(p.x(), p.y(), p.z());
  }
  return out;
}

// The box of the body, and a little more.
WorkRegion LatticeAround(const Mask& body) {
  WorkRegion region = RegionAround(body);
  const Eigen::Vector3i spare = Eigen::Vector3i::Constant(6);
  region.first += spare;
  region.grid.origin = body.grid.ToMm(PointVox{region.first.cast<double>()});
  region.grid.size -= 2 * spare;
  return region;
}

float CoefficientAt(const VoxelWeights& w, const Eigen::MatrixXf& coefficients, Eigen::Index k) {
  float sum = 0;
  for (int s = 0; s < kBonesPerVoxel; ++s) sum += w.weights[s] * coefficients(w.bones[s], k);
  return sum;
}

}  // namespace

PoseEquilibrium::PoseEquilibrium(const EquilibriumInputs& in, Backend& backend)
    : step_(StepOf(in.body)),
      region_(LatticeAround(Every(step_, in.body))),
      beyond_coat_mm_(BeyondBoneCoatMm(Every(step_, in.bone_labels), region_)),
      tissue_(Every(step_, in.bone_labels), Every(step_, in.body), beyond_coat_mm_, region_, backend),
      nodes_(NodesNear(Crop(Every(step_, in.body), region_), in.weights)),
      template_vox_from_mm_(in.body.grid.VoxFromMm().cast<float>()) {
  for (const PoseVector& pose : in.scan_poses) at_scans_.push_back(At(pose));
}

std::vector<PoseEquilibrium::Node> PoseEquilibrium::NodesNear(const Mask& lattice_body,
                                                              const WeightMap& weights) const {
  const double reach_mm = kReachVoxels * weights.grid.spacing_mm.maxCoeff() + region_.grid.spacing_mm.norm();
  const Mask near = Dilated(lattice_body, reach_mm);
  std::vector<Node> nodes;
  for (size_t n = 0; n < near.values.size(); ++n) {
    if (!near.values[n]) continue;
    const Eigen::Vector3i voxel = (region_.grid.Ijk(n) + region_.first).cwiseProduct(step_);
    const Eigen::Vector3i p = weights.grid.Nearest(voxel);
    nodes.push_back({n, weights.grid.ToMm(PointVox{voxel.cast<double>()}).lps, weights(p.x(), p.y(), p.z())});
  }
  return nodes;
}

std::vector<Eigen::Vector3f> PoseEquilibrium::At(const PoseVector& pose) const {
  const BlendTable blend(pose);
  std::vector<Eigen::Vector3f> mm(region_.grid.VoxelCount(), Eigen::Vector3f::Zero()), out(nodes_.size());
  ParallelEach(nodes_.size(), [&](size_t n) {
    mm[nodes_[n].index] = Apply(blend(nodes_[n].weights), nodes_[n].template_mm).cast<float>();
  });
  tissue_.Relax({}, mm);
  ParallelEach(nodes_.size(), [&](size_t n) {
    const Eigen::Vector3d settled_mm = mm[nodes_[n].index].cast<double>();
    const Eigen::Vector3d d = ApplyInverse(blend(nodes_[n].weights), settled_mm) - nodes_[n].template_mm;
    out[n] = d.allFinite() ? d.cast<float>().eval() : Eigen::Vector3f::Zero().eval();
  });
  return out;
}

std::shared_ptr<const AddedDisplacement> PoseEquilibrium::BeyondExamples(const ResolvedPose& pose) const {
  const std::lock_guard lock(mutex_);
  if (last_pose_ && IsSame(*last_pose_, pose)) return last_;
  last_pose_.reset();
  auto added = std::make_shared<AddedDisplacement>();
  added->first = region_.first.cwiseProduct(step_);
  added->step = step_;
  added->size = region_.grid.size;
  added->voxels.assign(region_.grid.VoxelCount(), Eigen::Vector3f::Zero());
  const std::vector<Eigen::Vector3f> settled = At(pose.scan_from_template);
  ParallelEach(nodes_.size(), [&](size_t n) {
    Eigen::Vector3f d = settled[n];
    for (Eigen::Index k = 0; k < pose.coefficients.cols(); ++k)
      d -= CoefficientAt(nodes_[n].weights, pose.coefficients, k) * at_scans_[size_t(k)][n];
    added->voxels[nodes_[n].index] = template_vox_from_mm_ * d;
  });
  last_ = std::move(added);
  last_pose_ = pose;
  return last_;
}

}  // namespace kvx
