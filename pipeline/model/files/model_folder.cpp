// A folder is a model's when its model.json is one's, or when it holds what a build leaves there and nothing
// else.
#include "pipeline/model/files/model_folder.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/errors.h"
#include "pipeline/io/atomic_file.h"
#include "pipeline/model/files/manifest.h"

namespace kvx {
namespace {

const char kNoModel[] =
    "the output folder is no model and holds what no build left there; choose a new folder (nothing was "
    "changed)";

// A build leaves model.json, its stages, and if it was killed perhaps a temporary model.json.
bool CouldBeOurs(const std::filesystem::path& entry, const std::filesystem::path& stages) {
  const std::string name = entry.filename().string();
  const bool of_a_desktop = name == ".DS_Store" || name == "Thumbs.db" || name.starts_with("._");
  return name == stages || name == "artifacts" || name == "model.json" || name.starts_with(".part-") ||
         of_a_desktop;
}

bool IsWholeModel(const std::filesystem::path& document) {
  std::ifstream in(document, std::ios::binary);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  return json.is_object() && json.value("kind", nlohmann::json()) == kModelKind;
}

// Nobody can say whose a document is that cannot be read; stages beside it can.
bool MayBeDamagedModel(const std::filesystem::path& document, const std::filesystem::path& stages) {
  std::ifstream in(document, std::ios::binary);
  if (!nlohmann::json::parse(in, nullptr, false).is_discarded()) return false;
  const std::filesystem::path folder = document.parent_path();
  return std::filesystem::is_directory(folder / stages) ||
         std::filesystem::is_directory(folder / "artifacts");
}

// A model.json that is damaged, or of another version, is to be built again: in the same place. What else
// lies beside one that is whole, as posed volumes, is the user's choice: a build leaves it alone.
void RequireModelFolder(const std::filesystem::path& model, const std::filesystem::path& stages) {
  if (!std::filesystem::exists(model)) return;
  if (!std::filesystem::is_directory(model))
    throw InputError("the output path is a file's, not a model's; choose a new folder (nothing was changed)");
  const std::filesystem::path document = model / "model.json";
  if (std::filesystem::is_directory(document)) throw InputError(kNoModel);
  if (IsWholeModel(document)) return;
  bool ours = !std::filesystem::exists(document) || MayBeDamagedModel(document, stages);
  for (const auto& entry : std::filesystem::directory_iterator(model))
    ours &= CouldBeOurs(entry.path(), stages);
  if (!ours) throw InputError(kNoModel);
}

// Its document is written when all is done, which may take hours.
void RequireMayHold(const std::filesystem::path& model) try {
  const AtomicFile tried(model / "model.json");
} catch (const Denied&) {
  throw Denied("nothing may be written into the output folder; choose a place where you may write");
}

}  // namespace

void MakeModelFolder(const std::filesystem::path& model, const std::filesystem::path& stages) {
  RequireModelFolder(model, *stages.begin());
  std::error_code error;
  std::filesystem::create_directories(model, error);
  if (IsDenial(error)) throw Denied("the output folder may not be made; choose a place where you may write");
  if (error) throw InputError("the output folder cannot be made; choose a place where you may write");
  RequireMayHold(model);
}

}  // namespace kvx
