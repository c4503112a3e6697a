// Volumes and pictures that come one after the other: 4-D NIfTI, numbered files, video.
#pragma once
#include <filesystem>
#include <memory>

#include "core/scan.h"
#include "pipeline/io/png_file.h"

namespace kvx {

// Takes frames in order. What is written appears under its name only with Finish.
template <class Frame>
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void Add(const Frame& frame) = 0;
  virtual void Finish() = 0;
};

// .nii or .nii.gz with a time axis; all frames on one grid. Throws InputError for more than 32767 frames.
std::unique_ptr<FrameSink<Volume>> NiftiSequence(const std::filesystem::path& path, ScalarType type,
                                                 int frames, double fps);
// frame_0000.nii.gz, ... in a folder that is made where it is missing. `extension` as in WriteVolume.
std::unique_ptr<FrameSink<Volume>> VolumeFolder(const std::filesystem::path& folder,
                                                const std::string& extension, ScalarType type);
// frame_0000.png, ...
std::unique_ptr<FrameSink<GreyPicture>> PictureFolder(const std::filesystem::path& folder);

// .mp4, .mkv, .webm, .gif through the program ffmpeg.
bool IsVideoName(const std::filesystem::path& path);
bool HasVideoProgram();
// Throws Unavailable where ffmpeg is not installed or refuses.
std::unique_ptr<FrameSink<GreyPicture>> VideoFile(const std::filesystem::path& path, double fps);

}  // namespace kvx
