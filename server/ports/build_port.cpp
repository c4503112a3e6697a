// A build runs in a folder of links to blobs that looks like the study of the command line.
#include "pipeline/model/build/build_model.h"
#include "pipeline/model/files/study_file.h"
#include "pipeline/runner.h"
#include "server/ports/pipeline_ports.h"
#include "server/ports/study_folder.h"
#include "server/sweep_artifacts.h"

namespace kvx {

void PipelineBuilder::Check(const BuildTask& task) {
  const StudyFolder folder(data_, task.files);
  ParseStudy(task.study, folder.path());
}

std::unique_ptr<Backend> PipelineBuilder::TakeBackend() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      auto backend = std::move(idle_.back());
      idle_.pop_back();
      return backend;
    }
  }
  return std::make_unique<Backend>(options_);
}

void PipelineBuilder::ReturnBackend(std::unique_ptr<Backend> backend) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(backend));
}

BuildOutcome PipelineBuilder::Build(const BuildTask& task, const Progress& progress) {
  const SweepAfterwards sweep(data_);
  progress.Report("load", 0.0);
  RequireIntact(task.files);
  const StudyFolder folder(data_, task.files);
  const Study study = ParseStudy(task.study, folder.path());
  BuildOptions options;
  options.method = task.method.name == "paper" ? RegistrationMethod::kPaper : RegistrationMethod::kAdaptive;
  options.paper.max_blocks = task.method.max_blocks;
  options.paper.max_seconds = task.method.max_seconds;
  options.paper.seed = task.method.seed;
  std::filesystem::create_directories(data_.Model(task.model));  // a client cannot choose another place
  auto backend = TakeBackend();
  const ModelManifest manifest =
      BuildModel(study, options, data_.Model(task.model), data_.artifacts(), *backend, progress);
  ReturnBackend(std::move(backend));  // not after a failure: its queue may hold work of the dead build
  const auto seconds = manifest.seconds.find("total");
  return {manifest.ContentDigest().Hex(), manifest.warnings,
          seconds == manifest.seconds.end() ? 0 : seconds->second};
}

}  // namespace kvx
