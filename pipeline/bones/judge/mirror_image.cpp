// Samples change sides; what is fitted stays a rigid motion.
#include "pipeline/bones/judge/mirror_image.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "pipeline/bones/bone_set/bone_tree.h"
#include "pipeline/bones/images/levels.h"
#include "pipeline/bones/refine/refine_bone.h"

namespace kvx {
namespace {

constexpr size_t kLargest = 3;
constexpr int kSteps = 20;

// Across the plane through their centre.
BoneSamples Mirrored(BoneSamples samples, const Eigen::Vector3d& normal) {
  const Eigen::Vector3f n = normal.cast<float>();
  for (BoneSample& sample : samples.points) {
    const Eigen::Vector3f at = sample.head<3>();
    sample.head<3>() = at - 2 * n.dot(at) * n;
  }
  return samples;
}

// From coarse to fine; by axis of the bone's box across which it is mirrored, by level.
double BestCorrelation(const SoughtBones& sought, int bone, const std::vector<Volume>& levels,
                       const RigidTransform& found) {
  double best = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = sought.bones().bones[size_t(bone)].box.axes.col(axis);
    PoseFit fit{found};
    for (int level = int(levels.size()) - 1; level >= 0; --level) {
      const BoneSamples samples = Mirrored(sought.SamplesOf(bone, level, true), normal);
      fit = RefinePose(levels[size_t(level)], samples, fit.scan_from_template, kSteps);
    }
    best = std::max(best, fit.correlation);
  }
  return best;
}

std::vector<int> LargestSure(const BoneSet& bones, const BoneFits& fits) {
  std::vector<int> order = LargestFirst(bones);
  std::erase_if(order, [&](int b) { return fits[size_t(b)].Doubtful(); });
  order.resize(std::min(order.size(), kLargest));
  return order;
}

}  // namespace

Volume Mirrored(Volume scan) {
  Grid& grid = scan.grid;
  grid.origin.lps.x() = 2 * grid.Middle().lps.x() - grid.origin.lps.x();
  grid.direction.row(0) *= -1;
  return scan;
}

double MirrorNats(const SoughtBones& sought, const Volume& scan, const BoneFits& fits) {
  const std::vector<Volume> levels = MakeLevels(scan, {sought.CoarserLevelsMm().front()});
  const std::vector<int> bones = LargestSure(sought.bones(), fits);
  std::vector<double> nats(bones.size());
  ParallelFor(bones.size(), [&](size_t n) {
    const int b = bones[n];
    const RigidTransform& found = fits[size_t(b)].scan_from_template;
    const PoseFit itself = FitAt(levels[0], sought.SamplesOf(b, 0, true), found);
    const double independent = sought.independent_samples()[size_t(b)];
    nats[n] = EvidenceNats(BestCorrelation(sought, b, levels, found), itself.inside, independent) -
              EvidenceNats(itself.correlation, itself.inside, independent);
  });
  double sum = 0;
  for (const double bone : nats) sum += bone;
  return sum;
}

}  // namespace kvx
