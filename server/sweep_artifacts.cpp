// Builds hold a shared flock(2) on one file, a sweep an exclusive one: it works across worker processes, and
// a killed one leaves none behind. Kept is every artefact whose key stands in some model.json,
// and its note of seconds.
#include "server/sweep_artifacts.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "pipeline/io/whole_file.h"
#include "pipeline/model/build/step.h"
#include "server/log.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
constexpr size_t kHexDigits = 64;

fs::path LockFile(const DataFolder& data) { return data.artifacts() / "sweep.lock"; }
fs::path WishFile(const DataFolder& data) { return data.artifacts() / "sweep.wanted"; }

int OpenLock(const DataFolder& data) {
  const int file = ::open(LockFile(data).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) throw Unavailable("the data folder cannot be written");
  return file;
}

// Every run of exactly 64 hexadecimal digits in the text.
void AddKeys(const std::string& text, std::set<std::string>& keys) {
  const std::string_view digits = "0123456789abcdef";
  for (size_t begin = 0; (begin = text.find_first_of(digits, begin)) != text.npos;) {
    const size_t end = std::min(text.find_first_not_of(digits, begin), text.size());
    if (end - begin == kHexDigits) {
      const std::string key = text.substr(begin, kHexDigits);
      keys.insert(key);
      keys.insert(SecondsKey(Digest::FromHex(key)).Hex());
    }
    begin = end;
  }
}

// Empty where there is none. One that is there and cannot be read whole would let all that its model needs
// count as unused.
std::string DocumentOf(const fs::path& model) {
  const fs::path path = model / "model.json";
  try {
    const std::string text = WholeFile(path);
    if (text.empty() && !fs::exists(fs::symlink_status(path))) return "";
    if (nlohmann::json::accept(text)) return text;
  } catch (const Unavailable&) {
  }
  throw Unavailable("the document of " + model.filename().string() +
                    " cannot be read whole; if that stays so, restore it or remove the model's subject");
}

std::set<std::string> KeysOfModels(const DataFolder& data) {
  std::set<std::string> keys;
  for (const auto& model : fs::directory_iterator(data.root() / "models"))
    AddKeys(DocumentOf(model.path()), keys);
  return keys;
}

int64_t RemoveOthers(const fs::path& artifacts, const std::set<std::string>& keys) {
  int64_t removed = 0;
  for (const auto& folder : fs::directory_iterator(artifacts)) {
    if (!folder.is_directory()) continue;
    for (const auto& file : fs::directory_iterator(folder)) {
      if (keys.contains(file.path().stem().string())) continue;
      removed += fs::remove(file.path());
    }
  }
  return removed;
}

}  // namespace

void WantSweep(const DataFolder& data) { std::ofstream(WishFile(data)).put('\n'); }

void SweepArtifacts(const DataFolder& data) try {
  if (!fs::exists(WishFile(data))) return;
  const int lock = OpenLock(data);
  const std::shared_ptr<void> held(nullptr, [lock](void*) { ::close(lock); });  // whatever is thrown
  if (::flock(lock, LOCK_EX | LOCK_NB) == 0) {
    const int64_t removed = RemoveOthers(data.artifacts(), KeysOfModels(data));
    fs::remove(WishFile(data));
    LogInfo("artefacts swept", {{"removed", removed}});
  }
} catch (...) {
  LogError("artefacts not swept", {{"error", DescribeForLog(std::current_exception())}});
}

SweepAfterwards::SweepAfterwards(const DataFolder& data) : data_(data), lock_(OpenLock(data)) {
  ::flock(lock_, LOCK_SH);
}

SweepAfterwards::~SweepAfterwards() {
  ::close(lock_);
  SweepArtifacts(data_);
}

}  // namespace kvx
