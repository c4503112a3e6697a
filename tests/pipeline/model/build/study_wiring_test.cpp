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
  void SetUp() override {
    for (const StudyScan& scan : study_->scans) {
      if (scan.name == study_->template_scan)
        steps_.template_scan = wiring_.Loaded(scan);
      else
        steps_.scans.push_back({.study = scan, .scan = wiring_.Loaded(scan)});
    }
    steps_.bones = wiring_.Bones();
    wiring_.WireRest({});
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
