// The names of seconds are those of the model's manifest, which holds one number for several stages.
#include "pipeline/model/study_steps.h"

#include <map>
#include <string>

namespace kvx {
namespace {

ModelScan ScanEntry(ScanSteps& s) {
  const MeasureScan::Output& measured = s.measures->Load();
  return {s.study.name,       s.scan->key(),     s.fits->key(),           s.registered->key(),
          ExampleKey(s),      measured.by_stage, measured.control_points, measured.folded_fraction,
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

}  // namespace

ModelManifest ManifestOf(StudySteps& steps) {
  ModelManifest manifest;
  manifest.program_version = KVX_VERSION;
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
