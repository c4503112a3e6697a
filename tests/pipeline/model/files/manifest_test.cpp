// model.json: what is written is read again, and only artefact keys make the digest.
#include "pipeline/model/files/manifest.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/errors.h"
#include "tests/support/failing_new.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

ModelManifest SomeManifest() {
  ModelManifest m;
  m.program_version = "1.2", m.name = "knee \"a\"", m.region = "knee", m.template_scan = "pose00";
  m.device = "a device", m.method = "adaptive";
  m.template_key = Sha256("t"), m.body = Sha256("b"), m.bones = Sha256("o"), m.weights = Sha256("w"),
  m.skeleton = Sha256("s"), m.bricks = Sha256("k");
  ModelScan scan{.name = "pose01",
                 .scan = Sha256("1"),
                 .fits = Sha256("2"),
                 .registered = Sha256("3"),
                 .example = Sha256("4"),
                 .measures = {{"source", {80.125, 0.1, 0.2}}},
                 .control_points = 1234,
                 .control_points_per_level = {234, 1000},
                 .folded_fraction = 1e-5,
                 .confidence = {81.5, 0.125}};
  m.scans = {scan, scan};
  m.scans[1].name = "pose02";
  m.seconds = {{"load", 0.5}, {"total", 1.5}};
  m.warnings = {"bone 2 touches its neighbour"};
  return m;
}

TEST(Manifest, IsReadAsItWasWritten) {
  const testing_support::ScratchFolder scratch;
  const ModelManifest written = SomeManifest();
  WriteManifest(scratch.path() / "model.json", written);
  const ModelManifest read = ReadManifest(scratch.path() / "model.json");
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.method, written.method);
  EXPECT_EQ(read.weights, written.weights);
  EXPECT_EQ(read.bricks, written.bricks);
  ASSERT_EQ(read.scans.size(), 2u);
  EXPECT_EQ(read.scans[1].name, "pose02");
  EXPECT_EQ(read.scans[0].example, written.scans[0].example);
  EXPECT_EQ(read.scans[0].measures, written.scans[0].measures);
  EXPECT_EQ(read.scans[0].control_points, 1234);
  EXPECT_EQ(read.scans[0].control_points_per_level, (std::vector<int64_t>{234, 1000}));
  EXPECT_EQ(read.scans[0].folded_fraction, 1e-5);
  EXPECT_EQ(read.scans[0].confidence.mean_percent, 81.5);
  EXPECT_EQ(read.scans[0].confidence.unsure_fraction, 0.125);
  EXPECT_EQ(read.seconds, written.seconds);
  EXPECT_EQ(read.warnings, written.warnings);
  EXPECT_EQ(read.ContentDigest(), written.ContentDigest());
}

TEST(Manifest, APoseLiesInTheWorldOfTheTemplateOfItsScanOrInOneOfItsOwn) {
  ModelManifest m = SomeManifest();
  m.scans[1].scan = Sha256("another scan");
  EXPECT_EQ(WorldOf(m, AnglePose{{{"tibia.flexion", 0.5}}}), m.template_key);
  EXPECT_EQ(WorldOf(m, ScanPose{"pose00"}), m.template_key);
  EXPECT_EQ(WorldOf(m, ScanPose{"pose01"}), m.scans[0].scan);
  EXPECT_EQ(WorldOf(m, ScanPose{"pose02"}), m.scans[1].scan);
  RigidTransform moved;
  moved.translation_mm.x() = 3;
  const Digest still = WorldOf(m, BonePose{{{"femur", RigidTransform()}}}),
               shifted = WorldOf(m, BonePose{{{"femur", moved}}});
  EXPECT_EQ(WorldOf(m, BonePose{{{"femur", moved}}}), shifted);
  EXPECT_NE(still, shifted);
  EXPECT_NE(still, m.template_key);
}

TEST(Manifest, DigestIsOfArtefactsAndNotOfTimes) {
  const Digest digest = SomeManifest().ContentDigest();
  ModelManifest slower = SomeManifest();
  slower.seconds["total"] = 99;
  EXPECT_EQ(slower.ContentDigest(), digest);
  ModelManifest other = SomeManifest();
  other.scans[1].registered = Sha256("another");
  EXPECT_NE(other.ContentDigest(), digest);
  other = SomeManifest();
  std::swap(other.scans[0].scan, other.scans[0].fits);
  EXPECT_NE(other.ContentDigest(), digest);
}

// A bit is another character, and its field another value, another name, or no JSON at all; but for the e of
// a number, which may be a capital.
TEST(Manifest, ABitThatIsTurnedIsNoticed) {
  const testing_support::ScratchFolder scratch;
  const auto file = scratch.path() / "model.json";
  const ModelManifest written = SomeManifest();
  WriteManifest(file, written);
  std::string text;
  std::getline(std::ifstream(file), text, '\0');
  const std::string sum = "\"sha256\"";
  const size_t sum_from = text.find(sum);
  ASSERT_NE(sum_from, text.npos);
  int silent = 0;
  for (size_t at = 0; at < text.size(); ++at) {
    if (std::isspace(static_cast<unsigned char>(text[at]))) continue;
    if (at >= sum_from && at < sum_from + sum.size()) continue;  // a model without a sum, as those of before
    std::string damaged = text;
    damaged[at] = char(damaged[at] ^ (1 << at % 7));
    if (text[at] == 'e' && damaged[at] == 'E' && std::isdigit(static_cast<unsigned char>(text[at - 1])))
      continue;
    std::ofstream(file, std::ios::binary) << damaged;
    try {
      ReadManifest(file);
      ++silent;
    } catch (const InputError&) {
    }
  }
  EXPECT_EQ(silent, 0);
}

TEST(Manifest, ModelsWithoutASumAreReadAndTheirDigestChecked) {
  const testing_support::ScratchFolder scratch;
  const auto file = scratch.path() / "model.json";
  WriteManifest(file, SomeManifest());
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(std::ifstream(file));
  json.erase("sha256");
  json["bricks"]["version"] = 999;  // of another version: cut when it is loaded
  std::ofstream(file) << json;
  EXPECT_FALSE(ReadManifest(file).bricks);
  json["scans"][0]["name"] = "pose07";
  std::ofstream(file) << json;
  EXPECT_THROW(ReadManifest(file), InputError);
}

// Said to be damaged, a model would be built again.
TEST(Manifest, WantOfMemoryIsNoDamage) {
  const testing_support::ScratchFolder scratch;
  const auto file = scratch.path() / "model.json";
  ModelManifest manifest = SomeManifest();
  manifest.warnings = {std::string(200'000, 'w')};  // its text grows in more than ten steps
  WriteManifest(file, manifest);
  for (int granted = 0; granted < 10; ++granted) {
    const testing_support::FailingNew failing(granted);
    EXPECT_THROW(ReadManifest(file), std::bad_alloc);
  }
}

TEST(Manifest, WhatIsNoManifestIsRefused) {
  const testing_support::ScratchFolder scratch;
  EXPECT_THROW(ReadManifest(scratch.path() / "model.json"), NotFound);
  for (const char* text : {"", "{", "{}", "[1]", R"({"kind": "kinevox-model", "format": 999})",
                           R"({"kind": "kinevox-model", "format": 1})"}) {
    std::ofstream(scratch.path() / "model.json") << text;
    EXPECT_THROW(ReadManifest(scratch.path() / "model.json"), InputError) << text;
  }
}

}  // namespace
}  // namespace kvx
