// Pictures that come one after the other, as a video.
#pragma once
#include <filesystem>
#include <memory>

#include "pipeline/io/frame_sink.h"
#include "pipeline/io/png_file.h"

namespace kvx {

// .mp4, .mkv, .webm, .gif through the program ffmpeg.
bool IsVideoName(const std::filesystem::path& path);
bool HasVideoProgram();
// Throws Unavailable where ffmpeg is not installed or refuses.
std::unique_ptr<FrameSink<GreyPicture>> VideoFile(const std::filesystem::path& path, double fps);

}  // namespace kvx
