// A series on its way to a service: the other way than UnpackSeries (storage/files/archive.h).
#pragma once
#include <filesystem>

#include "core/host/progress.h"

namespace kvx {

// The images in a folder and the folders in it as slice_00000, slice_00001, ... in one tar, names left
// behind; the same folder is the same bytes. Throws InputError where there are none. Progress is told, and
// asked for a wish to stop, between two images.
void PackSeries(const std::filesystem::path& folder, const std::filesystem::path& archive,
                const Progress& progress = {});

}  // namespace kvx
