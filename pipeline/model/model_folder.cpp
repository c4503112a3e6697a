// A folder is a model's when it holds what a build leaves there and nothing else.
#include "pipeline/model/model_folder.h"

#include "core/errors.h"
#include "pipeline/model/model.h"

namespace kvx {
namespace {

// A model's folder holds model.json, artifacts/, and perhaps what a killed build left of a temporary
// model.json.
bool CouldBeOurs(const std::filesystem::path& entry) {
  const std::string name = entry.filename().string();
  return name == "artifacts" || name == "model.json" || name.starts_with(".part-");
}

void RequireModelFolder(const std::filesystem::path& model) {
  if (!std::filesystem::exists(model)) return;
  constexpr const char* kNotOurs =
      "the output path exists and is not a model; choose a new folder (nothing was changed)";
  if (!std::filesystem::is_directory(model)) throw InputError(kNotOurs);
  for (const auto& entry : std::filesystem::directory_iterator(model)) {
    if (!CouldBeOurs(entry.path())) throw InputError(kNotOurs);
  }
  if (!std::filesystem::exists(model / "model.json")) return;
  try {
    ReadManifest(model / "model.json");
  } catch (const Error&) {
    throw InputError(kNotOurs);
  }
}

}  // namespace

void MakeModelFolder(const std::filesystem::path& model) {
  RequireModelFolder(model);
  std::error_code error;
  std::filesystem::create_directories(model, error);
  if (error) throw InputError("the output folder cannot be made; choose a place where you may write");
}

}  // namespace kvx
