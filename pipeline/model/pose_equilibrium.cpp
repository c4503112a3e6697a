// The registration's elastic start (elastic_start.h) on a lattice of its own, of tissue alone.
#include "pipeline/model/pose_equilibrium.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "core/voxels/dilated.h"
#include "pipeline/model/elastic_shares.h"
#include "pipeline/registration/region/blend_table.h"
#include "pipeline/registration/tissue/bone_coat.h"

namespace kvx {
namespace {

constexpr double kReachVoxels = 4;     // of the template, beyond the body: what is posed of air lies nearer
constexpr size_t kKept = 4;            // poses: those of a few viewers, and of one who makes a field
constexpr double kNoiseVoxels = 0.03;  // of a registered place, mean of many
constexpr double kMostNodes = 80000;   // of the body: about 0.05 s for a pose on two cores

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

// The box of the body, and a little more: nothing here asks for whole blocks.
WorkRegion LatticeAround(const Mask& body) {
  WorkRegion region = RegionAround(body);
  const Eigen::Vector3i spare = Eigen::Vector3i::Constant(6);
  region.first += spare;
  region.grid.origin = body.grid.ToMm(PointVox{region.first.cast<double>()});
  region.grid.size -= 2 * spare;
  return region;
}

bool HidesAny(const ExampleMoments& moments, const VoxelWeights& w, int scan) {
  bool hides = false;
  for (int s = 0; s < kBonesPerVoxel; ++s)
    hides = hides || (w.weights[s] > 0 && moments.Hides(w.bones[s], scan));
  return hides;
}

}  // namespace

PoseEquilibrium::PoseEquilibrium(const EquilibriumInputs& in, Backend& backend)
    : step_(StepOf(in.body)),
      region_(LatticeAround(Every(step_, in.body))),
      beyond_coat_mm_(BeyondBoneCoatMm(Every(step_, in.bone_labels), region_)),
      tissue_(Every(step_, in.bone_labels), Every(step_, in.body), beyond_coat_mm_, region_, backend),
      nodes_(NodesNear(in)),
      template_vox_from_mm_(in.body.grid.VoxFromMm().cast<float>()) {
  std::vector<std::vector<Eigen::Vector3f>> own;
  for (const PoseVector& pose : in.scan_poses) own.push_back(At(pose));
  for (const Eigen::MatrixXf& from : in.known_from) at_scans_.push_back(Mixed(own, from));
  if (in.known_from.empty()) at_scans_ = std::move(own);
  shares_ = LearnedShares(in);
}

Eigen::Vector3i PoseEquilibrium::VoxelOf(size_t node) const {
  return (region_.grid.Ijk(node) + region_.first).cwiseProduct(step_);
}

std::vector<PoseEquilibrium::Node> PoseEquilibrium::NodesNear(const EquilibriumInputs& in) const {
  const Grid& grid = in.body.grid;
  const double reach_mm = kReachVoxels * grid.spacing_mm.maxCoeff() + region_.grid.spacing_mm.norm();
  const Mask near = Dilated(Crop(Every(step_, in.body), region_), reach_mm);
  std::vector<Node> nodes;
  for (size_t n = 0; n < near.values.size(); ++n) {
    if (!near.values[n]) continue;
    const Eigen::Vector3i voxel = VoxelOf(n);
    const size_t v = grid.Index(grid.Nearest(voxel).x(), grid.Nearest(voxel).y(), grid.Nearest(voxel).z());
    nodes.push_back({n, grid.ToMm(PointVox{voxel.cast<double>()}).lps, in.weights.values[v],
                     grid.Contains(voxel) && in.body.values[v] && !in.bone_labels.values[v]});
  }
  return nodes;
}

// By the bones' coefficients.
std::vector<Eigen::Vector3f> PoseEquilibrium::Mixed(const std::vector<std::vector<Eigen::Vector3f>>& of_scans,
                                                    const Eigen::MatrixXf& coefficients) const {
  std::vector<Eigen::Vector3f> out(nodes_.size(), Eigen::Vector3f::Zero());
  ParallelEach(out.size(), [&](size_t n) {
    for (Eigen::Index k = 0; k < coefficients.cols(); ++k)
      out[n] += float(CoefficientAt(nodes_[n].weights, coefficients, k)) * of_scans[size_t(k)][n];
  });
  return out;
}

// Beside the first bone: scans' worlds may lie metres apart, and E is the same in all of them.
std::vector<Eigen::Vector3f> PoseEquilibrium::At(PoseVector pose) const {
  const RigidTransform back = pose.empty() ? RigidTransform{} : pose[0].Inverse();
  for (RigidTransform& bone : pose) bone = back * bone;
  const BlendTable blend(pose);
  std::vector<Eigen::Vector3f> mm(region_.grid.VoxelCount(), Eigen::Vector3f::Zero()), out(nodes_.size());
  ParallelEach(nodes_.size(), [&](size_t n) {
    mm[nodes_[n].index] = Apply(blend(nodes_[n].weights), nodes_[n].template_mm).cast<float>();
  });
  tissue_.Relax({}, {}, mm);
  ParallelEach(nodes_.size(), [&](size_t n) {
    const Eigen::Vector3d at_rest_mm = mm[nodes_[n].index].cast<double>();
    const Eigen::Vector3d d = ApplyInverse(blend(nodes_[n].weights), at_rest_mm) - nodes_[n].template_mm;
    out[n] = d.allFinite() ? d.cast<float>().eval() : Eigen::Vector3f::Zero().eval();
  });
  return out;
}

std::vector<float> PoseEquilibrium::LearnedShares(const EquilibriumInputs& in) const {
  std::vector<float> out(nodes_.size(), 1.0f);
  const size_t scans = in.without_scan.size();
  if (scans == 0) return out;
  ElasticShares shares(in.scan_poses[0].size(), scans, kNoiseVoxels * in.body.grid.MeanSpacingMm());
  const Eigen::Matrix3d mm_from_vox = in.body.grid.MmFromVox();
  for (size_t n = 0; n < nodes_.size(); ++n) {
    const Eigen::Vector3i voxel = VoxelOf(nodes_[n].index);
    const int brick = nodes_[n].soft ? in.bricked.BrickOf(voxel) : -1;
    if (brick < 0) continue;
    Eigen::Matrix3Xd examples = Eigen::Matrix3Xd::Zero(3, Eigen::Index(scans));
    for (uint32_t e = in.bricked.example_first[brick]; e < in.bricked.example_first[brick + 1]; ++e)
      examples.col(in.bricked.example_refs[e].k) =
          mm_from_vox * in.bricked.NodeExample(e, BrickedBody::Slot(voxel));
    for (size_t k = 0; k < scans; ++k) {
      if (HidesAny(in.moments, nodes_[n].weights, int(k))) continue;
      Eigen::Vector3d unexplained = examples.col(Eigen::Index(k));
      Eigen::Vector3f elastic = at_scans_[k][n];
      for (size_t l = 0; l < scans; ++l) {
        const double c = CoefficientAt(nodes_[n].weights, in.without_scan[k], Eigen::Index(l));
        unexplained -= c * examples.col(Eigen::Index(l));
        elastic -= float(c) * at_scans_[l][n];
      }
      shares.Add(k, nodes_[n].weights, unexplained.cast<float>(), elastic);
    }
  }
  const Eigen::MatrixXf of_bones = shares.Learned().cast<float>();
  for (size_t n = 0; n < out.size(); ++n) out[n] = float(CoefficientAt(nodes_[n].weights, of_bones, 0));
  return out;
}

std::shared_ptr<const AddedDisplacement> PoseEquilibrium::Made(const ResolvedPose& pose) const {
  auto added = std::make_shared<AddedDisplacement>();
  added->first = region_.first.cwiseProduct(step_);
  added->step = step_;
  added->size = region_.grid.size;
  added->voxels.assign(region_.grid.VoxelCount(), Eigen::Vector3f::Zero());
  const std::vector<Eigen::Vector3f> at_rest = At(pose.scan_from_template),
                                     of_examples = Mixed(at_scans_, pose.coefficients);
  ParallelEach(nodes_.size(), [&](size_t n) {
    added->voxels[nodes_[n].index] = template_vox_from_mm_ * (shares_[n] * (at_rest[n] - of_examples[n]));
  });
  return added;
}

std::shared_ptr<const AddedDisplacement> PoseEquilibrium::BeyondExamples(const ResolvedPose& pose) const {
  const std::lock_guard lock(mutex_);
  auto found = std::ranges::find_if(kept_, [&](const Kept& kept) { return IsSame(kept.pose, pose); });
  if (found == kept_.end()) {
    const auto made = Made(pose);
    if (kept_.size() == kKept) kept_.pop_back();
    found = kept_.insert(kept_.end(), {pose, made});
  }
  std::rotate(kept_.begin(), found, found + 1);
  return kept_.front().added;
}

}  // namespace kvx
