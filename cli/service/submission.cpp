// The paths of studies need not be UTF-8.
#include "cli/service/submission.h"

#include <cstdio>

namespace kvx {
namespace {

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
    std::printf("%-28s %-9s %s %s\n", TitleOf(one.study).c_str(), state.c_str(),
                o.value("id", std::string("-")).c_str(), EndedBadly(o["state"]) ? ReasonOf(o).c_str() : "");
  }
}

void PrintJson(const ServiceJson& document) {
  PrintDocument(document.dump(1, ' ', false, ServiceJson::error_handler_t::replace));
}

void TellAllWarnings(const std::vector<Submission>& submissions) {
  for (const Submission& one : submissions)
    TellWarnings(one.outcome, submissions.size() == 1 ? "" : TitleOf(one.study) + ": ");
}

}  // namespace

std::string TitleOf(const std::filesystem::path& study) {
  const std::string folder = std::filesystem::absolute(study).parent_path().filename().string();
  return study.filename() == "study.json" && !folder.empty() ? folder : study.filename().string();
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
