#include "api/upload_format.h"

#include "core/errors.h"
#include "core/text/extension.h"

namespace kvx {

std::optional<UploadFormat> FindUploadFormat(const std::string& filename) {
  for (const char* suffix : {".nii.gz", ".nii", ".nrrd", ".mha", ".dcm"}) {
    if (HasExtension(filename, suffix)) return UploadFormat{suffix, false};
  }
  if (HasExtension(filename, ".tgz")) return UploadFormat{".tar.gz", true};
  for (const char* suffix : {".zip", ".tar.gz", ".tar"}) {
    if (HasExtension(filename, suffix)) return UploadFormat{suffix, true};
  }
  return std::nullopt;
}

UploadFormat RequireUploadFormat(const std::string& filename) {
  if (const auto format = FindUploadFormat(filename)) return *format;
  throw InputError(
      "'filename' ends in .nii, .nii.gz, .nrrd or .mha, in .dcm for a DICOM image of many frames, or in "
      ".zip, .tar or .tar.gz for a DICOM series");
}

}  // namespace kvx
