// What an uploaded file is, by the end of its name; the rest of the name is not looked at.
#pragma once
#include <optional>
#include <string>

namespace kvx {

struct UploadFormat {
  std::string suffix;    // ".nii.gz"; for archives ".zip", ".tar", ".tar.gz"
  bool archive = false;  // of one DICOM series
};
std::optional<UploadFormat> FindUploadFormat(const std::string& filename);
UploadFormat RequireUploadFormat(const std::string& filename);  // throws InputError

}  // namespace kvx
