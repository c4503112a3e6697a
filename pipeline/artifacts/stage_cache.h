// Finished stages on disk, found again by key. A file is complete or absent: temporary name, fsync, rename.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/digest.h"
#include "pipeline/artifacts/raw_bytes.h"

namespace kvx {

// What a stage made, and the key it is known by.
template <class T>
struct Artifact {
  Digest key;
  std::shared_ptr<const T> value;
  const T& operator*() const { return *value; }
  const T* operator->() const { return value.get(); }
};

class StageCache {
 public:
  explicit StageCache(std::filesystem::path folder);  // made when first written to

  const std::filesystem::path& folder() const { return folder_; }
  std::optional<RawBytes> Read(const Digest& key) const;        // nothing when absent or damaged
  void Write(const Digest& key, std::string_view bytes) const;  // throws Unavailable when the disk is full
  void WriteUnsynced(const Digest& key, std::string_view bytes) const;  // a loss of power may take it
  bool Has(const Digest& key) const;
  bool Intact(const Digest& key) const;  // present and undamaged, without unpacking it
  std::optional<Digest> BytesDigest(
      const Digest& key) const;  // SHA-256 of what is stored, from its header; nothing when absent

 private:
  enum class Synced { kNo, kYes };
  void Write(const Digest& key, std::string_view bytes, Synced synced) const;
  std::optional<RawBytes> ReadChecked(const Digest& key) const;
  std::filesystem::path PathOf(const Digest& key) const;
  std::filesystem::path folder_;
};

}  // namespace kvx
