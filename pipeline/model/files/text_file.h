// What people write for a program to read, whole.
#pragma once
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/errors.h"

namespace kvx {

// `what` names the file in the error: "the study file". Throws Denied where it may not be read, InputError
// where it cannot be.
inline std::string FileText(const std::filesystem::path& file, const std::string& what) {
  std::error_code ignored;
  std::ifstream in(file, std::ios::binary);
  if (!in && IsDenial(errno)) throw Denied(what + " may not be read; ask its owner for the right to read it");
  if (std::filesystem::is_directory(file, ignored))
    throw InputError(what + " is a folder; give the file itself");
  const std::filesystem::file_status kind = std::filesystem::status(file, ignored);
  if (!in || !(is_regular_file(kind) || is_fifo(kind)))
    throw InputError(what + " cannot be opened; check that it exists and may be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace kvx
