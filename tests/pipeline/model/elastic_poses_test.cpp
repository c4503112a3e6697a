// Elastic poses: of a built model, as volumes, slices and points.
#include <gtest/gtest.h>

#include "core/voxels/dilated.h"
#include "tests/support/built_hinge.h"

namespace kvx {
namespace {
using testing_support::SharedBackend;

class ElasticPoses : public testing_support::BuiltHinge {
 protected:
  // Bent farther than in any scan.
  static ResolvedPose Farther(DeformationMode mode) {
    const std::vector<JointAngles>& angles = model_->fit().scan_angles;
    return model_->Resolver().ResolveAngles(angles[0] + angles[1], mode);
  }
  static std::vector<PointMm> Places(bool in_bone) {
    const Mask& body = model_->body();
    const Mask bone = Eroded(MaskOf(model_->bones().labels));
    std::vector<PointMm> points;
    for (size_t v = 0; v < body.values.size(); v += 7) {
      const bool wanted = in_bone ? bone.values[v] : body.values[v] && !model_->bones().labels.values[v];
      if (wanted) points.push_back(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}));
    }
    return points;
  }
  static double LargestDistance(const std::vector<PointMm>& a, const std::vector<PointMm>& b) {
    double most = 0;
    for (size_t p = 0; p < a.size(); ++p) most = std::max(most, (a[p].lps - b[p].lps).norm());
    return most;
  }

 private:
  static Mask MaskOf(const LabelMap& labels) {
    Mask out(labels.grid);
    for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = labels.values[v] != 0;
    return out;
  }
};

TEST_F(ElasticPoses, AreEvdInTheScansAndOtherwiseOnlyInBones) {
  const auto engine = model_->MakeEngine(SharedBackend());
  const std::vector<PointMm> soft = Places(false), bone = Places(true);
  ASSERT_GT(bone.size(), 20u);
  const auto apart = [&](const PoseRequest& request, const std::vector<PointMm>& points) {
    return LargestDistance(engine->MapPoints(model_->Resolve(request, DeformationMode::kElastic), points),
                           engine->MapPoints(model_->Resolve(request, DeformationMode::kEvd), points));
  };
  for (size_t k = 0; k < model_->scan_names().size(); ++k) {
    BonePose bones;
    for (size_t b = 0; b < model_->bone_names().size(); ++b)
      bones.scan_from_template[model_->bone_names()[b]] = model_->scan_fits()[k][b].scan_from_template;
    EXPECT_LT(apart(bones, soft), 0.01);
    EXPECT_EQ(apart(ScanPose{model_->scan_names()[k]}, soft), 0);
  }
  const auto of = [&](DeformationMode mode, const std::vector<PointMm>& points) {
    return engine->MapPoints(Farther(mode), points);
  };
  EXPECT_GT(LargestDistance(of(DeformationMode::kElastic, soft), of(DeformationMode::kEvd, soft)), 0.05);
  EXPECT_LT(LargestDistance(of(DeformationMode::kElastic, bone), of(DeformationMode::kEvd, bone)), 1e-9);
}

TEST_F(ElasticPoses, VolumesShowTissueWherePointsGo) {
  const auto engine = model_->MakeEngine(SharedBackend());
  const ResolvedPose pose = Farther(DeformationMode::kElastic);
  const Grid grid = engine->FittedGrid(pose);
  const PlaceField places = engine->InversePlaces(pose, grid);
  const Mask inner = Eroded(model_->body());
  std::vector<PointMm> in_template, posed;
  for (size_t v = 0; v < places.values.size(); v += 11) {
    if (!places.values[v].allFinite()) continue;
    const PointMm place{places.values[v].cast<double>()};
    const Eigen::Vector3i near = inner.grid.ToVox(place).ijk.array().round().cast<int>();
    if (!inner.grid.Contains(near) || !inner(near.x(), near.y(), near.z())) continue;
    in_template.push_back(place);
    posed.push_back(grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}));
  }
  ASSERT_GT(in_template.size(), 300u);
  EXPECT_LT(LargestDistance(engine->MapPoints(pose, in_template), posed), 0.3 * grid.spacing_mm.minCoeff());
}

TEST_F(ElasticPoses, ASliceIsALayerOfTheVolume) {
  const auto engine = model_->MakeEngine(SharedBackend());
  const ResolvedPose pose = Farther(DeformationMode::kElastic);
  const PosedVolume whole = engine->Pose(pose);
  const Grid& grid = whole.volume.grid;
  for (const int k : {grid.size.z() / 4, grid.size.z() / 2, 3 * grid.size.z() / 4}) {
    Grid layer = grid;
    layer.size.z() = 1;
    layer.origin = grid.ToMm(0, 0, k);
    const Volume slice = engine->Pose(pose, layer).volume;
    for (size_t v = 0; v < slice.values.size(); ++v)
      ASSERT_NEAR(slice.values[v], whole.volume.values[grid.Index(0, 0, k) + v], 0.5f) << k;
  }
}

// The template alone: tissue comes to rest between its bones, whole.
TEST_F(ElasticPoses, NeedNoScan) {
  Study study = *study_;
  study.scans.resize(1);
  const auto folder = scratch_->path() / "alone";
  BuildModel(study, {}, folder, ModelPath() / "artifacts", SharedBackend(), {});
  const Model model = Model::Load(folder, ModelPath() / "artifacts");
  const auto engine = model.MakeEngine(SharedBackend());
  BonePose bones;
  for (size_t b = 0; b < model.bone_names().size(); ++b)
    bones.scan_from_template[model.bone_names()[b]] = model_->scan_fits()[1][b].scan_from_template;
  const auto of = [&](DeformationMode mode, bool in_bone) {
    return engine->MapPoints(model.Resolve(bones, mode), Places(in_bone));
  };
  EXPECT_GT(LargestDistance(of(DeformationMode::kElastic, false), of(DeformationMode::kVbd, false)), 0.1);
  EXPECT_LT(LargestDistance(of(DeformationMode::kElastic, true), of(DeformationMode::kVbd, true)), 1e-9);
}

TEST_F(ElasticPoses, AreTheSameWhateverWasPosedBefore) {
  const auto fresh = model_->MakeEngine(SharedBackend()), used = model_->MakeEngine(SharedBackend());
  used->Pose(Farther(DeformationMode::kEvd));
  used->Pose(model_->Resolver().ResolveAngles(0.3 * model_->fit().scan_angles[0], DeformationMode::kElastic));
  const Volume expected = fresh->Pose(Farther(DeformationMode::kElastic)).volume;
  EXPECT_EQ(used->Pose(Farther(DeformationMode::kElastic)).volume.values, expected.values);
  EXPECT_NE(used->Pose(Farther(DeformationMode::kEvd)).volume.values, expected.values);
  EXPECT_EQ(used->Pose(Farther(DeformationMode::kElastic)).volume.values, expected.values);
}

}  // namespace
}  // namespace kvx
