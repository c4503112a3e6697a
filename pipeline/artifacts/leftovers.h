// What killed processes left of artefacts that they wrote.
#pragma once
#include <filesystem>

namespace kvx {

// Removes half-written files of a StageCache's folder that nobody writes any more; others may write
// meanwhile. What cannot be removed stays.
void RemoveLeftovers(const std::filesystem::path& artifacts);

}  // namespace kvx
