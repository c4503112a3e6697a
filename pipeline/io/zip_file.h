// A zip that appears whole or not at all; the same members give the same bytes.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

namespace kvx {

class ZipFile {
 public:
  explicit ZipFile(const std::filesystem::path& path);
  ~ZipFile();
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  void Add(const std::string& name, const std::string& bytes);
  void Commit();  // without it nothing is left. Every member throws Unavailable for a disk that is full

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
