// A first look at NRRD and MetaImage headers, before ITK believes them.
#pragma once
#include <filesystem>

#include "pipeline/io/itk_image.h"

namespace kvx {

// Upper bound of the bytes that the voxels can unpack to, from the sizes of the files on disk. Throws
// InputError for sizes or dimensions that make no sense and for data files that
// do not lie beside the header: a header must not reach elsewhere.
double RequireSaneTextHeader(FileFormat format, const std::filesystem::path& path);

// The file beside the header that holds the voxels; empty where they follow the header itself. Throws
// likewise.
std::filesystem::path DetachedDataOf(FileFormat format, const std::filesystem::path& path);

}  // namespace kvx
