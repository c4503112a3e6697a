// Distances and bone errors against values that can be written down; truth files turned from RAS to LPS.
#include "pipeline/evaluate/evaluate.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "pipeline/evaluate/paper_table.h"
#include "pipeline/evaluate/report.h"
#include "pipeline/io/npz_file.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

TruthPoints FourPoints() {
  TruthPoints truth;
  truth.in_template.resize(5);
  truth.in_scan.resize(5);
  truth.tissue = {1, 1, 0, 1, 1};
  truth.bone = {0, 0, 7, 0, 0};
  truth.counts = {1, 1, 1, 0, 1};
  truth.joint_distance_mm = {5, 50, 5, 5, 5};
  return truth;
}

TEST(Compare, SplitsDistancesByWhereThePointsAre) {
  std::vector<PointMm> mapped(5);
  mapped[0].lps = {3, 0, 4};     // soft, near a joint: 5 mm
  mapped[1].lps = {0, 1, 0};     // soft, far: 1 mm
  mapped[2].lps = {0, 0, 3};     // bone: 3 mm
  mapped[3].lps = {0, 0, 1000};  // does not count
  mapped[4].lps.x() = std::numeric_limits<double>::quiet_NaN();
  const Distances d = Compare(FourPoints(), mapped, {"marrow", "muscle"});
  EXPECT_EQ(d.points, 3);
  EXPECT_DOUBLE_EQ(d.lost_fraction, 0.25);
  EXPECT_DOUBLE_EQ(d.all, 3);
  EXPECT_DOUBLE_EQ(d.soft, 3);
  EXPECT_DOUBLE_EQ(d.joint, 5);
  EXPECT_DOUBLE_EQ(d.max, 5);
  EXPECT_DOUBLE_EQ(d.by_tissue.at("muscle"), 3);
  EXPECT_DOUBLE_EQ(d.by_tissue.at("marrow"), 3);
}

TruthPoints SoftPoints(size_t count) {
  TruthPoints truth;
  truth.in_template.resize(count), truth.in_scan.resize(count);
  truth.tissue.assign(count, 0), truth.bone.assign(count, 0), truth.counts.assign(count, 1);
  truth.joint_distance_mm.assign(count, 50);
  return truth;
}

TEST(Compare, NineteenOfTwentyDistancesAreWithinTheNinetyFifthPercentile) {
  std::vector<PointMm> mapped(100);
  for (int i = 0; i < 100; ++i) mapped[size_t(37 * i % 100)].lps.z() = i + 1;  // 1 to 100 mm, in some order
  EXPECT_EQ(Compare(SoftPoints(100), mapped, {"muscle"}).p95, 95);
}

TEST(Compare, NearAJointIsWithinTenMillimetres) {
  TruthPoints truth = SoftPoints(3);
  truth.joint_distance_mm = {9.9f, 10.1f, 19};
  std::vector<PointMm> mapped(3);
  mapped[0].lps.x() = 2, mapped[1].lps.x() = 4, mapped[2].lps.x() = 6;
  EXPECT_DOUBLE_EQ(Compare(truth, mapped, {"muscle"}).joint, 2);
}

TEST(Compare, BoneErrorIsTheRotationBetweenAndTheCentroidsDistance) {
  const PointMm centroid{Eigen::Vector3d(10, 0, 0)};
  const RigidTransform truth = RotationAbout(centroid, {0, 0, 1}, 0.3);
  const RigidTransform turned = truth * RotationAbout(centroid, {1, 1, 0}, RadFromDeg(2));
  EXPECT_NEAR(Compare("a", turned, truth, centroid).rotation_deg, 2, 1e-9);
  EXPECT_NEAR(Compare("a", turned, truth, centroid).translation_mm, 0, 1e-9);
  const RigidTransform shifted = RigidTransform{Eigen::Quaterniond::Identity(), {0, 3, 4}} * truth;
  EXPECT_NEAR(Compare("a", shifted, truth, centroid).rotation_deg, 0, 1e-5);
  EXPECT_NEAR(Compare("a", shifted, truth, centroid).translation_mm, 5, 1e-9);
}

// Two scans, one of them with truth, and the seconds of both.
TEST(PaperTable, MeansOverScansInThePapersOrder) {
  Evaluation evaluation;
  evaluation.scans.resize(2);
  evaluation.scans[0].measures["register"] = {10, 0.5, 1.0};
  evaluation.scans[1].measures["register"] = {20, 0.7, 2.0};
  evaluation.scans[0].distances["register"].all = 3.5;
  evaluation.scans[0].folded_by_stage["register"] = 0.02;
  evaluation.scans[1].folded_by_stage["register"] = 0.04;
  evaluation.seconds = {{"register", 60}, {"register_bones", 8}};
  const std::vector<PaperRow> table = PaperTable(evaluation);
  ASSERT_EQ(table.size(), 3u);
  EXPECT_EQ(table[0].volume, "source");
  EXPECT_FALSE(table[0].med);
  EXPECT_EQ(table[1].seconds, 4);
  EXPECT_EQ(table[2].seconds, 30);
  EXPECT_DOUBLE_EQ(*table[2].med, 3.5);
  EXPECT_DOUBLE_EQ(table[2].measures.ssd, 15);
  EXPECT_DOUBLE_EQ(table[2].measures.cc, 0.6);
  EXPECT_DOUBLE_EQ(table[2].measures.mi, 1.5);
  EXPECT_DOUBLE_EQ(table[2].folded_fraction, 0.03);
  EXPECT_NE(PaperTableText(evaluation).find("3.50    15.0   0.60   1.50    3.0000"), std::string::npos)
      << PaperTableText(evaluation);
}

TEST(Compare, WhereNoPointIsThereIsNoDistance) {
  TruthPoints none = FourPoints();
  none.counts.assign(none.counts.size(), 0);
  const Distances d = Compare(none, std::vector<PointMm>(5), {"marrow", "muscle"});
  EXPECT_EQ(d.points, 0);
  for (const double value : {d.all, d.soft, d.joint, d.p95, d.max}) EXPECT_TRUE(std::isnan(value));
}

// Three scans: the first without truth, another does not show the skin.
TEST(Report, MeansCountWhatTheScansShow) {
  Evaluation e;
  e.scans.resize(3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  e.scans[2].distances["register"] = {
      .points = 9, .all = 2, .joint = 4, .by_tissue = {{"skin", 3}, {"fat", 1}}};
  e.scans[1].distances["register"] = {.points = 9, .all = 4, .joint = nan, .by_tissue = {{"fat", 5}}};
  for (ScanEvaluation& scan : e.scans) scan.measures["register"] = {10, 0.5, 1};
  const std::string text = EvaluationText(e);
  EXPECT_NE(text.find("MED    soft"), std::string::npos) << text;
  EXPECT_NE(text.find("skin                          -       3.00"), std::string::npos) << text;
  EXPECT_NE(text.find("fat                           -       3.00"), std::string::npos) << text;
  const auto mean = nlohmann::json::parse(EvaluationJson(e))["mean"]["register"];
  EXPECT_EQ(mean["med"], 3.0);
  EXPECT_EQ(mean["joint"], 4.0);
  EXPECT_EQ(EvaluationText({}).find("mean of 0   "), std::string::npos) << "a model of the template alone";
}

// Poses by name; the bone of "rest" stays where it is, that of the others moves by a millimetre.
Truth TruthOf(const std::vector<std::string>& names) {
  Truth truth;
  for (const std::string& name : names) {
    const RigidTransform moved{Eigen::Quaterniond::Identity(), Eigen::Vector3d::UnitX()};
    truth.poses.push_back({name, {{"femur", name == "rest" ? RigidTransform{} : moved}}, {}});
  }
  return truth;
}

TEST(MatchNames, UnseenAreThePosesOfNoScansName) {
  const MatchedNames names = MatchNames(TruthOf({"rest", "a", "b", "c"}), "rest", {"b"});
  EXPECT_TRUE(names.without_truth.empty());
  EXPECT_EQ(names.unseen, (std::vector<size_t>{1, 3}));
}

// Scan "first" may be pose "a", which the model would then have seen.
TEST(MatchNames, AScanOfAnotherNameMayBeAnyPose) {
  const MatchedNames names = MatchNames(TruthOf({"rest", "a", "b"}), "rest", {"first", "b"});
  EXPECT_EQ(names.without_truth, std::vector<std::string>{"first"});
  EXPECT_TRUE(names.unseen.empty());
  EXPECT_EQ(MatchNames(TruthOf({"rest", "a"}), "neutral", {"a"}).without_truth,
            std::vector<std::string>{"neutral"});
}

TEST(MatchNames, AnotherTemplateIsRefused) {
  EXPECT_THROW(MatchNames(TruthOf({"rest", "a", "b"}), "a", {"b"}), InputError);
}

class TruthFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(scratch_.path() / "truth");
    // T in RAS: a quarter turn about z, then (1, 2, 3).
    std::ofstream(scratch_.path() / "manifest.json") << R"({"tissues": ["air", "muscle"],
      "bones": [{"label": 1, "name": "femur", "parent": 0, "centroid": [1, 2, 3]}],
      "poses": [{"file": "pose01.nii.gz", "points": "truth/p.npz", "T": [[[0,-1,0,1],[1,0,0,2],[0,0,1,3],[0,0,0,1]]]}]})";
    // T (1, 2, 3), three times: shown, hidden by what has come before it, and not in the scan.
    const std::vector<double> in_template{1, 2, 3, 1, 2, 3, 1, 2, 3}, position{-1, 3, 6, -1, 3, 6, -1, 3, 6};
    const std::vector<uint8_t> one{1, 1, 1}, in_fov{1, 1, 0}, hidden{0, 1, 0};
    WriteNpz(scratch_.path() / "truth/p.npz",
             {{"template", MakeNpy<double>({3, 3}, in_template)},
              {"position", MakeNpy<double>({3, 3}, position)},
              {"tissue", MakeNpy<uint8_t>({3}, one)},
              {"bone", MakeNpy<uint8_t>({3}, one)},
              {"in_fov", MakeBoolNpy({3}, in_fov)},
              {"hidden", MakeBoolNpy({3}, hidden)},
              {"dist_joint", MakeNpy<double>({3}, std::vector<double>{7.5, 7.5, 7.5})}});
  }
  testing_support::ScratchFolder scratch_;
};

TEST_F(TruthFiles, BecomeLps) {
  const Truth truth = ReadTruth(scratch_.path());
  ASSERT_EQ(truth.poses.size(), 1u);
  EXPECT_EQ(truth.poses[0].name, "pose01");
  EXPECT_EQ(truth.bone_centroids.at("femur").lps, Eigen::Vector3d(-1, -2, 3));
  const TruthPoints points = ReadTruthPoints(truth.poses[0]);
  EXPECT_EQ(points.in_template[0].lps, Eigen::Vector3d(-1, -2, 3));
  const PointMm moved = truth.poses[0].scan_from_template.at("femur") * points.in_template[0];
  EXPECT_LT((moved.lps - points.in_scan[0].lps).norm(), 1e-12);
  EXPECT_EQ(points.counts, (std::vector<uint8_t>{1, 0, 0}));
  EXPECT_EQ(points.joint_distance_mm[0], 7.5f);
}

TEST_F(TruthFiles, MissingOrForeignOnesAreReported) {
  EXPECT_THROW(ReadTruth(scratch_.path() / "truth"), NotFound);
  std::ofstream(scratch_.path() / "manifest.json") << R"({"bones": 3})";
  EXPECT_THROW(ReadTruth(scratch_.path()), InputError);
}

}  // namespace
}  // namespace kvx
