// From scans to a model: resumed, repeatable, described, and true to the hinge it was made from.
#include "pipeline/model/build/build_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/blend.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/info.h"
#include "pipeline/model/map_to_scan.h"
#include "tests/support/built_hinge.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_study.h"

namespace kvx {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing_support::BuiltHinge;
using testing_support::Hinge;
using testing_support::ScratchFolder;
using testing_support::SharedBackend;

// Of every scan: a bone is in the list of its certainty, and in no other.
void ExpectEachBoneInItsList(const nlohmann::json& info) {
  for (const nlohmann::json& scan : info.at("scans")) {
    for (const auto& [bone, fit] : scan.at("bone_fits").items()) {
      for (const std::string certainty : {"coarse", "uncertain", "doubtful"}) {
        const auto listed = scan.at(certainty + "_bones").get<std::vector<std::string>>();
        EXPECT_EQ(std::ranges::count(listed, bone), fit.at("certainty") == certainty)
            << bone << ", " << certainty;
      }
    }
  }
}

TEST_F(BuiltHinge, FindsTheMotionOfTheBones) {
  const auto poses = testing_support::HingePoses();
  for (size_t k = 1; k < poses.size(); ++k) {
    const BoneFits& fits = model_->scan_fits()[k - 1];
    for (const int bone : {0, 1}) {
      const RigidTransform truth = bone == 0 ? poses[k].scan_from_upper : Hinge::ScanFromLower(poses[k]);
      const PointMm centroid = model_->bones().bones[size_t(bone)].centroid;
      EXPECT_LT(((fits[size_t(bone)].scan_from_template * centroid).lps - (truth * centroid).lps).norm(), 0.6)
          << "scan " << k << ", bone " << bone;
    }
  }
}

TEST_F(BuiltHinge, MapsPointsInBonesRigidlyAndTissueCloseToTheTruth) {
  const auto poses = testing_support::HingePoses();
  const PointMm in_bone{Eigen::Vector3d(-2, 1, -18)}, in_tissue{Eigen::Vector3d(9, 8, 15)};
  const auto mapped = [&](ScanStage stage) {
    return MapPointsToScan(*model_, "pose02", stage, {in_bone, in_tissue});
  };
  const RigidTransform& lower = model_->scan_fits()[1][1].scan_from_template;
  EXPECT_LT((mapped(ScanStage::kInitialise)[0].lps - (lower * in_bone).lps).norm(), 0.05);
  EXPECT_LT((mapped(ScanStage::kRegister)[0].lps - (lower * in_bone).lps).norm(), 0.5);
  EXPECT_LT((mapped(ScanStage::kRegister)[1].lps - Hinge::Moved(in_tissue, poses[2]).lps).norm(), 1.0);
}

// The paper's rows "initialise" are eq. 2: half way from a voxel of bone to the next, half of what each makes
// of the point.
TEST_F(BuiltHinge, InitialiseIsEquation2WithoutABonesBorder) {
  const LabelMap& labels = model_->bones().labels;
  const WeightMap& weights = model_->weights();
  const PoseVector pose = PoseOf(model_->scan_fits()[1]);
  size_t beside = 0;
  for (size_t v = 0; v + 1 < labels.values.size(); v += 7) {
    const Eigen::Vector3i at = labels.grid.Ijk(v);
    if (at.x() + 1 == labels.grid.size.x() || (labels.values[v] != 0) == (labels.values[v + 1] != 0))
      continue;
    const PointMm x = labels.grid.ToMm(PointVox{at.cast<double>() + Eigen::Vector3d(0.5, 0, 0)});
    const Eigen::Vector3d mean = 0.5 * (Apply(Blend(weights.values[v], pose), x.lps) +
                                        Apply(Blend(weights.values[v + 1], pose), x.lps));
    const PointMm found = MapPointsToScan(*model_, "pose02", ScanStage::kInitialise, {x})[0];
    ASSERT_LT((found.lps - mean).norm(), 1e-6);
    ++beside;
  }
  EXPECT_GT(beside, 10u);
}

// Moved into the air beside the limb, with a label that nobody named.
TEST_F(BuiltHinge, ALabelMapThatDoesNotFitIsToldAndKeptInTheModel) {
  EXPECT_TRUE(model_->manifest().warnings.empty());
  ScratchFolder scratch;
  Study study = *study_;
  study.scans.resize(1);
  study.bone_labels = scratch.path() / "moved.nii.gz";
  LabelMap labels = Hinge::Labels();
  labels.grid.origin.lps.x() += 14;
  labels(0, 0, 0) = 77;
  WriteLabels(study.bone_labels, labels);
  const ModelManifest made = BuildModel(study, {}, scratch.path() / "model", {}, SharedBackend(), {});
  using testing::ElementsAre, testing::AllOf, testing::HasSubstr;
  EXPECT_THAT(made.warnings,
              ElementsAre(AllOf(HasSubstr("no bone"), HasSubstr("77")), HasSubstr("borders of the label map"),
                          HasSubstr("outside the body"), HasSubstr("turns these joints")));
  const auto info = nlohmann::json::parse(InfoJson(Model::Load(scratch.path() / "model")));
  EXPECT_EQ(info.at("warnings"), nlohmann::json(made.warnings));
}

// A scan that does not belong is named, and posing does without it.
TEST_F(BuiltHinge, AMirroredScanIsToldAndChangesNoPose) {
  ScratchFolder scratch;
  Study study = *study_;
  Volume mirrored = ReadScan(study.scans[1].volume).volume;
  std::ranges::reverse(mirrored.values);
  study.scans.push_back({"mirrored", scratch.path() / "mirrored.nii.gz"});
  WriteVolume(study.scans.back().volume, mirrored, ScalarType::kUint8);
  const ModelManifest made = BuildModel(study, {}, scratch.path() / "model", {}, SharedBackend(), {});
  EXPECT_THAT(made.warnings.front(), HasSubstr("shows mirror images"));
  EXPECT_THAT(made.warnings, Contains(HasSubstr("scan 'mirrored'")).Times(int(made.warnings.size())));
  EXPECT_THAT(made.warnings.back(), HasSubstr("posing does without it"));
  const Model with = Model::Load(scratch.path() / "model");
  const auto info = nlohmann::json::parse(InfoJson(with));
  EXPECT_EQ(info["scans"].back()["verdict"], "mirrored");
  EXPECT_EQ(info["scans"].back()["doubtful_bones"].size(), 2u);
  ExpectEachBoneInItsList(info);
  const auto engine = model_->MakeEngine(SharedBackend()), engine_with = with.MakeEngine(SharedBackend());
  const Mask& body = model_->body();
  std::vector<PointMm> points;
  for (size_t v = 0; v < body.values.size(); v += 23)
    if (body.values[v]) points.push_back(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}));
  BonePose where_it_was_found;
  for (size_t b = 0; b < with.bone_names().size(); ++b)
    where_it_was_found.scan_from_template[with.bone_names()[b]] =
        with.scan_fits().back()[b].scan_from_template;
  for (const DeformationMode mode : {DeformationMode::kEvd, DeformationMode::kElastic}) {
    const auto without_it = engine->MapPoints(model_->Resolve(where_it_was_found, mode), points),
               with_it = engine_with->MapPoints(with.Resolve(where_it_was_found, mode), points);
    for (size_t p = 0; p < points.size(); ++p)
      ASSERT_LT((with_it[p].lps - without_it[p].lps).norm(), 0.02 * body.grid.MeanSpacingMm())
          << NameOf(mode);
  }
}

// By its name and by its joint angles, which leave out how the whole limb lay.
TEST_F(BuiltHinge, ATrainingPoseIsItsRegisteredCorrespondence) {
  const auto engine = model_->MakeEngine(SharedBackend());
  const Mask& body = model_->body();
  std::vector<PointMm> points;
  for (size_t v = 0; v < body.values.size(); v += 23)
    if (body.values[v]) points.push_back(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}));
  for (size_t k = 0; k < model_->scan_names().size(); ++k) {
    const std::string& scan = model_->scan_names()[k];
    const auto registered = MapPointsToScan(*model_, scan, ScanStage::kRegister, points);
    const ResolvedPose named = model_->Resolve(ScanPose{scan}, DeformationMode::kEvd);
    const ResolvedPose angled =
        model_->Resolver().ResolveAngles(model_->fit().scan_angles[k], DeformationMode::kEvd);
    const RigidTransform root = named.scan_from_template[0] * angled.scan_from_template[0].Inverse();
    const auto by_name = engine->MapPoints(named, points), by_angles = engine->MapPoints(angled, points);
    for (size_t p = 0; p < points.size(); ++p) {
      ASSERT_LT((by_name[p].lps - registered[p].lps).norm(), 0.02 * body.grid.MeanSpacingMm()) << scan;
      ASSERT_LT(((root * by_angles[p]).lps - registered[p].lps).norm(), 0.5 * body.grid.MeanSpacingMm())
          << scan;
    }
  }
}

TEST_F(BuiltHinge, MappingGoesOnSmoothlyOutsideTheScan) {
  const Grid& grid = model_->weights().grid;
  const PointMm inside = grid.ToMm(PointVox{Eigen::Vector3d(10, 12, 1e-9)}),
                outside = grid.ToMm(PointVox{Eigen::Vector3d(10, 12, -1e-9)});
  for (const ScanStage stage : {ScanStage::kInitialise, ScanStage::kRegister}) {
    const auto mapped = MapPointsToScan(*model_, "pose01", stage, {inside, outside});
    EXPECT_LT((mapped[0].lps - mapped[1].lps).norm(), 1e-3);
  }
  const std::vector<PointMm> points{inside, outside};
  EXPECT_EQ(MapPointsToScan(*model_, "pose00", ScanStage::kRegister, points)[1].lps, outside.lps);
  EXPECT_THROW(MapPointsToScan(*model_, "pose09", ScanStage::kRegister, points), NotFound);
}

TEST_F(BuiltHinge, RegistrationImprovesEveryMeasure) {
  for (const ModelScan& scan : model_->manifest().scans) {
    const Measures &before = scan.measures.at("source"), &after = scan.measures.at("register");
    EXPECT_LT(after.ssd, before.ssd);
    EXPECT_GT(after.cc, before.cc);
    EXPECT_GT(after.mi, before.mi);
  }
}

TEST_F(BuiltHinge, AFinishedModelIsFoundAndKeepsItsCost) {
  const ModelManifest first = model_->manifest();
  const ModelManifest again = BuildModel(*study_, {}, ModelPath(), {}, SharedBackend(), {});
  EXPECT_EQ(again.ContentDigest(), first.ContentDigest());
  EXPECT_EQ(again.seconds, first.seconds);
  EXPECT_GT(again.seconds.at("total"), 0);
}

TEST_F(BuiltHinge, ACancelledBuildGoesOnToTheSameModelValueForValue) {
  const auto other = scratch_->path() / "resumed";
  std::atomic<bool> registering = false;
  const Progress stop(
      [&](std::string_view stage, double) {
        if (stage == "register pose02") registering = true;
      },
      [&] { return registering.load(); });
  EXPECT_THROW(BuildModel(*study_, {}, other, {}, SharedBackend(), stop), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(other / "model.json"));
  const ModelManifest resumed = BuildModel(*study_, {}, other, {}, SharedBackend(), {});
  EXPECT_EQ(resumed.ContentDigest(), model_->manifest().ContentDigest());
  const Model loaded = Model::Load(other);
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(loaded.LoadRegistered(k)->scan_from_template.values,
              model_->LoadRegistered(k)->scan_from_template.values);
    EXPECT_EQ(loaded.LoadExample(k)->values, model_->LoadExample(k)->values);
  }
}

TEST_F(BuiltHinge, ABuildStopsWhereTwoStagesRunBesideEachOther) {
  const auto other = scratch_->path() / "stopped";
  std::atomic<bool> finding = false;
  const Progress stop(
      [&](std::string_view stage, double) {
        if (stage == "register_bones pose01") finding = true;
      },
      [&] { return finding.load(); });
  EXPECT_THROW(BuildModel(*study_, {}, other, {}, SharedBackend(), stop), Cancelled);
  EXPECT_EQ(BuildModel(*study_, {}, other, {}, SharedBackend(), {}).ContentDigest(),
            model_->manifest().ContentDigest());
}

TEST_F(BuiltHinge, ProgressOnlyGrowsAndNamesTheContractsStages) {
  const auto other = scratch_->path() / "watched";
  std::vector<std::string> stages;
  double last = 0;
  const Progress watch(
      [&](std::string_view stage, double fraction) {
        EXPECT_GE(fraction, last - 1e-9) << stage;
        EXPECT_LE(fraction, 1 + 1e-9);
        last = fraction;
        if (stages.empty() || stages.back() != stage) stages.emplace_back(stage);
      },
      {});
  BuildModel(*study_, {}, other, ModelPath() / "artifacts", SharedBackend(), watch);
  const std::vector<std::string> expected{"load",
                                          "bones",
                                          "weights",
                                          "register_bones pose01",
                                          "register_bones pose02",
                                          "joints",
                                          "register pose01",
                                          "examples",
                                          "measures",
                                          "register pose02",
                                          "examples",
                                          "measures",
                                          "bricks"};
  EXPECT_EQ(stages, expected);
  EXPECT_NEAR(last, 1, 1e-9);
}

// Bricks hold all that a pose needs: examples and weights need not be there. Without bricks they are cut
// again.
TEST_F(BuiltHinge, PosesFromItsBricksAreThoseFromItsExamples) {
  const auto copy = scratch_->path() / "bricks-only", older = scratch_->path() / "older";
  std::filesystem::copy(ModelPath(), copy, std::filesystem::copy_options::recursive);
  ModelManifest manifest = model_->manifest();
  ASSERT_TRUE(manifest.bricks);
  std::vector<Digest> unneeded{manifest.weights};
  for (const ModelScan& scan : manifest.scans) unneeded.push_back(scan.example);
  for (const Digest& key : unneeded)
    ASSERT_TRUE(std::filesystem::remove(copy / "artifacts" / key.Hex().substr(0, 2) / (key.Hex() + ".kva")));
  const Model without = Model::Load(copy);
  const ResolvedPose pose = without.Resolve(ScanPose{"pose02"}, DeformationMode::kEvd);
  const Volume from_bricks = without.MakeEngine(SharedBackend())->Pose(pose).volume;
  EXPECT_THROW(without.weights(), NotFound);
  manifest.bricks.reset();
  std::filesystem::create_directories(older);
  WriteManifest(older / "model.json", manifest);
  const Model cut_again = Model::Load(older, ModelPath() / "artifacts");
  EXPECT_EQ(cut_again.MakeEngine(SharedBackend())->Pose(pose).volume.values, from_bricks.values);
}

TEST_F(BuiltHinge, AFolderThatIsNoModelIsLeftAlone) {
  const auto folder = scratch_->path() / "precious";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "thesis.txt") << "years of work";
  EXPECT_THROW(BuildModel(*study_, {}, folder, {}, SharedBackend(), {}), InputError);
  EXPECT_THROW(BuildModel(*study_, {}, folder / "thesis.txt", {}, SharedBackend(), {}), InputError);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
}

TEST_F(BuiltHinge, ArtefactsThatTheModelCannotNameAreRefusedBeforeTheWork) {
  const auto model = scratch_->path() / "unnamed";
  EXPECT_THROW(BuildModel(*study_, {}, model, scratch_->path() / "art\xe9", SharedBackend(), {}), InputError);
  EXPECT_FALSE(std::filesystem::exists(model));
}

TEST_F(BuiltHinge, AMissingScanIsNamed) {
  Study study = *study_;
  study.scans[1].volume = scratch_->path() / "gone.nii.gz";
  try {
    BuildModel(study, {}, scratch_->path() / "never", {}, SharedBackend(), {});
    FAIL() << "a missing scan was accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("pose01"), std::string::npos) << error.what();
  }
}

TEST_F(BuiltHinge, InfoHoldsWhatTheContractSays) {
  const auto info = nlohmann::json::parse(InfoJson(*model_));
  for (const char* key :
       {"version", "name", "region", "template", "device", "volume", "bones", "joints", "scans", "seconds"}) {
    EXPECT_TRUE(info.contains(key)) << key;
  }
  EXPECT_EQ(info["volume"]["size"], nlohmann::json({40, 42, 60}));
  EXPECT_EQ(info["volume"]["direction"].size(), 9u);
  EXPECT_TRUE(info["bones"][0]["parent"].is_null());
  EXPECT_EQ(info["bones"][1]["parent"], "upper");
  EXPECT_EQ(info["bones"][1]["obb"]["axes"].size(), 9u);
  ASSERT_EQ(info["joints"].size(), 1u);
  EXPECT_EQ(info["joints"][0]["dofs"][0]["name"], "flexion");
  EXPECT_LT(info["joints"][0]["residual_deg"].get<double>(), 3);
  const double within_deg = info["joints"][0]["dofs"][0]["axis_within_deg"];
  EXPECT_NEAR(within_deg, DegFromRad(model_->fit().AxisWithinRad(1, 0)), 1e-9);
  EXPECT_GT(within_deg,
            testing_support::BetweenAxesDeg(model_->fit().skeleton.joints[1].dofs[0].axis, Hinge::Axis()));
  ASSERT_EQ(info["scans"].size(), 2u);
  EXPECT_EQ(info["scans"][1]["scan_from_template"]["lower"].size(), 16u);
  EXPECT_NEAR(std::abs(info["scans"][1]["joint_angles"]["lower.flexion"].get<double>()), 18, 2.5);
  EXPECT_EQ(info["scans"][1]["verdict"], "belongs");
  EXPECT_EQ(info["scans"][1]["verdict_note"], "");
  const auto& lower = info["scans"][1]["bone_fits"]["lower"];
  EXPECT_NEAR(lower["surface_within_mm"].get<double>(), 0.2, 0.2);
  EXPECT_GE(lower["turn_within_deg"].get<double>(), 2 * lower["turn_sd_deg"].get<double>());
  ExpectEachBoneInItsList(info);
  for (const char* stage : {"source", "initialise", "register"}) {
    EXPECT_TRUE(info["scans"][0]["measures"][stage].contains("mi")) << stage;
  }
  for (const char* stage : {"load", "bones", "joints", "weights", "register", "total"}) {
    EXPECT_TRUE(info["seconds"].contains(stage)) << stage;
  }
}

TEST_F(BuiltHinge, LimitsAreWiderThanWhatTheScansShow) {
  const auto info = nlohmann::json::parse(InfoJson(*model_));
  const auto flexion = info["joints"][0]["dofs"][0].get<std::map<std::string, nlohmann::json>>();
  double least = 0, most = 0;
  for (const auto& scan : info["scans"]) {
    least = std::min(least, scan["joint_angles"]["lower.flexion"].get<double>());
    most = std::max(most, scan["joint_angles"]["lower.flexion"].get<double>());
  }
  EXPECT_GT(most - least, 10);
  EXPECT_NEAR(flexion.at("scanned_min_deg"), least, 1e-6);
  EXPECT_NEAR(flexion.at("scanned_max_deg"), most, 1e-6);
  EXPECT_NEAR(flexion.at("min_deg"), least - 5, 0.01);
  EXPECT_NEAR(flexion.at("max_deg"), most + 5, 0.01);
}

// Posed by the six values that `info` states for a scan, every bone stands as it does in that scan.
TEST_F(BuiltHinge, SixDegreesOfFreedomPoseAScanBack) {
  Study study = *study_;
  study.joints = {{"lower", {"a", "b", "c", "x", "y", "z"}}};
  BuildModel(study, {}, scratch_->path() / "six", ModelPath() / "artifacts", SharedBackend(), {});
  const Model six = Model::Load(scratch_->path() / "six", ModelPath() / "artifacts");
  const auto info = nlohmann::json::parse(InfoJson(six));
  EXPECT_TRUE(info["joints"][0]["dofs"][5].contains("max_mm"));
  EXPECT_TRUE(info["joints"][0]["dofs"][5].contains("scanned_max_mm"));
  for (size_t k = 0; k < six.scan_fits().size(); ++k) {
    AnglePose asked;
    for (const auto& [name, value] : info["scans"][k]["joint_angles"].items())
      asked.angles_rad[name] = RadFromDeg(value.get<double>());
    ASSERT_EQ(asked.angles_rad.size(), 6u);
    const PoseVector posed = six.Resolver().Resolve(asked, DeformationMode::kEvd).scan_from_template;
    const BoneFits& fits = six.scan_fits()[k];
    const RigidTransform found = fits[0].scan_from_template.Inverse() * fits[1].scan_from_template;
    EXPECT_LT((posed[1].Matrix() - found.Matrix()).cwiseAbs().maxCoeff(), 1e-6) << "the root stays";
  }
}

TEST_F(BuiltHinge, AModelWithoutItsArtefactsIsReported) {
  EXPECT_THROW(Model::Load(ModelPath(), scratch_->path() / "nowhere"), NotFound);
  EXPECT_THROW(Model::Load(scratch_->path() / "no-model"), NotFound);
}

}  // namespace
}  // namespace kvx
