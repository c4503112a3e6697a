// What lies between key frames, by closed forms; and motion files read back.
#include "pipeline/posing/key_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "pipeline/model/files/motion_file.h"
#include "pipeline/posing/pose_plan.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"
#include "tests/support/without_root_powers.h"

namespace kvx {
namespace {

// Three bones in a chain, one hinge each, no scans: angles alone decide.
struct Chain {
  Chain() {
    for (int bone = 0; bone < 3; ++bone) {
      Joint joint{.child = bone, .parent = bone - 1, .centre = {{0, 30.0 * bone, 5}}};
      if (bone > 0)
        joint.dofs = {{.name = "flexion", .axis = Eigen::Vector3d(1, 0.1 * bone, 0).normalized()}};
      fit.skeleton.joints.push_back(joint);
    }
    space = PoseSpace(fit);
    residuals = BoneResiduals(fit, {});
  }
  PoseResolver Resolver() const { return {bones, scans, neutral, fit, scan_poses, space, residuals}; }
  Motion Of(const KeyFrames& frames) const { return Motion(Resolver(), frames, DeformationMode::kEvd); }
  PoseVector Bent(double b_deg, double c_deg) const {
    return Resolver().Resolve(Asked(b_deg, c_deg), DeformationMode::kEvd).scan_from_template;
  }
  static AnglePose Asked(double b_deg, double c_deg) {
    return {{{"b.flexion", RadFromDeg(b_deg)}, {"c.flexion", RadFromDeg(c_deg)}}};
  }
  std::vector<std::string> bones{"a", "b", "c"}, scans;
  std::string neutral = "neutral";
  SkeletonFit fit;
  std::vector<PoseVector> scan_poses;
  PoseSpace space;
  BoneResiduals residuals;
};

void ExpectSame(const PoseVector& a, const PoseVector& b, double tolerance = 1e-9) {
  for (size_t bone = 0; bone < a.size(); ++bone)
    EXPECT_LT((a[bone].Matrix() - b[bone].Matrix()).cwiseAbs().maxCoeff(), tolerance) << "bone " << bone;
}

KeyFrames Ramp(Interpolation interpolation) {
  return {10,
          interpolation,
          {{1, Chain::Asked(0, 0)},
           {2, Chain::Asked(40, 20)},
           {4, Chain::Asked(80, 20)},
           {5, Chain::Asked(70, 0)}}};
}

TEST(Motion, IsExactAtKeyFramesAndHeldBeyondThem) {
  const Chain chain;
  for (const auto how : {Interpolation::kLinear, Interpolation::kSlerp, Interpolation::kCubic}) {
    const KeyFrames frames = Ramp(how);
    const Motion motion = chain.Of(frames);
    EXPECT_EQ(frames.FrameCount(), 41);
    ExpectSame(motion.At(1).scan_from_template, chain.Bent(0, 0));
    ExpectSame(motion.At(2).scan_from_template, chain.Bent(40, 20));
    ExpectSame(motion.At(4).scan_from_template, chain.Bent(80, 20));
    ExpectSame(motion.At(0).scan_from_template, chain.Bent(0, 0));
    ExpectSame(motion.At(99).scan_from_template, chain.Bent(70, 0));
  }
}

TEST(Motion, EndsWithItsLastKeyFrameWhateverItsLength) {
  const Chain chain;
  for (const double length_s : {0.5, 0.55, 0.6, 0.601}) {
    const KeyFrames frames{
        10, Interpolation::kLinear, {{3, Chain::Asked(0, 0)}, {3 + length_s, Chain::Asked(55, 20)}}};
    const int last = frames.FrameCount() - 1;
    EXPECT_EQ(last, length_s < 0.51 ? 5 : length_s < 0.6001 ? 6 : 7) << length_s;
    EXPECT_DOUBLE_EQ(frames.TimeOf(last), 3 + length_s);
    EXPECT_NEAR(frames.TimeOf(last - 1), 3 + 0.1 * (last - 1), 1e-9);
    ExpectSame(chain.Of(frames).At(frames.TimeOf(last)).scan_from_template, chain.Bent(55, 20));
  }
  const KeyFrames still{10, Interpolation::kLinear, {{3, Chain::Asked(5, 0)}}};
  EXPECT_EQ(still.FrameCount(), 1);
  KeyFrames long_one{1000, Interpolation::kLinear, {{0, Chain::Asked(0, 0)}, {99.999, Chain::Asked(5, 0)}}};
  EXPECT_EQ(long_one.FrameCount(), 100000);
  EXPECT_NO_THROW(Validate(long_one));
  long_one.frames[1].time_s = 99.9995;
  EXPECT_THROW(Validate(long_one), InputError);
}

TEST(Motion, LinearAndSlerpAgreeAboutOneAxis) {
  const Chain chain;
  for (const auto how : {Interpolation::kLinear, Interpolation::kSlerp}) {
    const Motion motion = chain.Of(Ramp(how));
    ExpectSame(motion.At(1.25).scan_from_template, chain.Bent(10, 5));
    ExpectSame(motion.At(3.5).scan_from_template, chain.Bent(70, 20));
  }
}

TEST(Motion, CubicIsSmoothAndNeverOvershoots) {
  const Chain chain;
  const Motion motion = chain.Of(Ramp(Interpolation::kCubic));
  const auto angles = [&](double t) {
    return AnalysePose(chain.fit.skeleton, motion.At(t).scan_from_template).angles;
  };
  const double h = 1e-4;
  for (const double knot : {2.0, 4.0}) {
    const Eigen::VectorXd before = (angles(knot) - angles(knot - h)) / h,
                          after = (angles(knot + h) - angles(knot)) / h;
    EXPECT_LT((after - before).norm(), 0.01) << "one velocity at " << knot << " s";
  }
  for (double t = 2; t <= 4; t += 0.05) {
    EXPECT_NEAR(DegFromRad(angles(t)[1]), 20, 1e-6) << "equal key frames stay equal";
    EXPECT_LE(DegFromRad(angles(t)[0]), 80 + 1e-6);
  }
}

// 0, 10 and 100 degrees at 0, 1 and 4 s: slopes of 10 and 30 degrees a second over 1 and 3 s. In the middle
// the slope is (1 + 3) * 3 / ((2 * 3 + 1) / 10 + (3 + 2 * 1) / 30) = 12 / (13 / 15), nearer to that of the
// shorter part.
TEST(Motion, CubicSlopesWeighTheirNeighboursByTheOthersLength) {
  const Chain chain;
  const KeyFrames frames{10,
                         Interpolation::kCubic,
                         {{0, Chain::Asked(0, 0)}, {1, Chain::Asked(10, 0)}, {4, Chain::Asked(100, 0)}}};
  const Motion motion = chain.Of(frames);
  const auto flexion_deg = [&](double t) {
    return DegFromRad(AnalysePose(chain.fit.skeleton, motion.At(t).scan_from_template).angles[0]);
  };
  const double h = 1e-4;
  EXPECT_NEAR((flexion_deg(1 + h) - flexion_deg(1 - h)) / (2 * h), 12 * 15 / 13.0, 1e-2);
}

TEST(Motion, BoneTransformsTurnAboutTheirJoints) {
  const Chain chain;
  const auto frame = [&](double b, double c) {
    BonePose pose;
    const PoseVector bent = chain.Bent(b, c);
    for (size_t bone = 0; bone < 3; ++bone) pose.scan_from_template[chain.bones[bone]] = bent[bone];
    return pose;
  };
  const KeyFrames frames{10, Interpolation::kLinear, {{0, frame(0, 0)}, {1, frame(60, 90)}}};
  ExpectSame(chain.Of(frames).At(0.5).scan_from_template, chain.Bent(30, 45));
  KeyFrames cubic = frames;
  cubic.interpolation = Interpolation::kCubic;
  EXPECT_THROW(chain.Of(cubic), InputError);
}

std::string Refusal(const std::function<void()>& run) {
  return testing_support::RefusalOf<InputError>(run, "accepted");
}

TEST(MotionFile, KeyFramesAreReadAndCheckedByField) {
  const KeyFrames frames = ParseKeyFrames(
      R"({"fps": 5, "interpolation": "cubic", "frames": [{"time": 0, "joints": {}}, {"time": 2, "joints": {"b.flexion": 90}}, {"time": 3, "scan": "half"}]})");
  EXPECT_EQ(frames.FrameCount(), 16);
  EXPECT_NEAR(std::get<AnglePose>(frames.frames[1].pose).angles_rad.at("b.flexion"), RadFromDeg(90), 1e-12);
  EXPECT_EQ(std::get<ScanPose>(frames.frames[2].pose).scan, "half");
  EXPECT_THAT(Refusal([] { ParseKeyFrames(R"({"frames": [{"time": 0}]})"); }),
              testing::HasSubstr("frames[0]"));
  EXPECT_THAT(Refusal([] { ParseKeyFrames(R"({"frames": []})"); }), testing::HasSubstr("frames"));
  EXPECT_THAT(Refusal([] {
                ParseKeyFrames(R"({"frames": [{"time": 1, "joints": {}}, {"time": 1, "joints": {}}]})");
              }),
              testing::HasSubstr("frames[1].time"));
  EXPECT_THAT(Refusal([] { ParseKeyFrames(R"({"fps": 0, "frames": [{"time": 1, "joints": {}}]})"); }),
              testing::HasSubstr("fps"));
}

TEST(MotionFile, WhatCannotBeReadSaysWhy) {
  const testing_support::ScratchFolder folder;
  const auto file = folder.path() / "a.json";
  EXPECT_THAT(Refusal([&] { ReadMotion(file, {}, {}); }), testing::HasSubstr("check that it exists"));
  std::filesystem::create_directory(file);
  EXPECT_THAT(Refusal([&] { ReadMotion(file, {}, {}); }), testing::HasSubstr("is a folder"));
  std::filesystem::remove(file);
  std::ofstream(file) << R"({"frames": [{"time": 0, "joints": {}}]})";
  ASSERT_EQ(ReadMotion(file, {}, {}).frames.size(), 1u);
  std::filesystem::permissions(file, std::filesystem::perms::none);
  testing_support::WithoutRootPowers([&] { EXPECT_THROW(ReadMotion(file, {}, {}), Denied); });
}

TEST(MotionFile, FieldsThatNobodyReadsAreRefusedByName) {
  EXPECT_THAT(Refusal([] { ParseKeyFrames(R"({"fsp": 5, "frames": [{"time": 0, "joints": {}}]})"); }),
              testing::HasSubstr("'fsp'"));
  EXPECT_THAT(Refusal([] { ParseKeyFrames(R"({"frames": [{"time": 0, "joints": {}, "mode": "vbd"}]})"); }),
              testing::HasSubstr("'mode' in frames[0]"));
  EXPECT_THAT(Refusal([] { ParseChannelMap(R"({"a.x": {"column": "k", "offset": 5}})"); }),
              testing::HasSubstr("'offset' in a.x"));
}

TEST(MotionFile, TablesByTheirTitlesOrByAMap) {
  const KeyFrames own = ParseMotionCsv("time,b.flexion,c.flexion\r\n0,1,2\r\n0.1,10,20\r\n0.2,-3,+4\r\n", {});
  ASSERT_EQ(own.frames.size(), 3u);
  EXPECT_NEAR(own.fps, 10, 1e-12);
  EXPECT_NEAR(std::get<AnglePose>(own.frames[2].pose).angles_rad.at("b.flexion"), RadFromDeg(-3), 1e-12);
  EXPECT_EQ(ParseMotion("time,b.flexion\n0,1\n1,2\n").frames.size(), 2u);
  EXPECT_EQ(ParseMotion(R"( {"fps": 1, "frames": [{"time": 0, "joints": {}}]})").frames.size(), 1u);
  const ChannelMap map =
      ParseChannelMap(R"({"b.flexion": {"column": "knee", "scale": -2, "offset_deg": 5}})");
  const KeyFrames mapped = ParseMotionCsv("time,other,knee\n0,x,10\n1,y,20\n", map);
  EXPECT_NEAR(std::get<AnglePose>(mapped.frames[1].pose).angles_rad.at("b.flexion"), RadFromDeg(-35), 1e-12);
  EXPECT_THAT(Refusal([] { ParseMotionCsv("t,b.flexion\n0,1\n", {}); }), testing::HasSubstr("'time'"));
  EXPECT_THAT(Refusal([] { ParseMotionCsv("time,b.flexion\n0,1\n1,oops\n", {}); }),
              testing::HasSubstr("line 3"));
  EXPECT_THAT(Refusal([&] { ParseMotionCsv("time,hip\n0,1\n", map); }), testing::HasSubstr("'knee'"));
}

// As map-points takes tables of points.
TEST(MotionFile, TablesAreReadAsSpreadsheetsSaveThem) {
  for (const char* table :
       {"time,b.flexion\n0,0\n0.5,20\n", "\"time\",\"b.flexion\"\r\n\"0\",\"0\"\r\n0.5,20\r\n",
        "Time,b.flexion\n0,0\n0.5,20", "time;b.flexion\n0;0\n0,5;20\n", "time\tb.flexion\r0\t0\r0.5\t20\r",
        "time,b.flexion,\n0,0,\n0.5,20,\n,,\n", "\xEF\xBB\xBFsep=;\ntime;b.flexion\n\n0;0\n0.5;+20\n"}) {
    const KeyFrames motion = ParseMotionCsv(table, {});
    ASSERT_EQ(motion.frames.size(), 2u) << table;
    EXPECT_EQ(motion.frames[1].time_s, 0.5) << table;
    EXPECT_NEAR(std::get<AnglePose>(motion.frames[1].pose).angles_rad.at("b.flexion"), RadFromDeg(20), 1e-12)
        << table;
  }
  for (const auto& [table, complaint] :
       {std::pair("time,b.flexion\n0,0\n0,5,20\n", "line 3: there are more columns"),
        std::pair("time,b.flexion\n0,0\n1\n", "line 3: there are fewer columns"),
        std::pair("time,b.flexion\n0,0\n1,\n", "line 3: column 'b.flexion' is not a number"),
        std::pair("time,b.flexion\n0,nan\n", "line 2: column 'b.flexion'")}) {
    EXPECT_THAT(Refusal([&, text = table] { ParseMotionCsv(text, {}); }), testing::HasSubstr(complaint));
  }
}

// A BVH file of these angles: root with six channels, then a knee and an end.
std::string BvhOf(const std::vector<double>& knee_deg) {
  std::string text =
      "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation "
      "Yrotation\n"
      " JOINT Knee\n {\n  OFFSET 0 -40 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  End Site\n  {\n   "
      "OFFSET 0 -40 0\n  }\n }\n}\n"
      "MOTION\nFrames: " +
      std::to_string(knee_deg.size()) + "\nFrame Time: 0.04\n";
  for (const double angle : knee_deg) text += "1 2 3 4 5 6 0.5 " + std::to_string(angle) + " 0\n";
  return text;
}

TEST(MotionFile, RowsFarApartAreKeyFrames) {
  EXPECT_EQ(ParseMotion("time,b.flexion\n0,0\n4,60\n").FrameCount(), 101) << "as of the same in JSON";
  EXPECT_NEAR(ParseMotion("time,b.flexion\n0,0\n0.2,60\n0.4,50\n").fps, 5, 1e-12);
}

TEST(MotionFile, FramesPerSecondThatAreAskedForCountBeforeTheFilesAreChecked) {
  std::string table = "time,b.flexion\n";
  for (int row = 0; row < 400; ++row) table += std::to_string(row / 2000.0) + ",1\n";
  EXPECT_THAT(Refusal([&] { ParseMotionCsv(table, {}); }), testing::HasSubstr("fps"));
  EXPECT_EQ(ParseMotionCsv(table, {}, 25).FrameCount(), 6);
  EXPECT_EQ(ParseKeyFrames(R"({"fps": 5000, "frames": [{"time": 0, "joints": {}}]})", 25).fps, 25);
  EXPECT_EQ(ParseBvh(BvhOf({0, 1}), {{"b.flexion", {"Knee.Xrotation"}}}, 50).fps, 50);
}

TEST(MotionFile, BvhComesBackThroughItsMap) {
  const std::vector<double> knee{0, 12.5, 60, -3.25};
  const KeyFrames motion = ParseBvh(BvhOf(knee), ParseChannelMap(R"({"b.flexion": "Knee.Xrotation"})"));
  ASSERT_EQ(motion.frames.size(), knee.size());
  EXPECT_NEAR(motion.fps, 25, 1e-9);
  for (size_t f = 0; f < knee.size(); ++f) {
    EXPECT_NEAR(motion.frames[f].time_s, 0.04 * double(f), 1e-12);
    EXPECT_NEAR(std::get<AnglePose>(motion.frames[f].pose).angles_rad.at("b.flexion"), RadFromDeg(knee[f]),
                1e-9);
  }
  EXPECT_THAT(Refusal([&] { ParseBvh(BvhOf(knee), {}); }), testing::HasSubstr("map"));
  EXPECT_THAT(Refusal([&] {
                ParseBvh(BvhOf(knee), {{"b.flexion", {"Knee.Wrotation"}}});
              }),
              testing::HasSubstr("'Knee.Wrotation'"));
  EXPECT_THAT(Refusal([&] {
                ParseBvh(BvhOf(knee).substr(0, 300), {{"b.flexion", {"Knee.Xrotation"}}});
              }),
              testing::HasSubstr("BVH"));
}

TEST(PosePlan, CountsEigenposesAndProposesWhatIsFarFromTheScans) {
  Chain chain;
  chain.fit.scan_angles = {Eigen::Vector2d(0.8, 0)};
  chain.fit.scan_residuals = {std::vector<Twist>(3, Twist::Zero())};
  std::vector<JointAngles> poses;  // half with the second joint straight, half with it bent
  for (int i = 0; i < 20; ++i) poses.push_back(Eigen::Vector2d(0.05 * i, i < 10 ? 0.0 : 1.0));
  const PosePlan plan = PlanPoses(PoseSpace(chain.fit), poses, 2);
  ASSERT_EQ(plan.explained.size(), 2u);
  EXPECT_EQ(EigenposesFor(plan, 0.9), 1);
  EXPECT_EQ(EigenposesFor(plan, 0.99), 2);
  EXPECT_NEAR(plan.explained[1], 1, 1e-12);
  ASSERT_EQ(plan.next.size(), 2u);
  EXPECT_LT(plan.next[0].uncertainty_after, plan.uncertainty);
  EXPECT_LT(plan.next[1].uncertainty_after, plan.next[0].uncertainty_after);
  EXPECT_EQ(poses[size_t(plan.next[0].pose)][1], 1.0) << "the straight half was scanned already";
}

// Each next scan is the one of all poses that leaves least uncertainty beside those before it.
TEST(PosePlan, ProposesTheBestOfAllPosesEachTime) {
  Chain chain;
  chain.fit.scan_angles = {Eigen::Vector2d(0.3, 0.2)};
  chain.fit.scan_residuals = {std::vector<Twist>(3, Twist::Zero())};
  std::vector<JointAngles> poses;
  for (int i = 0; i < 15; ++i) poses.push_back(Eigen::Vector2d(0.1 * (i % 5), 0.25 * (i / 5) * (i / 5)));
  PoseSpace known(chain.fit);
  const auto left_by = [&](const PoseSpace& space) {
    double sum = 0;
    for (const JointAngles& pose : poses) sum += space.Uncertainty(pose).mean();
    return sum / double(poses.size());
  };
  const PosePlan plan = PlanPoses(known, poses, 3);
  EXPECT_NEAR(plan.uncertainty, left_by(known), 1e-12);
  ASSERT_EQ(plan.next.size(), 3u);
  for (const auto& next : plan.next) {
    double least = 1e9;
    for (const JointAngles& pose : poses) least = std::min(least, left_by(known.With(pose)));
    known = known.With(poses[size_t(next.pose)]);
    EXPECT_NEAR(left_by(known), least, 1e-12);
    EXPECT_NEAR(next.uncertainty_after, least, 1e-12);
  }
}

// One scan at 60 degrees, of steps up to there and back. What is unknown grows from the template and from the
// scan; a share of what moves at a pose would be greatest beside the template, where nothing moves.
TEST(PosePlan, ProposesWhereTissueIsFarthestOff) {
  Chain chain;
  chain.fit.scan_angles = {Eigen::Vector2d(RadFromDeg(60), 0)};
  chain.fit.scan_residuals = {std::vector<Twist>(3, Twist::Zero())};
  std::vector<JointAngles> poses;
  for (int n = 0; n < 64; ++n)
    poses.push_back(Eigen::Vector2d(RadFromDeg(30 - 30 * std::cos(kPi * n / 32)), 0));
  const PosePlan plan = PlanPoses(PoseSpace(chain.fit), poses, 1);
  ASSERT_EQ(plan.next.size(), 1u);
  const double proposed_deg = DegFromRad(poses[size_t(plan.next[0].pose)][0]);
  EXPECT_GT(proposed_deg, 15);
  EXPECT_LT(proposed_deg, 50);
}

TEST(PosePlan, ProposesNothingWhereNothingIsUnknown) {
  Chain chain;
  chain.fit.scan_angles = {Eigen::Vector2d(0.7, 0)};
  chain.fit.scan_residuals = {std::vector<Twist>(3, Twist::Zero())};
  const std::vector<JointAngles> poses{Eigen::Vector2d(0, 0), Eigen::Vector2d(0.7, 0)};
  const PosePlan plan = PlanPoses(PoseSpace(chain.fit), poses, 3);
  EXPECT_EQ(plan.uncertainty, 0);
  EXPECT_TRUE(plan.next.empty());
}

// Four poses about (3, 4), 2 to either side along the first angle and 1 along the second: squares 4 to 1,
// wherever the middle lies.
TEST(PosePlan, EigenposesAreOfWhatVaries) {
  Chain chain;
  chain.fit.scan_angles = {Eigen::Vector2d(0.8, 0)};
  chain.fit.scan_residuals = {std::vector<Twist>(3, Twist::Zero())};
  std::vector<JointAngles> poses;
  for (const double a : {-2.0, 2.0})
    for (const double b : {-1.0, 1.0}) poses.push_back(Eigen::Vector2d(3 + a, 4 + b));
  const PosePlan plan = PlanPoses(PoseSpace(chain.fit), poses, 0);
  ASSERT_EQ(plan.explained.size(), 2u);
  EXPECT_NEAR(plan.explained[0], 0.8, 1e-12);
  EXPECT_NEAR(plan.explained[1], 1, 1e-12);
}

// 190 degrees are as bones show them -170, which in pose space, and for eigenposes, lies elsewhere.
TEST(PosePlan, LooksAtTheAnglesThatTheMotionAsksFor) {
  const Chain chain;
  for (const auto how : {Interpolation::kLinear, Interpolation::kCubic}) {
    std::vector<double> times_s;
    const KeyFrames frames{2, how, {{0, Chain::Asked(150, 0)}, {1, Chain::Asked(190, 10)}}};
    const std::vector<JointAngles> poses = AnglesAlong(chain.Resolver(), frames, 10, times_s);
    ASSERT_EQ(poses.size(), 3u);
    EXPECT_NEAR(DegFromRad(poses[1][0]), 170, 1e-9);
    EXPECT_NEAR(DegFromRad(poses[2][0]), 190, 1e-9);
    EXPECT_NEAR(DegFromRad(poses[2][1]), 10, 1e-9);
  }
}

// Bones that are interpolated have the angles that they show.
TEST(PosePlan, ReadsAnglesFromBonesWhereNoneAreGiven) {
  const Chain chain;
  std::vector<double> times_s;
  const PoseVector bent = chain.Bent(40, 20);
  const BonePose bones{{{"a", bent[0]}, {"b", bent[1]}, {"c", bent[2]}}};
  const KeyFrames frames{2, Interpolation::kLinear, {{0, Chain::Asked(0, 0)}, {1, bones}}};
  const std::vector<JointAngles> poses = AnglesAlong(chain.Resolver(), frames, 10, times_s);
  ASSERT_EQ(poses.size(), 3u);
  EXPECT_NEAR(DegFromRad(poses[1][0]), 20, 1e-9);
  EXPECT_NEAR(DegFromRad(poses[2][1]), 20, 1e-9);
}

TEST(PosePlan, ModelsWithoutMovingJointsHaveNone) {
  const std::vector<JointAngles> poses(3, JointAngles(0));
  EXPECT_THAT(Refusal([&] { PlanPoses(PoseSpace(SkeletonFit()), poses, 1); }),
              testing::HasSubstr("none of the model's joints moves"));
}

}  // namespace
}  // namespace kvx
