// One study of 'kinevox submit' and how it fares; what is printed of all of them in the end.
#pragma once
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "cli/service/asked_jobs.h"

namespace kvx {

// A study that fails does not stop the others.
struct Submission {
  std::filesystem::path study;
  std::string title;             // short, and no other study's
  ServiceJson request, outcome;  // outcome: {"study", "id", "job", "state", "batch"?, "result" or "error"}
};

// In their order. A title is the study's folder or, of a file with a name of its own, that name, with as much
// of the path before it as tells it from the others.
std::vector<Submission> SubmissionsOf(const std::vector<std::filesystem::path>& studies);
void Refuse(Submission& one, const std::string& why);  // it has no model
std::set<std::string> BatchesOf(const std::vector<Submission>& submissions);

// A table or one document on stdout, after what the builds warned of on stderr. `batch`: the newest, or
// empty.
void Print(const std::vector<Submission>& submissions, const std::string& batch,
           const CommandContext& context);
void RequireAllWell(const std::vector<Submission>& submissions);  // throws Unavailable

}  // namespace kvx
