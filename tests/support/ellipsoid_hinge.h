// Two bones at a hinge, with skinning weights and scans of them whose truth is known.
#pragma once
#include <random>

#include "pipeline/bones/refine_bones.h"
#include "pipeline/skinning/compute_weights.h"
#include "tests/support/ellipsoid_world.h"

namespace kvx::testing_support {

// As if its voxels were so many times as long along each axis of its grid; the world is stretched about its
// origin.
inline Volume Stretched(Volume scan, const Eigen::Vector3d& times) {
  const Eigen::Matrix3d& axes = scan.grid.direction;
  scan.grid.origin.lps = axes * times.asDiagonal() * axes.transpose() * scan.grid.origin.lps;
  scan.grid.spacing_mm = scan.grid.spacing_mm.cwiseProduct(times);
  return scan;
}

struct Hinge {
  EllipsoidWorld world{kHinge, Box({84, 44, 40}, {1.0, 1.0, 1.1}, Eigen::Matrix3d::Identity())};
  PoseVector truth;
  Artifact<WeightMap> weights{{}, nullptr};

  Hinge() {
    const RigidTransform root = Exp((Twist() << 0.1, 0.2, -0.1, 2.0, 3.0, -2.0).finished());
    truth = {root, root * RotationAbout(PointMm{{-3, 0, 0}}, {0, 0, 1}, RadFromDeg(20))};
    StageContext context{SharedBackend(), {}};
    const Artifact<Mask> body{{}, std::make_shared<Mask>(world.template_scan->volume.grid, uint8_t(1))};
    weights.value = std::make_shared<WeightMap>(ComputeWeights::Run({world.bones, body}, {}, context));
  }

  Volume Scan(double noise = 0, unsigned seed = 1, const std::vector<Ellipsoid>& bones = kHinge) const {
    Volume out = Painted(Box({90, 66, 46}, {1.0, 1.05, 1.1}, Eigen::Matrix3d::Identity()), bones, truth);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 1);
    for (float& value : out.values) value += float(noise * normal(random));
    return out;
  }

  BoneFits Refine(const Volume& volume, const std::vector<Twist>& off, bool doubtful = false,
                  const PoseHints& hints = {}) const {
    auto scan = std::make_shared<kvx::Scan>();
    scan->volume = volume;
    BoneFits found(2);
    for (int b = 0; b < 2; ++b) {
      const PointMm centre = world.bones->bones[b].centroid;
      const RigidTransform turn = RotationAbout(centre, off[b].head<3>(), off[b].head<3>().norm());
      found[b].scan_from_template = truth[b] * turn;
      found[b].scan_from_template.translation_mm += off[b].tail<3>();
      found[b].doubt = doubtful ? Doubt::kBone : Doubt::kNone;
    }
    StageContext context{SharedBackend(), {}};
    const Artifact<kvx::Scan> target{{}, scan};
    const Artifact<BoneFits> fits{{}, std::make_shared<BoneFits>(found)};
    BoneTemplate shown(world.template_scan, world.bones, weights);
    return RefineBones::Run({shown, target, fits}, {hints}, context);
  }
};

}  // namespace kvx::testing_support
