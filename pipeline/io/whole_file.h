// All of a file or a failure: streams that copy each other's buffers stop without a word where memory or the
// disk gives no more.
#pragma once
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <ios>
#include <string>

#include "core/errors.h"

namespace kvx {

// Empty where there is no file. Throws Denied where it may not be read, Unavailable where it cannot be,
// std::bad_alloc.
inline std::string WholeFile(const std::filesystem::path& path) try {
  std::ifstream file(path, std::ios::binary);
  if (!file && IsDenial(errno))
    throw Denied("a file may not be read; ask its owner for the right to read it");
  if (!file && errno != ENOENT && errno != ENOTDIR) throw std::ios_base::failure("open");
  return {std::istreambuf_iterator<char>(file), {}};
} catch (const std::ios_base::failure&) {
  throw Unavailable("a file cannot be opened or read to its end; try again later");
}

}  // namespace kvx
