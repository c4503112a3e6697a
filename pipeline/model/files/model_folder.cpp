// A folder is a model's when it holds what a build leaves there and nothing else.
#include "pipeline/model/files/model_folder.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/errors.h"
#include "pipeline/model/files/manifest.h"

namespace kvx {
namespace {

// A model's folder holds model.json, artifacts/, and perhaps what a killed build left of a temporary
// model.json.
bool CouldBeOurs(const std::filesystem::path& entry) {
  const std::string name = entry.filename().string();
  const bool of_a_desktop = name == ".DS_Store" || name == "Thumbs.db" || name.starts_with("._");
  return name == "artifacts" || name == "model.json" || name.starts_with(".part-") || of_a_desktop;
}

// A model.json that is damaged, or of another version, is to be built again: in the same place.
bool IsOfAModel(const std::filesystem::path& document) {
  std::ifstream in(document, std::ios::binary);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (json.is_discarded()) return std::filesystem::is_directory(document.parent_path() / "artifacts");
  return json.is_object() && json.value("kind", nlohmann::json()) == kModelKind;
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
  if (!IsOfAModel(model / "model.json")) throw InputError(kNotOurs);
}

}  // namespace

void MakeModelFolder(const std::filesystem::path& model) {
  RequireModelFolder(model);
  std::error_code error;
  std::filesystem::create_directories(model, error);
  if (IsDenial(error)) throw Denied("the output folder may not be made; choose a place where you may write");
  if (error) throw InputError("the output folder cannot be made; choose a place where you may write");
}

}  // namespace kvx
