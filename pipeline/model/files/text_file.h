// What people write for a program to read, whole.
#pragma once
#include <filesystem>
#include <fstream>
#include <string>

#include "core/errors.h"

namespace kvx {

// `what` names the file in the error: "the study file". Throws InputError where it cannot be read.
inline std::string FileText(const std::filesystem::path& file, const std::string& what) {
  std::error_code ignored;
  std::ifstream in(file, std::ios::binary);
  if (!std::filesystem::is_regular_file(file, ignored) || !in) {
    throw InputError(what + " cannot be opened; check that it exists and may be read");
  }
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace kvx
