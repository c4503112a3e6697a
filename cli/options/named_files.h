// Files by the names that the user typed: what is not there is not found, what is wrong is told by its name.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/study.h"
#include "core/text/named_error.h"

namespace kvx {

// Throws NotFound for a file or folder that does not exist.
void RequireThere(const std::filesystem::path& named);
// Throws now what writing this file in the end would: a folder of that name, a place where nothing can be
// written.
void RequireMayWrite(const std::filesystem::path& named);
// Throws UsageError where an output would take the place of another file of the same command, `what`.
void RequireOther(const std::filesystem::path& out, const std::filesystem::path& other,
                  std::string_view what);
// Makes the folder where it is missing, and throws now what writing files into it in the end would; by its
// name.
void RequireMayFill(const std::filesystem::path& folder);
// Throws InputError unless volumes are written by this name, or it has the extension `other`, for `is_for`.
void RequireVolumeOr(std::string_view other, std::string_view is_for, const std::filesystem::path& out);
// The file's bytes, to be asked for within FromFile. Throws Denied when it may not be read, InputError
// when it cannot be.
std::string ContentOf(const std::filesystem::path& named);
// DICOM is read in a child process first: on some damaged files its reader ends the whole process. Other
// formats are left alone. To be called before this process has threads of its own (it forks).
// Throws InputError that begins with `name`.
void RequireReadableDicom(const std::filesystem::path& scan, const std::string& name);
// The same of a label map, of strokes, or of a folder of masks of these bones; nothing where there is no
// path.
void RequireReadableSegments(const std::filesystem::path& labels, const std::string& name,
                             const std::vector<StudyBone>& bones = {});

// What `read` makes of the file; its InputError or Denied gets the file's name. The pipeline names no paths
// itself: the service must not tell them.
template <class Read>
auto FromFile(const std::filesystem::path& named, const Read& read) {
  RequireThere(named);
  return WithName<InputError, Denied>(named.string(), [&] { return read(named); });
}

}  // namespace kvx
