// The stage graph as it is wired, and as docs/architecture.md draws it.
#include "pipeline/model/build/study_wiring.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "pipeline/model/model.h"
#include "tests/support/built_hinge.h"

namespace kvx {
namespace {

using Edges = std::set<std::pair<std::string, std::string>>;

// Of the drawing "a --> b --> c"; files, and posing, which stores nothing, are no stages.
Edges DrawnEdges() {
  std::ifstream page(KVX_SOURCE_DIR "/docs/architecture.md");
  const std::regex arrow("\\s*-->\\s*"), file("\\w+\\(\\[.*\\]\\)");
  Edges edges;
  bool drawing = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("```")) drawing = line == "```mermaid";
    if (!drawing || line.find("-->") == line.npos) continue;
    const std::string trimmed = line.substr(line.find_first_not_of(' '));
    std::string from;
    for (std::sregex_token_iterator at(trimmed.begin(), trimmed.end(), arrow, -1), end; at != end; ++at) {
      const std::string to = std::regex_match(at->str(), file) || *at == "posing" ? "" : at->str();
      if (!from.empty() && !to.empty()) edges.insert({from, to});
      from = to;
    }
  }
  return edges;
}

// Whatever can be reached by at least one edge.
std::set<std::string> Reached(const Edges& edges, const std::string& from) {
  std::set<std::string> reached;
  std::vector<std::string> left{from};
  while (!left.empty()) {
    const std::string at = left.back();
    left.pop_back();
    for (const auto& [a, b] : edges)
      if (a == at && reached.insert(b).second) left.push_back(b);
  }
  return reached;
}

class StudyWiringTest : public testing_support::BuiltHinge {
 protected:
  // As a build wires it; nothing is made that its cache does not hold.
  static void Wire(const Study& study, const StudyWiring& wiring, StudySteps& steps) {
    for (const StudyScan& scan : study.scans) {
      if (scan.name == study.template_scan)
        steps.template_scan = wiring.Loaded(scan);
      else
        steps.scans.push_back({.study = scan, .scan = wiring.Loaded(scan)});
    }
    steps.bones = wiring.Bones();
    wiring.WireRest({});
  }

  void SetUp() override {
    Wire(*study_, wiring_, steps_);
    steps_.scans[0].completed = wiring_.Completed(0);
    steps_.bricks = wiring_.Bricks();
    for (const auto& [from, to] : EdgesOf(steps_)) edges_.insert({std::string(from), std::string(to)});
  }

  const StageCache cache_{ModelPath() / "artifacts"};
  StudySteps steps_;
  const StudyWiring wiring_{cache_, testing_support::SharedBackend(), *study_, steps_};
  Edges edges_;
};

TEST_F(StudyWiringTest, GivesEveryStepTheKeyThatABuildStored) {
  const ModelManifest& manifest = model_->manifest();
  EXPECT_EQ(steps_.weights->key(), manifest.weights);
  EXPECT_EQ(steps_.skeleton->key(), manifest.skeleton);
  EXPECT_EQ(steps_.moments->key(), manifest.moments);
  for (size_t k = 0; k < steps_.scans.size(); ++k) {
    EXPECT_EQ(steps_.scans[k].registered->key(), manifest.scans[k].registered);
    EXPECT_EQ(steps_.scans[k].example->key(), manifest.scans[k].example);
  }
}

// Sums round by their order, and a registration makes much of little.
TEST_F(StudyWiringTest, ScansInAnotherOrderAreSettledAndRegisteredAlike) {
  Study turned = *study_;
  std::ranges::reverse(turned.scans);
  StudySteps steps;
  const StudyWiring wiring(cache_, testing_support::SharedBackend(), turned, steps);
  Wire(turned, wiring, steps);
  EXPECT_EQ(steps.settled->key(), steps_.settled->key());
  for (size_t k = 0; k < steps.scans.size(); ++k) {
    const ScanSteps &scan = steps.scans[k], &same = steps_.scans[steps.scans.size() - 1 - k];
    ASSERT_EQ(scan.study.name, same.study.name);
    EXPECT_TRUE(cache_.Intact(scan.fits->key())) << scan.study.name;
    EXPECT_EQ(scan.fits->key(), same.fits->key()) << scan.study.name;
    EXPECT_EQ(scan.registered->key(), same.registered->key()) << scan.study.name;
  }
}

TEST_F(StudyWiringTest, AScanThatIsThereTwiceIsRegisteredOnce) {
  Study doubled = *study_;
  doubled.scans.push_back(doubled.scans.back());
  doubled.scans.back().name = "again";
  StudySteps steps;
  const StudyWiring wiring(cache_, testing_support::SharedBackend(), doubled, steps);
  Wire(doubled, wiring, steps);
  ASSERT_EQ(steps.scans.size(), 3u);
  EXPECT_EQ(steps.scans[1].registered->key(), steps.scans[2].registered->key());
  EXPECT_NE(steps.scans[0].registered->key(), steps.scans[2].registered->key());
}

TEST_F(StudyWiringTest, NoStageTakesWhatFollowsFromIt) {
  EXPECT_GE(edges_.size(), 40u);
  for (const auto& [from, to] : edges_) EXPECT_FALSE(Reached(edges_, from).contains(from)) << from;
}

// Shorter ways than drawn are left out of the drawing, others may not be. It also has the stage `segment`,
// which this study does without.
TEST_F(StudyWiringTest, ThePageDrawsIt) {
  Edges drawn = DrawnEdges();
  for (const auto& [from, to] : edges_)
    EXPECT_TRUE(Reached(drawn, from).contains(to)) << "not drawn: " << from << " --> " << to;
  std::erase_if(drawn, [](const auto& edge) { return edge.first == "segment" || edge.second == "segment"; });
  for (const auto& [from, to] : drawn)
    EXPECT_TRUE(edges_.contains({from, to})) << "drawn only: " << from << " --> " << to;
}

}  // namespace
}  // namespace kvx
