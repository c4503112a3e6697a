// kinevox submit: studies go to the service, which builds their models.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "cli/options/named_files.h"
#include "cli/options/paper_options.h"
#include "cli/service/asked_jobs.h"
#include "cli/service/patience.h"
#include "cli/service/study_lines.h"
#include "cli/service/study_upload.h"
#include "cli/service/submission.h"
#include "cli/terminal/interrupt.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr size_t kMostStudies = 500;  // of one batch (docs/api.md)

struct SubmitArguments {
  std::vector<std::filesystem::path> studies;
  std::string server, method;
  PaperOptions paper;
  ServiceJson options = ServiceJson::object();  // of the build, those that are given
  int priority = 0;
  bool wait = false, again = false;
};

ServiceJson OptionsOf(const CLI::App& command, const SubmitArguments& arguments) {
  ServiceJson options = ServiceJson::object();
  if (!arguments.method.empty()) options["method"] = arguments.method;
  if (command.count("--max-blocks") > 0) options["max_blocks"] = arguments.paper.max_blocks;
  if (command.count("--max-seconds") > 0) options["max_seconds"] = arguments.paper.max_seconds;
  if (command.count("--seed") > 0) options["seed"] = arguments.paper.seed;
  return options;
}

using Titles = std::vector<std::string>;

// `seen`: by their key, the studies of this command that are alike. Each has a subject of its own.
ServiceJson RequestOf(const Submission& one, const SubmitArguments& arguments,
                      std::map<std::string, Titles>& seen, ServiceClient& client, const UploadProgress& show,
                      const UploadWarning& warn) {
  return FromFile(one.study, [&](const std::filesystem::path& study) {
    std::string key = arguments.again ? NewId("key") : KeyOfStudy(study, show);
    Titles& alike = seen[key];
    if (!alike.empty())
      warn("has the same scans and bones as " + alike[0] + "; each gets a model of its own");
    alike.push_back(one.title);
    key += "-" + std::to_string(alike.size());
    ServiceJson request = SendStudy(study, key, client, show, warn);
    if (!arguments.options.empty()) request["options"] = arguments.options;
    if (arguments.priority != 0) request["priority"] = arguments.priority;
    return request;
  });
}

// Sends one; a study that is at fault, or whose files are, is refused.
template <class Request>
void SendOne(Submission& one, const Request& request) try {
  one.request = request();
} catch (const std::filesystem::filesystem_error& error) {
  Refuse(one, SentenceOf(error));
} catch (const Error& error) {
  if (!IsOneOf<InputError, NotFound, Conflict, TooLarge, Denied, NotPacked>(error)) throw;
  Refuse(one, error.what());
}

// What ended the sending before its end, a quota or a full disk: the others are refused with it. Null:
// nothing.
std::exception_ptr SendAll(std::vector<Submission>& submissions, const SubmitArguments& arguments,
                           ServiceClient& client, StudyLines& lines) {
  std::map<std::string, Titles> seen;
  std::exception_ptr broke;
  for (size_t i = 0; i < submissions.size(); ++i) {
    Submission& one = submissions[i];
    const auto show = [&lines, i](const std::string& what, double f) { lines.Show(i, what, f); };
    const auto warn = [&](const std::string& sentence) {
      lines.Above([&] { Warn((submissions.size() == 1 ? "" : one.title + ": ") + sentence); });
    };
    const auto request = [&] {
      if (broke) std::rethrow_exception(broke);
      return RequestOf(one, arguments, seen, client, show, warn);
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
      Refuse(one, error.what());
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

struct Asked {
  std::string batch;         // the newest, or empty
  std::exception_ptr broke;  // what ended the asking before its end; those left are refused with it
  bool earlier = false;
};

Asked AskForOne(Submission& one, const std::string& again, ServiceClient& client) {
  const AskedJob model = AskForJob(client, "/v1/models", one.request, KeyOfModel(again, one.request));
  one.outcome.update(model.answer);
  return {.batch = "", .broke = nullptr, .earlier = model.earlier};
}

// A single model by itself, more as a batch.
Asked Ask(std::vector<Submission>& submissions, const SubmitArguments& arguments, ServiceClient& client) {
  const std::string again = arguments.again ? NewId("key") : "";
  if (submissions.size() == 1) return AskForOne(submissions[0], again, client);
  std::vector<Submission*> asked;
  std::vector<ServiceJson> requests;
  for (Submission& one : submissions) {
    if (one.request.is_null()) continue;
    asked.push_back(&one);
    requests.push_back(one.request);
  }
  if (asked.empty()) return {};
  const AskedModels models = AskForModels(client, requests, again);
  for (size_t i = 0; i < asked.size(); ++i) asked[i]->outcome.update(models.models[i]);
  return {models.batch, models.broke, models.earlier};
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
    try {
      const ServiceJson now = client.GetPatiently(AddressOf(batch));
      for (const ServiceJson& model : now["models"]) jobs[model["job"]] = model;
    } catch (const NotFound&) {  // its jobs are asked for one by one, those that are left
    }
  }
  return jobs;
}

// Of a batch only what runs is asked for by itself: the others have nothing to add. Null: it is gone.
ServiceJson LookAtJob(const std::string& id, const std::map<std::string, ServiceJson>& in_batches,
                      ServiceClient& client) try {
  const auto known = in_batches.find(id);
  const bool all_is_told = known != in_batches.end() && known->second["state"] != "running";
  return all_is_told ? known->second : client.GetPatiently(AddressOf(id));
} catch (const NotFound&) {
  return {};
}

std::string TaleOf(const ServiceJson& job) {
  std::string what = job["state"];
  if (what == "running") what = job["stage"];
  if (what == "queued" && job.contains("queue_position") && job["queue_position"].is_number())
    what += ", number " + job["queue_position"].dump() + " in line";
  return what;
}

std::string LeftOf(const ServiceJson& job) {
  if (!job.contains("seconds_left") || !job["seconds_left"].is_number()) return "";
  return ", about " + std::to_string(int(job["seconds_left"].get<double>() + 1)) + " s left";
}

void Tell(Submission& one, const ServiceJson& job) {
  if (job.is_null()) return Refuse(one, "its job is gone from the service; somebody has removed its subject");
  one.outcome["state"] = job["state"];
  for (const char* field : {"result", "error"}) {
    if (job.contains(field)) one.outcome[field] = job[field];
  }
}

struct GoingOn {
  bool any = false, running = false;
};

// `held`: why jobs are not begun; told of the first in line.
GoingOn Look(std::vector<Submission>& submissions, ServiceClient& client, StudyLines& lines,
             std::string held = "") {
  GoingOn going_on;
  const std::map<std::string, ServiceJson> in_batches = LookAtBatches(submissions, client);
  for (size_t i = 0; i < submissions.size(); ++i) {
    const ServiceJson& outcome = submissions[i].outcome;
    if (Ended(outcome["state"])) continue;
    const ServiceJson job = LookAtJob(outcome["job"], in_batches, client);
    Tell(submissions[i], job);
    const bool ended = Ended(outcome["state"]), in_line = outcome["state"] == "queued";
    const std::string why = in_line && !held.empty() ? ": " + std::exchange(held, "") : "";
    if (job.is_null())
      lines.Show(i, "gone", 1.0);
    else
      lines.Show(i, TaleOf(job) + why, ended ? 1.0 : job["progress"].get<double>(), LeftOf(job));
    going_on.any |= !ended;
    going_on.running |= !ended && !in_line;
  }
  return going_on;
}

// While no job runs: why none is begun. Asked for every ten seconds.
class Reason {
 public:
  std::string For(const GoingOn& now, ServiceClient& client) {
    if (now.running || !now.any) return "";
    const auto time = std::chrono::steady_clock::now();
    if (time < next_) return told_;
    next_ = time + std::chrono::seconds(10);
    return told_ = client.WhyNotReady();
  }

 private:
  std::chrono::steady_clock::time_point next_;
  std::string told_;
};

void Wait(std::vector<Submission>& submissions, ServiceClient& client, StudyLines& lines) {
  GrowingPause pause;
  Reason reason;
  for (GoingOn now = Look(submissions, client, lines); now.any;) {
    pause.Wait();
    now = Look(submissions, client, lines, reason.For(now, client));
  }
}

// What the service goes on with, and how to have a hand in it.
[[noreturn]] void ThrowGoesOn(const std::vector<Submission>& submissions, const SubmitArguments& arguments) {
  const std::string at = " --server " + arguments.server;
  std::string ids;
  for (const std::string& batch : BatchesOf(submissions)) ids += " " + batch;
  if (submissions.size() == 1) ids = " " + submissions[0].outcome["job"].get<std::string>();
  std::string shown = "'kinevox jobs" + ids + at + "' shows it";
  if (BatchesOf(submissions).size() > 1) shown = "'kinevox jobs ID" + at + "' shows one of" + ids;
  throw Interrupted("interrupted; the service goes on: " + shown + ", 'kinevox cancel" + ids + at +
                    "' ends it" +
                    (arguments.again ? "; the same command would have all of it built once more"
                                     : ", and the same command waits for it again"));
}

// The service may have taken what was asked for though its answer was not waited for.
Asked AskOrTell(std::vector<Submission>& submissions, const SubmitArguments& arguments,
                ServiceClient& client) try {
  return Ask(submissions, arguments, client);
} catch (const Cancelled&) {
  throw Interrupted("interrupted while models were asked for: 'kinevox jobs --server " + arguments.server +
                    "' shows whether the service builds them" +
                    (arguments.again ? "; the same command would have all of it built once more"
                                     : ", and the same command goes on with them"));
}

void Run(const SubmitArguments& arguments, const CommandContext& context) {
  if (arguments.studies.size() > kMostStudies)
    throw UsageError("at most " + std::to_string(kMostStudies) + " studies at once; submit them in parts");
  CatchInterrupts();
  ServiceClient client(arguments.server);
  StudyLines lines(context.quiet);
  std::vector<Submission> submissions = SubmissionsOf(arguments.studies);
  for (const Submission& one : submissions) lines.Add(one.title);
  std::exception_ptr broke = SendAll(submissions, arguments, client, lines);
  TellWaits(submissions, client, lines);
  const Asked asked = AskOrTell(submissions, arguments, client);
  if (asked.earlier)
    std::fprintf(stderr, "submitted before: this is what came of it; --again has it built anew\n");
  if (!broke) broke = asked.broke;
  try {
    if (arguments.wait)
      Wait(submissions, client, lines);
    else
      Look(submissions, client, lines);  // what was submitted before has gone on since
  } catch (const Cancelled&) {
    ThrowGoesOn(submissions, arguments);
  } catch (const Error& error) {
    if (!IsOneOf<Unavailable, Refused>(error)) throw;
    if (!broke) broke = std::current_exception();
  }
  Print(submissions, asked.batch, context);
  if (broke) std::rethrow_exception(broke);
  RequireAllWell(submissions);
}

void AddMethod(CLI::App& command, SubmitArguments& arguments) {
  command
      .add_option("--method", arguments.method,
                  "adaptive (default: the service's); paper: as published in 2011")
      ->check(CLI::IsMember({"adaptive", "paper"}));
  AddPaperOptions(command, arguments.paper);
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
      "the models of what has arrived are asked for, and the exit code is 6. So does a full disk of the "
      "service, which takes no model then: the table says what has arrived, and the exit code is 4.\n\n"
      "Examples:\n  kinevox submit knee-a/study.json --server http://127.0.0.1:8080 --wait\n"
      "  kinevox submit */study.json --wait --json > results.json");
  command->callback([arguments, command, &context] {
    RequirePaperMethod(*command, arguments->method);
    arguments->options = OptionsOf(*command, *arguments);
    Run(*arguments, context);
  });
}

}  // namespace kvx
