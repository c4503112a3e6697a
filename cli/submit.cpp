// kinevox submit: studies go to the service, which builds their models.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/asked_jobs.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/named_files.h"
#include "cli/patience.h"
#include "cli/service_client.h"
#include "cli/study_lines.h"
#include "cli/study_upload.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr size_t kMostStudies = 500;  // of one batch (docs/api.md)

struct SubmitArguments {
  std::vector<std::filesystem::path> studies;
  std::string server, method;
  std::optional<int64_t> max_blocks;
  std::optional<double> max_seconds;
  int priority = 0;
  bool wait = false, again = false;
};

ServiceJson OptionsOf(const SubmitArguments& arguments) {
  ServiceJson options = ServiceJson::object();
  if (!arguments.method.empty()) options["method"] = arguments.method;
  if (arguments.max_blocks) options["max_blocks"] = *arguments.max_blocks;
  if (arguments.max_seconds) options["max_seconds"] = *arguments.max_seconds;
  return options;
}

// How one study fares; a study that fails does not stop the others.
struct Submission {
  std::filesystem::path study;
  ServiceJson request, outcome;  // outcome: {"study", "id", "job", "state", "batch"?, "result" or "error"}
};

std::string TitleOf(const std::filesystem::path& study) {
  const std::string folder = std::filesystem::absolute(study).parent_path().filename().string();
  return study.filename() == "study.json" && !folder.empty() ? folder : study.filename().string();
}

// `seen` counts studies of this command that are alike: each has a subject of its own.
ServiceJson RequestOf(const Submission& one, const SubmitArguments& arguments,
                      std::map<std::string, int>& seen, ServiceClient& client, const UploadProgress& show) {
  return FromFile(one.study, [&](const std::filesystem::path& study) {
    std::string key = arguments.again ? NewId("key") : KeyOfStudy(study);
    key += "-" + std::to_string(++seen[key]);
    ServiceJson request = SendStudy(study, key, client, show);
    const ServiceJson options = OptionsOf(arguments);
    if (!options.empty()) request["options"] = options;
    if (arguments.priority != 0) request["priority"] = arguments.priority;
    return request;
  });
}

void Refuse(Submission& one, const Error& error) {
  one.outcome["state"] = "failed";
  one.outcome["error"] = ProblemOf(error.what());
}

// Sends one; a study that is at fault is refused.
template <class Request>
void SendOne(Submission& one, const Request& request) {
  try {
    one.request = request();
  } catch (const Error& error) {
    if (!IsOneOf<InputError, NotFound, TooLarge>(error)) throw;
    Refuse(one, error);
  }
}

// What ended the sending before its end, a quota or a full disk: the others are refused with it. Null:
// nothing.
std::exception_ptr SendAll(std::vector<Submission>& submissions, const SubmitArguments& arguments,
                           ServiceClient& client, StudyLines& lines) {
  std::map<std::string, int> seen;
  std::exception_ptr broke;
  for (Submission& one : submissions) one.outcome["study"] = one.study.string();
  for (size_t i = 0; i < submissions.size(); ++i) {
    Submission& one = submissions[i];
    const auto request = [&] {
      if (broke) std::rethrow_exception(broke);
      return RequestOf(one, arguments, seen, client,
                       [&](const std::string& what, double f) { lines.Show(i, what, f); });
    };
    client.OnWait([&lines, i](const std::string& reason) { lines.Show(i, "waiting: " + reason); });
    if (submissions.size() == 1) return one.request = request(), nullptr;
    try {
      SendOne(one, request);
    } catch (const NoAnswer&) {
      throw;  // nobody can be asked for what has arrived
    } catch (const Error& error) {
      if (!IsOneOf<Unavailable, Refused>(error)) throw;
      broke = std::current_exception();
      Refuse(one, error);
    }
    if (one.request.is_null()) lines.Show(i, "not submitted: " + ReasonOf(one.outcome), 0);
  }
  return broke;
}

// Once the studies are there, a wait is told on the first line of those that have not ended.
void TellWaits(const std::vector<Submission>& submissions, ServiceClient& client, StudyLines& lines) {
  client.OnWait([&](const std::string& reason) {
    const auto goes_on = [](const Submission& one) {
      return !one.outcome.contains("state") || !Ended(one.outcome["state"]);
    };
    const auto first = std::ranges::find_if(submissions, goes_on);
    if (first != submissions.end()) lines.Show(size_t(first - submissions.begin()), "waiting: " + reason);
  });
}

// A single model by itself, more as a batch. Returns the newest batch's id, or nothing.
std::string Ask(std::vector<Submission>& submissions, const SubmitArguments& arguments,
                ServiceClient& client) {
  std::vector<Submission*> asked;
  std::vector<ServiceJson> requests;
  for (Submission& one : submissions) {
    if (one.request.is_null()) continue;
    asked.push_back(&one);
    requests.push_back(one.request);
  }
  if (asked.empty()) return "";
  std::string batch;
  bool earlier = false;
  const std::string again = arguments.again ? NewId("key") : "";
  if (submissions.size() == 1) {
    const AskedJob model = AskForJob(client, "/v1/models", requests[0], KeyOfModel(again, requests[0]));
    asked[0]->outcome.update(model.answer);
    earlier = model.earlier;
  } else {
    const AskedModels models = AskForModels(client, requests, again);
    for (size_t i = 0; i < asked.size(); ++i) asked[i]->outcome.update(models.models[i]);
    batch = models.batch;
    earlier = models.earlier;
  }
  if (earlier) std::fprintf(stderr, "submitted before: this is what came of it; --again has it built anew\n");
  return batch;
}

std::set<std::string> BatchesOf(const std::vector<Submission>& submissions) {
  std::set<std::string> batches;
  for (const Submission& one : submissions)
    if (one.outcome.contains("batch")) batches.insert(one.outcome["batch"].get<std::string>());
  return batches;
}

// One request for each batch that goes on; its jobs by their ids.
std::map<std::string, ServiceJson> LookAtBatches(const std::vector<Submission>& submissions,
                                                 ServiceClient& client) {
  std::set<std::string> going_on;
  for (const Submission& one : submissions)
    if (one.outcome.contains("batch") && !Ended(one.outcome["state"]))
      going_on.insert(one.outcome["batch"].get<std::string>());
  std::map<std::string, ServiceJson> jobs;
  for (const std::string& batch : going_on) {
    const ServiceJson now = client.GetPatiently("/v1/batches/" + batch);
    for (const ServiceJson& model : now["models"]) jobs[model["job"]] = model;
  }
  return jobs;
}

std::string TaleOf(const ServiceJson& job) {
  std::string what = job["state"];
  if (what == "running") what = job["stage"];
  if (what == "queued" && job.contains("queue_position") && job["queue_position"].is_number())
    what += ", number " + job["queue_position"].dump() + " in line";
  if (job.contains("seconds_left") && job["seconds_left"].is_number())
    what += ", about " + std::to_string(int(job["seconds_left"].get<double>() + 1)) + " s left";
  return what;
}

// False once all have ended. Of a batch only what runs is asked for by itself: the others have nothing to
// add.
bool Look(std::vector<Submission>& submissions, ServiceClient& client, StudyLines& lines) {
  bool going_on = false;
  const std::map<std::string, ServiceJson> in_batches = LookAtBatches(submissions, client);
  for (size_t i = 0; i < submissions.size(); ++i) {
    ServiceJson& outcome = submissions[i].outcome;
    if (Ended(outcome["state"])) continue;
    const std::string id = outcome["job"];
    const auto known = in_batches.find(id);
    const ServiceJson job = known != in_batches.end() && known->second["state"] != "running"
                                ? known->second
                                : client.GetPatiently("/v1/jobs/" + id);
    outcome["state"] = job["state"];
    for (const char* field : {"result", "error"}) {
      if (job.contains(field)) outcome[field] = job[field];
    }
    lines.Show(i, TaleOf(job), Ended(job["state"]) ? 1.0 : job["progress"].get<double>());
    going_on |= !Ended(job["state"]);
  }
  return going_on;
}

void Wait(std::vector<Submission>& submissions, ServiceClient& client, StudyLines& lines) {
  GrowingPause pause;
  while (Look(submissions, client, lines)) pause.Wait();
}

// What the service goes on with, and how to have a hand in it.
[[noreturn]] void ThrowGoesOn(const std::vector<Submission>& submissions, const std::string& server) {
  const std::string at = " --server " + server;
  std::string shown, cancelled;
  for (const std::string& batch : BatchesOf(submissions)) cancelled += " " + batch;
  if (submissions.size() == 1) shown = cancelled = " " + submissions[0].outcome["job"].get<std::string>();
  throw Interrupted("interrupted; the service goes on: 'kinevox jobs" + shown + at +
                    "' shows it, 'kinevox cancel" + cancelled + at +
                    "' ends it, and the same command waits for it again");
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
    std::printf("%-28s %-9s %s %s\n", TitleOf(one.study).c_str(), state.c_str(),
                o.value("id", std::string("-")).c_str(), EndedBadly(o["state"]) ? ReasonOf(o).c_str() : "");
  }
}

// The paths of studies need not be UTF-8.
void PrintJson(const ServiceJson& document) {
  PrintDocument(document.dump(1, ' ', false, ServiceJson::error_handler_t::replace));
}

void Print(const std::vector<Submission>& submissions, const std::string& batch,
           const CommandContext& context) {
  if (!context.json) return PrintTable(submissions);
  if (submissions.size() == 1) return PrintJson(submissions[0].outcome);
  ServiceJson all{{"batch", batch.empty() ? ServiceJson() : ServiceJson(batch)},
                  {"studies", ServiceJson::array()}};
  for (const Submission& one : submissions) all["studies"].push_back(one.outcome);
  PrintJson(all);
}

void TellAllWarnings(const std::vector<Submission>& submissions) {
  for (const Submission& one : submissions)
    TellWarnings(one.outcome, submissions.size() == 1 ? "" : TitleOf(one.study) + ": ");
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

void Run(const SubmitArguments& arguments, const CommandContext& context) {
  if (arguments.studies.size() > kMostStudies)
    throw UsageError("at most " + std::to_string(kMostStudies) + " studies at once; submit them in parts");
  CatchInterrupts();
  ServiceClient client(arguments.server);
  StudyLines lines(context.quiet);
  std::vector<Submission> submissions;
  for (const std::filesystem::path& study : arguments.studies) {
    submissions.push_back({study, {}, {}});
    lines.Add(TitleOf(study));
  }
  std::exception_ptr broke = SendAll(submissions, arguments, client, lines);
  TellWaits(submissions, client, lines);
  const std::string batch = Ask(submissions, arguments, client);
  try {
    if (arguments.wait)
      Wait(submissions, client, lines);
    else
      Look(submissions, client, lines);  // what was submitted before has gone on since
  } catch (const Cancelled&) {
    ThrowGoesOn(submissions, arguments.server);
  } catch (const Error& error) {
    if (!IsOneOf<Unavailable, Refused>(error)) throw;
    broke = std::current_exception();
  }
  TellAllWarnings(submissions);
  Print(submissions, batch, context);
  if (broke) std::rethrow_exception(broke);
  RequireAllWell(submissions);
}

void AddMethod(CLI::App& command, SubmitArguments& arguments) {
  command
      .add_option("--method", arguments.method,
                  "adaptive (default: the service's); paper: as published in 2011")
      ->check(CLI::IsMember({"adaptive", "paper"}));
  command
      .add_option("--max-blocks", arguments.max_blocks,
                  "Method paper: register at most this many blocks per scan, worst first (0: all)")
      ->check(ZeroOrAbove())
      ->type_name("N");
  command
      .add_option("--max-seconds", arguments.max_seconds,
                  "Method paper: stop after this many seconds per scan (0: never)")
      ->check(ZeroOrAbove())
      ->type_name("S");
}

}  // namespace

void AddSubmit(CLI::App& program, CommandContext& context) {
  CLI::App* command =
      program.add_subcommand("submit", "Send studies to the service and have their models built");
  auto arguments = std::make_shared<SubmitArguments>();
  command->add_option("studies", arguments->studies, "study.json, one or more")
      ->required()
      ->type_name("STUDY");
  AddServer(*command, arguments->server);
  AddMethod(*command, *arguments);
  command->add_option("--priority", arguments->priority, "-100 to 100; higher ones first")
      ->check(CLI::Range(-100, 100))
      ->type_name("N");
  command->add_flag("--wait", arguments->wait, "Return when the models are built");
  command->add_flag("--again", arguments->again,
                    "Send and build anew what was submitted before; without it the same studies and options "
                    "get the models of then");
  AddQuiet(*command, context);
  AddJson(*command, context);
  command->footer(
      "Bytes that the service has are not sent again, and a lost connection is taken up where it broke: "
      "after an interruption the same command goes on, and waits for the job that it started. So does a "
      "repetition within a week, of each study by itself, unless its job has failed or was cancelled. "
      "Several studies become one batch; one that cannot be read or that the service refuses does not stop "
      "the others, and the exit code is 4 when any has no model. A quota that is used up ends the sending: "
      "the models of what has arrived are asked for, and the exit code is 6.\n\n"
      "Examples:\n  kinevox submit knee-a/study.json --server http://127.0.0.1:8080 --wait\n"
      "  kinevox submit */study.json --wait --json > results.json");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
