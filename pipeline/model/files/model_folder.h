// The folder that a build writes: nothing of anybody else's is ever overwritten.
#pragma once
#include <filesystem>

namespace kvx {

// Makes `model`, or takes a folder that already is a model. Throws InputError for anything else, Denied where
// a build could not write its document in the end. `stages`: the folder of its stages, as seen from the
// model's.
void MakeModelFolder(const std::filesystem::path& model, const std::filesystem::path& stages);

}  // namespace kvx
