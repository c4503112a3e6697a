// NIfTI-1 and NIfTI-2 single files (.nii, .nii.gz), read without ITK:
// its reader refuses 64-bit integers and trusts headers.
#pragma once
#include <filesystem>

#include "pipeline/io/volume_file.h"

namespace kvx {

Scan ReadNifti(const std::filesystem::path& path);
VolumeInfo ReadNiftiInfo(const std::filesystem::path& path);

}  // namespace kvx
