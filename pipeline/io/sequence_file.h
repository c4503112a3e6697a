// Volumes and pictures that come one after the other: 4-D NIfTI, numbered files.
#pragma once
#include <filesystem>
#include <memory>

#include "core/scan.h"
#include "pipeline/io/frame_sink.h"
#include "pipeline/io/png_file.h"

namespace kvx {

// .nii or .nii.gz with a time axis; all frames on one grid. Throws InputError for more than 32767 frames.
std::unique_ptr<FrameSink<Volume>> NiftiSequence(const std::filesystem::path& path, ScalarType type,
                                                 int frames, double fps);
// frame_0000.nii.gz, ... in a folder that is made where it is missing. `extension` as in WriteVolume.
std::unique_ptr<FrameSink<Volume>> VolumeFolder(const std::filesystem::path& folder,
                                                const std::string& extension, ScalarType type);
// frame_0000.png, ...
std::unique_ptr<FrameSink<GreyPicture>> PictureFolder(const std::filesystem::path& folder);

}  // namespace kvx
