// The whole pipeline: a study becomes a model. Finished stages are found, not redone.
#pragma once
#include "pipeline/model/model.h"
#include "pipeline/registration/register_scan.h"

namespace kvx {

struct BuildOptions {
  RegistrationMethod method = RegistrationMethod::kAdaptive;
  PaperOptions paper;  // used by kPaper
};

// Progress is reported as "load", "bones", "weights", "register_bones pose01", "joints", "register pose01",
// "examples", "measures". Writes model/model.json last. `artifacts` empty: model/artifacts.
ModelManifest BuildModel(const Study& study, const BuildOptions& options, const std::filesystem::path& model,
                         const std::filesystem::path& artifacts, Backend& backend, const Progress& progress);

}  // namespace kvx
