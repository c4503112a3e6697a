// The weight map: roles of the voxels, harmonic fields in groups of bones, the four largest, and beyond the
// body.
#include "pipeline/skinning/compute_weights.h"

#include <algorithm>
#include <limits>

#include "core/bone_of_label.h"
#include "core/host/parallel.h"
#include "core/voxel_weights.h"
#include "core/voxels/components.h"
#include "core/voxels/nearest_voxel.h"
#include "pipeline/skinning/continued_roles.h"
#include "pipeline/skinning/harmonic_levels.h"

namespace kvx {
namespace {

RoleMap RolesOf(const BoneSet& bones, const Mask& body) {
  const std::vector<int> bone_of_label = BoneOfLabel(bones.bones);
  RoleMap roles(body.grid, kOutside);
  ParallelEach(roles.values.size(), [&](size_t v) {
    const int bone = bone_of_label[bones.labels.values[v]];
    roles.values[v] = bone != kNoBone ? int16_t(bone) : body.values[v] ? kFree : kOutside;
  });
  return roles;
}

Mask WhereRole(const RoleMap& roles, auto&& test) {
  Mask mask(roles.grid);
  ParallelEach(mask.values.size(), [&](size_t v) { mask.values[v] = test(roles.values[v]); });
  return mask;
}

// A piece of the body that no bone touches goes as a whole with the bone that comes nearest to it.
void AdoptStrayPieces(RoleMap& roles) {
  const Components pieces = LabelComponents(WhereRole(roles, [](int16_t role) { return role != kOutside; }));
  const Mask bone = WhereRole(roles, [](int16_t role) { return role >= 0; });
  const std::vector<uint8_t> has_bone = PiecesWith(pieces, bone);
  if (std::find(has_bone.begin(), has_bone.end(), 0) == has_bone.end()) return;
  const std::vector<uint32_t> nearest = NearestMarked(bone);
  std::vector<double> least(pieces.voxels.size(), std::numeric_limits<double>::infinity());
  std::vector<int16_t> adopter(pieces.voxels.size(), 0);
  for (size_t v = 0; v < roles.values.size(); ++v) {
    const int32_t piece = pieces.piece.values[v];
    if (piece < 0 || has_bone[piece]) continue;
    const Eigen::Vector3i step = roles.grid.Ijk(v) - roles.grid.Ijk(nearest[v]);
    const double away_mm = step.cast<double>().cwiseProduct(roles.grid.spacing_mm).norm();
    if (away_mm >= least[piece]) continue;
    least[piece] = away_mm;
    adopter[piece] = roles.values[nearest[v]];
  }
  for (size_t v = 0; v < roles.values.size(); ++v) {
    const int32_t piece = pieces.piece.values[v];
    if (piece >= 0 && !has_bone[piece]) roles.values[v] = adopter[piece];
  }
}

constexpr uint32_t kBeyond = std::numeric_limits<uint32_t>::max();

// Of every node, on the scan's grid; kBeyond where it has none.
std::vector<uint32_t> VoxelsOf(const HarmonicBody& body, const ContinuedRoles& continued, const Grid& scan) {
  std::vector<uint32_t> voxels(body.voxel.size());
  ParallelEach(voxels.size(), [&](size_t n) {
    const Eigen::Vector3i p = continued.roles.grid.Ijk(body.voxel[n]) - continued.first;
    voxels[n] = scan.Contains(p) ? uint32_t(scan.Index(p.x(), p.y(), p.z())) : kBeyond;
  });
  return voxels;
}

constexpr float kOfNoUse = 0.05f;  // an error of weights

// Weights sum to 1 wherever they are solved, before anything makes them: their sum has an error of its own.
// In passages thousands of voxels long single precision does not carry them to the middle.
void ExpectUnity(const std::vector<float>& sums) {
  for (const float sum : sums) {
    if (std::abs(1 - sum) <= kOfNoUse) continue;
    throw InputError(
        "the tissue of the template winds too much, or is too porous, for weights of its bones to be found: "
        "look at the scan's slices; where noise or an odd scale of greys makes air of tissue, export it "
        "again or take another template");
  }
}

void SolveFreeVoxels(const RoleMap& roles, int bone_count, double tolerance, StageContext& context,
                     WeightMap& weights) {
  const ContinuedRoles continued = Continued(roles);
  const HarmonicBody body = HarmonicBodyOf(continued.roles);
  const std::vector<uint32_t> cells = VoxelsOf(body, continued, roles.grid);
  const HarmonicSolver solver(context.backend);
  std::vector<float> sums(cells.size(), 0.0f);
  for (int first = 0; first < bone_count; first += kFieldsPerSolve) {
    context.progress.Report(ComputeWeights::kName, 0.1 + 0.7 * first / bone_count);
    const std::vector<float> fields = SolveHarmonic(solver, body, first, tolerance);
    const int fields_used = std::min(kFieldsPerSolve, bone_count - first);
    ParallelEach(cells.size(), [&](size_t n) {
      for (int f = 0; f < fields_used; ++f) {
        const float weight = fields[n * kFieldsPerSolve + f];
        sums[n] += weight;
        if (cells[n] != kBeyond) Insert(weights.values[cells[n]], uint8_t(first + f), weight);
      }
    });
  }
  ExpectUnity(sums);
  ParallelEach(cells.size(), [&](size_t n) {
    if (cells[n] != kBeyond) Normalise(weights.values[cells[n]]);
  });
}

void ExtendBeyondBody(const RoleMap& roles, WeightMap& weights) {
  const std::vector<uint32_t> nearest =
      NearestMarked(WhereRole(roles, [](int16_t role) { return role != kOutside; }));
  ParallelEach(weights.values.size(), [&](size_t v) {
    if (roles.values[v] == kOutside) weights.values[v] = weights.values[nearest[v]];
  });
}

}  // namespace

WeightMap ComputeWeights::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  const BoneSet& bones = *inputs.bones;
  const Mask& body = *inputs.body;
  if (!(bones.labels.grid == body.grid))
    throw InputError("the bone labels and the body must lie on the same grid");
  if (bones.size() > std::numeric_limits<uint8_t>::max())
    throw InputError("a model can have at most 255 bones");
  RoleMap roles = RolesOf(bones, body);
  if (std::none_of(roles.values.begin(), roles.values.end(), [](int16_t role) { return role >= 0; })) {
    throw InputError(
        "the bone labels hold no voxel of any bone; check that they belong to the template scan");
  }
  AdoptStrayPieces(roles);
  WeightMap weights(body.grid);
  ParallelEach(roles.values.size(), [&](size_t v) {
    if (roles.values[v] >= 0) weights.values[v] = Rigid(uint8_t(roles.values[v]));
  });
  SolveFreeVoxels(roles, bones.size(), options.tolerance, context, weights);
  context.progress.Report(kName, 0.85);
  ExtendBeyondBody(roles, weights);
  return weights;
}

}  // namespace kvx
