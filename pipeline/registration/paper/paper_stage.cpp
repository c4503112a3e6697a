// The published order: the deformed template is registered on the scan's grid.
#include "pipeline/registration/paper/paper_stage.h"

#include "core/host/parallel.h"
#include "core/voxels/dilated.h"
#include "kernels/blend_deform.h"
#include "pipeline/measures/similarity.h"
#include "pipeline/posing/posing_engine.h"
#include "pipeline/registration/region/level_field.h"

namespace kvx {
namespace {

constexpr int kInverseSteps = 40;
constexpr int kFullSteps = 12;  // then half ones, where the fixed point swings
constexpr double kInverseVoxels = 1e-3;

Volume AsBytes(const Volume& volume, const ByteScale& scale) {
  Volume out(volume.grid);
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = scale(volume.values[v]);
  return out;
}

// 1 in the body and the ring around it that VBD carries along, 2 in bone.
LabelMap Parts(const Mask& body, const LabelMap& bones, double ring_mm) {
  const Mask carried = Dilated(body, ring_mm);
  LabelMap parts(body.grid);
  for (size_t v = 0; v < parts.values.size(); ++v) {
    parts.values[v] = bones.values[v] ? 2 : carried.values[v] ? 1 : 0;
  }
  return parts;
}

// V^s and V^t: the template carried into the scan's pose, and the scan.
PaperPair MakePair(const RegistrationInputs& inputs, const PoseVector& pose, Backend& backend) {
  const Scan& from = *inputs.template_scan;
  BoneSet parts = *inputs.bones;
  parts.labels = Parts(*inputs.body, inputs.bones->labels, 2 * from.volume.grid.spacing_mm.maxCoeff());
  const PosingEngine engine(backend, {from, *inputs.body, parts, *inputs.weights, {}});
  const ResolvedPose by_bones{pose, Eigen::MatrixXf::Zero(Eigen::Index(pose.size()), 0), {}};
  const Grid& grid = inputs.scan->volume.grid;
  PaperPair pair;
  pair.source = AsBytes(engine.Pose(by_bones, grid).volume, ByteScaleOf(from.volume));
  pair.target = AsBytes(inputs.scan->volume, ByteScaleOf(inputs.scan->volume));
  const LabelMap posed = engine.PoseLabels(by_bones, grid);
  pair.counts = Mask(grid);
  pair.bone = Mask(grid);
  for (size_t v = 0; v < posed.values.size(); ++v) {
    pair.counts.values[v] = posed.values[v] != 0;
    pair.bone.values[v] = posed.values[v] == 2;
  }
  return pair;
}

Eigen::Vector3d BeforeShifts(const Eigen::Vector3d& y, const VoxelShifts& shifts) {
  Eigen::Vector3d p = y;
  for (int n = 0; n < kInverseSteps; ++n) {
    const Eigen::Vector3d miss = y - p - SampleTrilinear(shifts, PointVox{p});
    p += n < kFullSteps ? miss : miss / 2;
    if (miss.norm() < kInverseVoxels) break;
  }
  return p;
}

}  // namespace

DisplacementField ThroughShifts(const DisplacementField& initial, const VoxelShifts& shifts) {
  DisplacementField out(initial.grid);
  const Eigen::Matrix3d mm_from_vox = shifts.grid.MmFromVox();
  ParallelEach(out.values.size(), [&](size_t v) {
    const Eigen::Vector3d u = initial.values[v].cast<double>();
    const Eigen::Vector3i at = initial.grid.Ijk(v);
    const PointMm landed{initial.grid.ToMm(at.x(), at.y(), at.z()).lps + u};
    const Eigen::Vector3d y = shifts.grid.ToVox(landed).ijk;
    out.values[v] = (u + mm_from_vox * (BeforeShifts(y, shifts) - y)).cast<float>();
  });
  return out;
}

RegisteredScan RegisterByPaper(const RegistrationInputs& inputs, const PaperOptions& options,
                               StageContext& context) {
  const PoseVector pose = PoseOf(*inputs.fits);
  const PaperPair pair = MakePair(inputs, pose, context.backend);
  PaperRegistration found = RegisterAsPublished(pair, options, context.backend, context.progress);
  RegisteredScan out;
  out.scan_from_template = ThroughShifts(BlendField(context.backend)(*inputs.weights, pose), found.shifts);
  out.control_points_per_level = std::move(found.control_points_per_level);
  for (const int64_t points : out.control_points_per_level) out.control_points += points;
  out.folded_fraction = FoldedFraction(out.scan_from_template, *inputs.body);
  return out;
}

}  // namespace kvx
