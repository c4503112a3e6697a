// Bones as textured ellipsoids in soft tissue, whose motions are known.
#pragma once
#include "pipeline/bones/bone_set/bone_tree.h"
#include "pipeline/bones/bone_set/oriented_box.h"
#include "pipeline/bones/register_bones.h"
#include "pipeline/bones/search/bone_search.h"
#include "tests/support/fixtures.h"

namespace kvx::testing_support {

// Ellipsoids with a dark shell and a marrow whose texture is fixed to the bone, in tissue with a slow texture
// of its own.
struct Ellipsoid {
  std::string name, parent;
  Eigen::Vector3d centre_mm, half_mm;
};

inline double Texture(const Eigen::Vector3d& x) {
  return std::sin(0.55 * x.x() + 0.3 * x.y()) + std::sin(0.6 * x.y() - 0.35 * x.z()) +
         std::sin(0.5 * x.z() + 0.4 * x.x() + 1);
}

// 0 well below the surface of the ellipsoid scaled by `part`, 1 well above, over about 2 mm: scanners do not
// alias.
inline double Beyond(const Ellipsoid& bone, const Eigen::Vector3d& x_in_template, double part) {
  const double r = (x_in_template - bone.centre_mm).cwiseQuotient(bone.half_mm).norm();
  return 1 / (1 + std::exp(-(r - part) * bone.half_mm.minCoeff() / 0.5));
}

inline Volume Painted(const Grid& grid, const std::vector<Ellipsoid>& bones, const PoseVector& pose,
                      LabelMap* labels = nullptr) {
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    double value = 90 + 6 * std::sin(0.1 * x.lps.x() + 0.12 * x.lps.y());
    for (size_t b = 0; b < bones.size(); ++b) {
      const Eigen::Vector3d x_in_template = (pose[b].Inverse() * x).lps;
      const double outside = Beyond(bones[b], x_in_template, 1.0),
                   shell = Beyond(bones[b], x_in_template, 0.8);
      const double bone_value = 20 * shell + (150 + 20 * Texture(x_in_template)) * (1 - shell);
      value = value * outside + bone_value * (1 - outside);
      if (labels && outside < 0.5) labels->values[v] = uint16_t(b + 1);
    }
    out.values[v] = float(value);
  }
  return out;
}

inline Grid Box(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm,
                const Eigen::Matrix3d& direction) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  grid.direction = direction;
  grid.origin.lps = -grid.MmFromVox() * (0.5 * (size.array() - 1).cast<double>().matrix());
  return grid;
}

struct EllipsoidWorld {
  std::vector<Ellipsoid> ellipsoids;
  Artifact<Scan> template_scan{{}, nullptr};
  Artifact<BoneSet> bones{{}, nullptr};

  EllipsoidWorld(std::vector<Ellipsoid> drawn, const Grid& grid) : ellipsoids(std::move(drawn)) {
    auto scan = std::make_shared<Scan>();
    auto set = std::make_shared<BoneSet>();
    set->labels = LabelMap(grid);
    scan->volume = Painted(grid, ellipsoids, PoseVector(ellipsoids.size()), &set->labels);
    std::vector<StudyBone> listed;
    for (const Ellipsoid& e : ellipsoids) listed.push_back({int(listed.size()) + 1, e.name, e.parent});
    set->bones = OrderedBones(listed);
    for (size_t b = 0; b < set->bones.size(); ++b) {
      Bone& bone = set->bones[b];
      for (const uint16_t value : set->labels.values) bone.voxels += value == bone.label;
      bone.centroid.lps = ellipsoids[b].centre_mm;
      bone.box = FitOrientedBox(set->labels, bone.label,
                                {PointMm{bone.centroid.lps - 50 * Eigen::Vector3d::UnitX()}});
    }
    template_scan.value = scan;
    bones.value = set;
  }

  SoughtBones SoughtIn(const Volume& volume) const {
    const Volume& in_template = template_scan->volume;
    return SoughtBones(*bones, in_template, FinestMm(in_template.grid, volume.grid));
  }

  BoneFits Register(const Volume& volume, const RegisterBones::Options& options = {}) const {
    auto scan = std::make_shared<Scan>();
    scan->volume = volume;
    const Artifact<Scan> target{{}, scan};
    StageContext context{SharedBackend(), {}};
    const Artifact<WeightMap> unused;
    BoneTemplate shown(template_scan, bones, unused);
    return RegisterBones::Run({shown, target}, options, context);
  }
};

inline double AngleDeg(const RigidTransform& a, const RigidTransform& b) {
  return DegFromRad((a.Inverse() * b).AngleRad());
}
inline double CentreMm(const RigidTransform& a, const RigidTransform& b, const PointMm& x) {
  return ((a * x).lps - (b * x).lps).norm();
}

inline const Eigen::Matrix3d kOblique =
    Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
inline const std::vector<Ellipsoid> kOneBone{{"bone", "", {2, -1, 1}, {17, 9, 7}}};
inline const std::vector<Ellipsoid> kHinge{{"base", "", {-19, 0, 0}, {18, 8, 7}},
                                           {"tip", "base", {17, 0, 0}, {16, 7, 6}}};

}  // namespace kvx::testing_support
