// The paths of studies need not be UTF-8.
#include "cli/service/submission.h"

#include <cstdio>
#include <map>

#include "cli/terminal/terminal_line.h"

namespace kvx {
namespace {

// Of one that has ended.
std::string WhatIsToSay(const ServiceJson& outcome) {
  if (EndedBadly(outcome["state"])) return ReasonOf(outcome);
  return CountedWarnings(WarningsOf(outcome).size());
}

void PrintTable(const std::vector<Submission>& submissions) {
  for (const std::string& batch : BatchesOf(submissions)) std::printf("batch %s\n", batch.c_str());
  for (const Submission& one : submissions) {
    const ServiceJson& o = one.outcome;
    const std::string state = o["state"];
    if (submissions.size() == 1) {
      std::printf("model %s\njob %s %s\n", o["id"].get_ref<const std::string&>().c_str(),
                  o["job"].get_ref<const std::string&>().c_str(), state.c_str());
      continue;
    }
    const std::string title = FilledTo(std::max<size_t>(28, WidthOf(one.title)), one.title);
    std::printf("%s %-9s %s  %s\n", title.c_str(), state.c_str(), o.value("id", std::string("-")).c_str(),
                WhatIsToSay(o).c_str());
  }
  RequirePrinted();
}

void PrintJson(const ServiceJson& document) {
  PrintDocument(document.dump(1, ' ', false, ServiceJson::error_handler_t::replace));
}

void TellAllWarnings(const std::vector<Submission>& submissions) {
  for (const Submission& one : submissions)
    TellWarnings(one.outcome, submissions.size() == 1 ? "" : one.title + ": ");
}

std::filesystem::path Whole(const std::filesystem::path& study) {
  return std::filesystem::absolute(study).lexically_normal();
}

std::string TitleOf(const std::filesystem::path& study, size_t parts) {
  std::filesystem::path rest = Whole(study);
  if (rest.filename() == "study.json" && rest.parent_path().has_filename()) rest = rest.parent_path();
  std::filesystem::path title = rest.filename();
  while (--parts > 0 && (rest = rest.parent_path()).has_filename()) title = rest.filename() / title;
  return title.string();
}

// Gives those that share theirs with another study a longer one. False: there are none, or no longer ones.
bool TellApart(std::vector<Submission>& submissions, size_t parts) {
  std::map<std::string, std::set<std::filesystem::path>> called;
  for (const Submission& one : submissions) called[one.title].insert(Whole(one.study));
  bool longer = false;
  for (Submission& one : submissions) {
    if (called[one.title].size() == 1) continue;
    const std::string title = TitleOf(one.study, parts);
    longer |= title != one.title;
    one.title = title;
  }
  return longer;
}

}  // namespace

std::vector<Submission> SubmissionsOf(const std::vector<std::filesystem::path>& studies) {
  std::vector<Submission> submissions;
  for (const std::filesystem::path& study : studies)
    submissions.push_back({study, TitleOf(study, 1), {}, {{"study", study.string()}}});
  for (size_t parts = 2; TellApart(submissions, parts);) ++parts;
  return submissions;
}

void Refuse(Submission& one, const std::string& why) {
  one.outcome["state"] = "failed";
  one.outcome["error"] = ProblemOf(why);
}

std::set<std::string> BatchesOf(const std::vector<Submission>& submissions) {
  std::set<std::string> batches;
  for (const Submission& one : submissions)
    if (one.outcome.contains("batch")) batches.insert(one.outcome["batch"].get<std::string>());
  return batches;
}

void Print(const std::vector<Submission>& submissions, const std::string& batch,
           const CommandContext& context) {
  TellAllWarnings(submissions);
  if (!context.json) return PrintTable(submissions);
  if (submissions.size() == 1) return PrintJson(submissions[0].outcome);
  ServiceJson all{{"batch", batch.empty() ? ServiceJson() : ServiceJson(batch)},
                  {"studies", ServiceJson::array()}};
  for (const Submission& one : submissions) all["studies"].push_back(one.outcome);
  PrintJson(all);
}

void RequireAllWell(const std::vector<Submission>& submissions) {
  size_t failed = 0;
  for (const Submission& one : submissions) {
    if (!EndedBadly(one.outcome["state"])) continue;
    ++failed;
    if (submissions.size() == 1) throw Unavailable("the build failed: " + ReasonOf(one.outcome));
  }
  if (failed > 0) {
    throw Unavailable(std::to_string(failed) + " of " + std::to_string(submissions.size()) +
                      " studies have no model");
  }
}

}  // namespace kvx
