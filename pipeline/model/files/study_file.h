// study.json of the contract, checked once at the door.
#pragma once
#include <filesystem>
#include <string_view>

#include "core/study.h"

namespace kvx {

// Paths are made absolute against the file's folder.
// Throws InputError naming the field that is wrong and what it should be.
Study ReadStudy(const std::filesystem::path& file);
Study ParseStudy(std::string_view json, const std::filesystem::path& base);

}  // namespace kvx
