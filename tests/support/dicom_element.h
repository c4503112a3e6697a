// One element of a DICOM file, read without the libraries under test.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/support/fixtures.h"

namespace kvx::testing_support {

// The text of an element at the top of an explicit, little-endian file, unpadded; empty where there is none.
inline std::string ElementOf(const std::filesystem::path& image, uint16_t group, uint16_t element) {
  const std::string bytes = Content(image);
  const auto low = [](uint16_t number) { return char(number & 255); };
  const auto high = [](uint16_t number) { return char(number >> 8); };
  const std::string tag{low(group), high(group), low(element), high(element)};
  const size_t at = bytes.find(tag);
  if (at == std::string::npos) return "";
  const std::string value = bytes.substr(at + 8, size_t(uint8_t(bytes[at + 6])));
  return value.substr(0, value.find_last_not_of(std::string(" \0", 2)) + 1);
}

}  // namespace kvx::testing_support
