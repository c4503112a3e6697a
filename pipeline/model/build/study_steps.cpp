// The names of seconds are those of the model's manifest, which holds one number for several stages.
#include "pipeline/model/build/study_steps.h"
#include "core/version.h"

#include <map>
#include <string>

namespace kvx {
namespace {

ModelScan ScanEntry(ScanSteps& s) {
  const MeasureScan::Output& measured = s.measures->Load();
  return {s.study.name,
          s.scan->key(),
          s.fits->key(),
          s.registered->key(),
          ExampleKey(s),
          measured.by_stage,
          measured.control_points,
          measured.control_points_per_level,
          measured.folded_fraction,
          measured.confidence};
}

std::map<std::string, double> SecondsOf(const StudySteps& steps) {
  std::map<std::string, double> seconds{
      {"load", steps.template_scan->Seconds()},
      {"bones", steps.bones->Seconds() + (steps.segmented ? steps.segmented->Seconds() : 0.0)},
      {"joints", steps.skeleton->Seconds()},
      {"register_bones", steps.settled->Seconds()},
      {"body", steps.body->Seconds() + steps.region->Seconds()},
      {"weights", steps.weights->Seconds()},
      {"examples", steps.moments->Seconds() + steps.bricks->Seconds()}};
  for (const ScanSteps& s : steps.scans) AddSeconds(s, seconds);
  double total = 0;
  for (const auto& [stage, spent] : seconds) total += spent;
  seconds["total"] = total;
  return seconds;
}

struct MadeStage {
  std::string_view name;
  Digest key;
  std::vector<Digest> taken;
};

template <class Stage>
void AddStage(const std::unique_ptr<Step<Stage>>& step, std::vector<MadeStage>& stages) {
  if (step) stages.push_back({Stage::kName, step->key(), step->InputKeys()});
}

std::vector<MadeStage> StagesOf(const StudySteps& steps) {
  std::vector<MadeStage> stages;
  const auto add = [&](const auto&... each) { (AddStage(each, stages), ...); };
  add(steps.template_scan, steps.segmented, steps.bones, steps.body, steps.weights, steps.region,
      steps.settled, steps.skeleton, steps.moments, steps.bricks);
  for (const ScanSteps& s : steps.scans) {
    add(s.scan, s.found, s.refined, s.fits, s.registered, s.example, s.shown, s.samples, s.completed,
        s.measures);
  }
  return stages;
}

}  // namespace

StageEdges EdgesOf(const StudySteps& steps) {
  const std::vector<MadeStage> stages = StagesOf(steps);
  std::map<Digest, std::string_view> name_of;
  for (const MadeStage& stage : stages) name_of[stage.key] = stage.name;
  StageEdges edges;
  for (const MadeStage& stage : stages) {
    for (const Digest& key : stage.taken) {
      const auto from = name_of.find(key);
      if (from != name_of.end()) edges.insert({from->second, stage.name});
    }
  }
  return edges;
}

ModelManifest ManifestOf(StudySteps& steps) {
  ModelManifest manifest;
  manifest.program_version = ProgramVersion();
  manifest.template_key = steps.template_scan->key();
  manifest.body = steps.body->key();
  manifest.bones = steps.bones->key();
  manifest.weights = steps.weights->key();
  manifest.skeleton = steps.skeleton->key();
  manifest.moments = steps.moments->key();
  manifest.bricks = steps.bricks->key();
  for (ScanSteps& s : steps.scans) manifest.scans.push_back(ScanEntry(s));
  manifest.seconds = SecondsOf(steps);
  return manifest;
}

}  // namespace kvx
