// Whether a NRRD or MetaImage holds all of its voxels, as they were written: ITK asks neither for the end of
// a packed stream nor for its checksum, and takes text that ends early.
#pragma once
#include "pipeline/io/text_header.h"

namespace kvx {

// The header describes `values` numbers of `bytes` bytes together. Throws InputError where packed voxels end
// early, fail their checksum or unpack to another length, where text holds fewer numbers, and where there is
// room for all raw voxels of a file twice: they are of another type, or of several frames. Those that end
// early are noticed elsewhere (MostVoxelBytes). Needs little memory, whatever the file claims.
void RequireSoundVoxels(const TextHeader& header, size_t values, size_t bytes);

}  // namespace kvx
