// A model of the hinge against a truth folder: motion in closed form, and offsets that are put in by hand.
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

#include "pipeline/evaluate/evaluate.h"
#include "pipeline/io/npz_file.h"
#include "pipeline/model/map_to_scan.h"
#include "pipeline/registration/result/confidence.h"
#include "tests/support/built_hinge.h"

namespace kvx {
namespace {

using testing_support::BuiltHinge;
using testing_support::Hinge;
using testing_support::HingePose;
using testing_support::SharedBackend;

// One pose of a truth folder, in LPS; files are in RAS.
struct KnownPose {
  std::string name;
  RigidTransform upper, lower;
  std::vector<PointMm> in_template, in_scan;
  std::vector<uint8_t> bone;
};

nlohmann::json Ras(const RigidTransform& lps) {
  const std::array<double, 16> m = RowMajor(lps);
  nlohmann::json rows = nlohmann::json::array();
  for (size_t r = 0; r < 4; ++r) {
    nlohmann::json row = nlohmann::json::array();
    for (size_t c = 0; c < 4; ++c) row.push_back((r < 2) == (c < 2) ? m[4 * r + c] : -m[4 * r + c]);
    rows.push_back(row);
  }
  return rows;
}

NpyArray Ras(const std::vector<PointMm>& points) {
  std::vector<double> values;
  for (const PointMm& x : points)
    for (const double v : {-x.lps.x(), -x.lps.y(), x.lps.z()}) values.push_back(v);
  return MakeNpy<double>({points.size(), 3}, values);
}

Truth Written(const std::filesystem::path& folder, const BoneSet& bones,
              const std::vector<KnownPose>& poses) {
  nlohmann::json manifest{{"tissues", {"air", "muscle"}}};
  for (const auto& bone : bones.bones) {
    const Eigen::Vector3d c = bone.centroid.lps;
    manifest["bones"].push_back({{"name", bone.name}, {"centroid", {-c.x(), -c.y(), c.z()}}});
  }
  for (const KnownPose& pose : poses) {
    const size_t n = pose.in_template.size();
    const std::vector<uint8_t> one(n, 1), none(n, 0);
    WriteNpz(folder / (pose.name + ".npz"),
             {{"template", Ras(pose.in_template)},
              {"position", Ras(pose.in_scan)},
              {"tissue", MakeNpy<uint8_t>({n}, one)},
              {"bone", MakeNpy<uint8_t>({n}, pose.bone)},
              {"in_fov", MakeBoolNpy({n}, one)},
              {"hidden", MakeBoolNpy({n}, none)},
              {"dist_joint", MakeNpy<double>({n}, std::vector<double>(n, 5.0))}});
    manifest["poses"].push_back({{"file", pose.name + ".nii.gz"},
                                 {"points", pose.name + ".npz"},
                                 {"T", {Ras(pose.upper), Ras(pose.lower)}}});
  }
  std::ofstream(folder / "manifest.json") << manifest;
  return ReadTruth(folder);
}

// In both bones, and in the tissue around them.
KnownPose AsTheHingeMoves(const std::string& name, const HingePose& pose) {
  KnownPose known{name, pose.scan_from_upper, Hinge::ScanFromLower(pose), {}, {}, {}};
  const Eigen::Vector3d places[] = {{2, 1, 17}, {-2, 1, -17}, {9, 8, 15}, {-9, 7, -16}, {8, -9, 1}};
  for (const Eigen::Vector3d& place : places) {
    known.in_template.push_back({place});
    known.in_scan.push_back(Hinge::Moved({place}, pose));
    known.bone.push_back(known.bone.size() < 2 ? uint8_t(known.bone.size() + 1) : uint8_t(0));
  }
  return known;
}

double MeanDistance(const std::vector<PointMm>& a, const std::vector<PointMm>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i].lps - b[i].lps).norm();
  return sum / double(a.size());
}

class EvaluatedHinge : public BuiltHinge {
 protected:
  static Evaluation Against(const std::vector<KnownPose>& poses, const Model& model = *model_) {
    const testing_support::ScratchFolder folder;
    const Truth truth = Written(folder.path(), model.bones(), poses);
    const auto engine = model.MakeEngine(SharedBackend());
    return Evaluate(SharedBackend(), model, engine.get(), &truth, {});
  }
  // With something else in the place of what the second scan has.
  template <class T>
  static Model With(Digest ModelScan::*part, T other) {
    const testing_support::ScratchFolder folder;
    ModelManifest manifest = model_->manifest();
    const Digest key = Hasher().Add("other").Add(manifest.scans[1].*part).Finish();
    StageCache(ModelPath() / "artifacts").Write(key, BytesOf(other).view());
    manifest.scans[1].*part = key;
    WriteManifest(folder.path() / "model.json", manifest);
    return Model::Load(folder.path(), ModelPath() / "artifacts");
  }
  static std::vector<PointMm> BodyVoxels(size_t step) {
    const Mask& body = model_->body();
    std::vector<PointMm> points;
    for (size_t v = 0; v < body.values.size(); v += step)
      if (body.values[v]) points.push_back(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}));
    return points;
  }
};

TEST_F(EvaluatedHinge, IsAsNearTheTruthAsItsMotionIsFound) {
  const auto poses = testing_support::HingePoses();
  const HingePose between{RadFromDeg(13), poses[1].scan_from_upper};
  std::vector<KnownPose> known;
  for (size_t k = 0; k < poses.size(); ++k)
    known.push_back(AsTheHingeMoves("pose0" + std::to_string(k), poses[k]));
  known.push_back(AsTheHingeMoves("pose07", between));
  const Evaluation e = Against(known);
  ASSERT_EQ(e.scans.size(), 2u);
  for (size_t k = 0; k < 2; ++k) {
    const auto& distances = e.scans[k].distances;
    EXPECT_EQ(distances.at("register").points, 5);
    EXPECT_NEAR(distances.at("source").all, MeanDistance(known[k + 1].in_template, known[k + 1].in_scan),
                1e-6)
        << "nothing is moved";
    EXPECT_LT(distances.at("register").all, 0.2);
    EXPECT_LT(distances.at("initialise").all, 0.6);
    EXPECT_GT(distances.at("initialise").all, distances.at("register").all);
    ASSERT_EQ(e.scans[k].bone_errors.size(), 2u);
    for (const BoneError& bone : e.scans[k].bone_errors) EXPECT_LT(bone.translation_mm, 0.6) << bone.bone;
  }
  ASSERT_EQ(e.unseen.size(), 1u) << "neither the template's pose nor a scan's";
  EXPECT_EQ(e.unseen[0].name, "pose07");
  const auto& unseen = e.unseen[0].distances;
  EXPECT_EQ(unseen.at("vbd").points, 5);
  EXPECT_LT(unseen.at("vbd").all, 0.4);
  EXPECT_LT(unseen.at("evd").all, 0.2);
  EXPECT_LT(unseen.at("evd").all, unseen.at("vbd").all) << "the examples tell something";
  EXPECT_LT(unseen.at("elastic").all, 1.1 * unseen.at("evd").all);
  EXPECT_NE(unseen.at("elastic").all, unseen.at("evd").all);
}

// The truth is what was found and something more: 5 degrees about a bone's centroid, 0.5 mm, and 2 mm for
// points, also beyond the model's grid.
TEST_F(EvaluatedHinge, CountsWhatTheTruthHasMore) {
  const BoneFits& fits = model_->scan_fits()[1];
  const auto more = [&](size_t bone) {
    const RigidTransform& found = fits[bone].scan_from_template;
    const PointMm centroid = model_->bones().bones[bone].centroid;
    RigidTransform truth = found * RotationAbout(centroid, {1, 2, 2}, bone * RadFromDeg(5));
    truth.translation_mm += bone * Eigen::Vector3d(0, 0.3, 0.4);
    return truth;
  };
  KnownPose known{"pose02", more(0), more(1), BodyVoxels(97), {}, {}};
  known.in_template.push_back(model_->body().grid.ToMm(PointVox{Eigen::Vector3d(20, 21, -3)}));
  known.bone.assign(known.in_template.size(), 0);
  known.in_scan = MapPointsToScan(*model_, "pose02", ScanStage::kRegister, known.in_template);
  for (PointMm& x : known.in_scan) x.lps.x() += 2;
  const Evaluation e = Against({known});
  EXPECT_TRUE(e.unseen.empty());
  EXPECT_TRUE(e.scans[0].distances.empty()) << "of this scan there is no truth";
  EXPECT_TRUE(e.scans[0].bone_errors.empty());
  const ScanEvaluation& scan = e.scans[1];
  EXPECT_EQ(scan.distances.at("register").points, int64_t(known.in_scan.size()));
  EXPECT_NEAR(scan.distances.at("register").all, 2, 1e-6);
  EXPECT_NEAR(scan.distances.at("initialise").all,
              MeanDistance(MapPointsToScan(*model_, "pose02", ScanStage::kInitialise, known.in_template),
                           known.in_scan),
              1e-6);
  EXPECT_EQ(scan.bone_errors[0].bone, "upper");
  EXPECT_NEAR(scan.bone_errors[0].rotation_deg, 0, 1e-3);
  EXPECT_NEAR(scan.bone_errors[0].translation_mm, 0, 1e-6);
  EXPECT_EQ(scan.bone_errors[1].bone, "lower");
  EXPECT_NEAR(scan.bone_errors[1].rotation_deg, 5, 1e-3);
  EXPECT_NEAR(scan.bone_errors[1].translation_mm, 0.5, 1e-6);
}

// Points are 1 mm off where the registration is sure, 3 mm where it is not, as in half of this body, and 7 mm
// where no voxel of the body is: of these it says nothing.
TEST_F(EvaluatedHinge, TellsWhereItIsSureFromWhereItIsNot) {
  const Grid& grid = model_->body().grid;
  RegisteredScan registered = *model_->LoadRegistered(1);
  for (size_t v = 0; v < grid.VoxelCount() / 2; ++v)
    registered.place_error_steps.values[v] = kPlaceErrorInDoubt;
  const Mask percent = ConfidencePercent(registered.place_error_steps);
  KnownPose known = AsTheHingeMoves("pose02", testing_support::HingePoses()[2]);
  known.in_template = BodyVoxels(97);
  const size_t in_body = known.in_template.size();
  ASSERT_EQ(model_->body()(1, 1, 1), 0);
  known.in_template.push_back(grid.ToMm(1, 1, 1));
  known.in_template.push_back(grid.ToMm(PointVox{Eigen::Vector3d(20, 21, -3)}));
  known.bone.assign(known.in_template.size(), 0);
  known.in_scan = MapPointsToScan(*model_, "pose02", ScanStage::kRegister, known.in_template);
  int64_t sure = 0;
  for (size_t i = 0; i < in_body; ++i) {
    const Eigen::Vector3i p = grid.ToVox(known.in_template[i]).ijk.array().round().cast<int>();
    const bool is_sure = percent(p.x(), p.y(), p.z()) >= kUnsurePercent;
    known.in_scan[i].lps.x() += is_sure ? 1 : 3;
    sure += is_sure;
  }
  for (size_t i = in_body; i < known.in_scan.size(); ++i) known.in_scan[i].lps.x() += 7;
  const Evaluation e = Against({known}, With(&ModelScan::registered, registered));
  const std::map<std::string, Distances>& found = e.scans[1].by_confidence;
  ASSERT_GT(sure, 0);
  EXPECT_EQ(found.at("sure").points, sure);
  EXPECT_NEAR(found.at("sure").all, 1, 1e-6);
  ASSERT_LT(sure, int64_t(in_body));
  EXPECT_EQ(found.at("unsure").points, int64_t(in_body) - sure);
  EXPECT_NEAR(found.at("unsure").all, 3, 1e-6);
}

// The lower bone is bent so far that skinning turns the crease inside out.
TEST_F(EvaluatedHinge, CountsWhereTheBonesAloneFold) {
  BoneFits bent = model_->scan_fits()[1];
  bent[1].scan_from_template =
      bent[0].scan_from_template * RotationAbout(Hinge::Centre(), Hinge::Axis(), RadFromDeg(100));
  const Model model = With(&ModelScan::fits, bent);
  const std::vector<PointMm> body = BodyVoxels(1);
  std::array<std::vector<PointMm>, 3> ahead, behind;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step_mm = model.body().grid.MmFromVox().col(axis);
    std::vector<PointMm> one_on = body, one_back = body;
    for (size_t i = 0; i < body.size(); ++i) one_on[i].lps += step_mm, one_back[i].lps -= step_mm;
    ahead[size_t(axis)] = MapPointsToScan(model, "pose02", ScanStage::kInitialise, one_on);
    behind[size_t(axis)] = MapPointsToScan(model, "pose02", ScanStage::kInitialise, one_back);
  }
  int64_t folded = 0;
  for (size_t i = 0; i < body.size(); ++i) {
    Eigen::Matrix3d slope;
    for (int axis = 0; axis < 3; ++axis)
      slope.col(axis) = ahead[size_t(axis)][i].lps - behind[size_t(axis)][i].lps;
    folded += slope.determinant() <= 0;
  }
  ASSERT_GT(folded, 0);
  const Evaluation e = Evaluate(SharedBackend(), model, nullptr, nullptr, {});
  const std::map<std::string, double>& by_stage = e.scans[1].folded_by_stage;
  EXPECT_EQ(by_stage.at("source"), 0);
  EXPECT_NEAR(by_stage.at("initialise"), double(folded) / double(body.size()), 2e-4);
  EXPECT_EQ(by_stage.at("register"), model.manifest().scans[1].folded_fraction);
}

// Without examples a scan is as far off as eq. 2; the other scan's, which bent half or twice as far, explain
// a part of that.
TEST_F(EvaluatedHinge, AScanThatIsLeftOutIsExplainedInPart) {
  const std::vector<PointMm> body = BodyVoxels(1);
  const auto engine = model_->MakeEngine(SharedBackend());
  const std::vector<LeftOutEvaluation> left_out = LeaveOneOut(*model_, *engine, {});
  ASSERT_EQ(left_out.size(), 2u);
  for (const LeftOutEvaluation& row : left_out) {
    const double by_bones = MeanDistance(MapPointsToScan(*model_, row.name, ScanStage::kInitialise, body),
                                         MapPointsToScan(*model_, row.name, ScanStage::kRegister, body));
    EXPECT_NEAR(row.distance_mm.at(DeformationMode::kVbd), by_bones, 0.01) << row.name;
    EXPECT_GT(row.distance_mm.at(DeformationMode::kEvd), 0.15 * row.distance_mm.at(DeformationMode::kVbd))
        << row.name << ": its own example is not used";
    EXPECT_LT(row.distance_mm.at(DeformationMode::kEvd), 0.8 * row.distance_mm.at(DeformationMode::kVbd))
        << row.name;
  }
}

// The same scan twice: what is left out is known from its twin.
TEST_F(EvaluatedHinge, AScanWithATwinIsExplainedWhole) {
  Study study = *study_;
  study.scans.push_back({"twin", study.scans.back().volume});
  const auto folder = scratch_->path() / "with-a-twin";
  BuildModel(study, {}, folder, ModelPath() / "artifacts", SharedBackend(), {});
  const Model model = Model::Load(folder, ModelPath() / "artifacts");
  const auto left_out = LeaveOneOut(model, *model.MakeEngine(SharedBackend()), {});
  ASSERT_EQ(left_out.size(), 3u);
  for (const size_t k : {1u, 2u}) {
    EXPECT_LT(left_out[k].distance_mm.at(DeformationMode::kEvd), 0.02) << left_out[k].name;
    EXPECT_GT(left_out[k].distance_mm.at(DeformationMode::kVbd), 0.2) << left_out[k].name;
  }
  EXPECT_GT(left_out[0].distance_mm.at(DeformationMode::kEvd), 0.02) << "it has none";
}

}  // namespace
}  // namespace kvx
