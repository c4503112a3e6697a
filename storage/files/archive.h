// Zip and tar archives of one DICOM series: unpacked under caps, without using a single name from inside.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>

namespace kvx {

struct ArchiveLimits {
  int64_t entries = 20'000;                // slices of one series, with room
  int64_t total_bytes = int64_t(8) << 30;  // unpacked
  int64_t ratio = 200;                     // unpacked to packed; slices of air compress well, bombs better
  int64_t ratio_from_bytes = int64_t(64) << 20;  // small archives may compress as they like
};

// Every image becomes `folder`/<first 32 digits of its SHA-256>.dcm: names can hold patients, and paths can
// leave the folder. Hidden files and folders, DICOMDIR and what media put beside the images are left out.
// Throws InputError for links, absolute or climbing paths, caps, or damage. Returns the number of files.
// `unpacked` is told of the bytes as they come out; what it throws ends it.
int UnpackSeries(const std::filesystem::path& archive, const std::filesystem::path& folder,
                 const ArchiveLimits& limits = {}, const std::function<void(size_t)>& unpacked = {});

}  // namespace kvx
