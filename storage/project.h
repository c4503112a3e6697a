// Whose records a handle sees. Every subject and job belongs to one project;
// what hangs on a subject belongs to the same.
#pragma once
#include <optional>
#include <string>

namespace kvx {

inline constexpr char kDefaultProject[] = "default";  // of a service without authentication

// Absent: all projects, for workers and the command line.
// A record of another project is as good as not there.
using ProjectFilter = std::optional<std::string>;

inline std::string ProjectOfNew(const ProjectFilter& project) { return project.value_or(kDefaultProject); }

}  // namespace kvx
