// kinevox submit: studies go to the service, which builds their models.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/service_client.h"
#include "cli/study_lines.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/study_file.h"
#include "storage/archive.h"

namespace kvx {
namespace {

struct SubmitArguments {
  std::vector<std::filesystem::path> studies;
  std::string server = "http://127.0.0.1:8080", method;
  std::optional<int64_t> max_blocks;
  std::optional<double> max_seconds;
  int priority = 0;
  bool wait = false;
};

// Files that exist only for the upload.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "kinevox-submit-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw Unavailable("there is no room for temporary files");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct Sendable {
  std::filesystem::path path;
  std::string suffix;
};

// A folder is packed; a header with its data in another file becomes one file.
Sendable MakeSendable(const std::filesystem::path& volume, const TemporaryFolder& scratch) {
  if (std::filesystem::is_directory(volume)) {
    const std::filesystem::path packed = scratch.path() / "series.tar.gz";
    PackFolder(volume, packed);
    return {packed, ".tar.gz"};
  }
  const std::string name = volume.filename().string();
  for (const char* suffix : {".nii.gz", ".nii", ".nrrd", ".mha"}) {
    if (name.ends_with(suffix)) return {volume, suffix};
  }
  const Scan scan = ReadScan(volume);
  const std::filesystem::path single = scratch.path() / "volume.mha";
  WriteVolume(single, scan.volume, scan.stored_as);
  return {single, ".mha"};
}

ServiceJson OptionsOf(const SubmitArguments& arguments) {
  ServiceJson options = ServiceJson::object();
  if (!arguments.method.empty()) options["method"] = arguments.method;
  if (arguments.max_blocks) options["max_blocks"] = *arguments.max_blocks;
  if (arguments.max_seconds) options["max_seconds"] = *arguments.max_seconds;
  return options;
}

ServiceJson ModelRequest(const std::filesystem::path& study_file, const Study& study,
                         const std::string& subject, const std::string& bones, const ServiceJson& options) {
  std::ifstream in(study_file);
  const ServiceJson file = ServiceJson::parse(in);  // ReadStudy has checked it
  ServiceJson request{{"subject", subject}, {"template", study.template_scan}};
  request["bones"]["id"] = bones;
  if (file["bones"].contains("list")) request["bones"]["list"] = file["bones"]["list"];
  for (const char* field : {"joints", "initial_poses"}) {
    if (file.contains(field)) request[field] = file[field];
  }
  if (!options.empty()) request["options"] = options;
  return request;
}

// How one study fares; a study that fails does not stop the others.
struct Submission {
  std::filesystem::path study;
  ServiceJson request, outcome;  // outcome: {"study", "id", "job", "state", "result" or "error"}
};

bool Ended(const ServiceJson& state) { return state != "queued" && state != "running"; }

std::string Reason(const ServiceJson& outcome) {
  if (outcome["state"] == "cancelled") return "cancelled on the service";
  return outcome.value("/error/detail"_json_pointer, std::string("no reason was given"));
}

std::string TitleOf(const std::filesystem::path& study) {
  const std::string folder = std::filesystem::absolute(study).parent_path().filename().string();
  return study.filename() == "study.json" && !folder.empty() ? folder : study.filename().string();
}

std::string ThresholdPath(const std::string& subject, const Study& study) {
  const std::string level = study.bone_level_hu ? ServiceJson(*study.bone_level_hu).dump() : "auto";
  return "/v1/subjects/" + subject + "/bones?kind=threshold&template=" + UrlEncoded(study.template_scan) +
         "&threshold=" + UrlEncoded(level);
}

// The model can be asked for only when the template's bones are there. Returns the label map's id.
std::string SegmentedBy(const std::string& job_id, ServiceClient& client,
                        const std::function<void(const std::string&, double)>& show) {
  auto pause = std::chrono::milliseconds(100);
  while (true) {
    const ServiceJson job = client.GetPatiently("/v1/jobs/" + job_id);
    if (job["state"] == "succeeded") {
      for (const ServiceJson& warning : job["result"]["warnings"]) Warn(warning.get<std::string>());
      return job["result"]["bones"];
    }
    if (Ended(job["state"])) throw InputError("the bones could not be segmented: " + Reason(job));
    show("segmenting the bones", job["progress"]);
    if (InterruptRequested()) throw Cancelled();
    std::this_thread::sleep_for(pause);
    pause = std::min(pause * 2, std::chrono::milliseconds(2000));
  }
}

// Uploads what the service does not have, and returns what to ask it for.
ServiceJson Send(const std::filesystem::path& study_file, const SubmitArguments& arguments,
                 ServiceClient& client, const std::function<void(const std::string&, double)>& show) {
  const Study study = ReadStudy(study_file);
  const TemporaryFolder scratch;
  const ServiceJson subject =
      client.Post("/v1/subjects", {{"name", study.name}, {"region", NameOf(study.region)}});
  const double parts = double(study.scans.size()) + 1;
  double part = 0;
  const auto upload = [&](const std::string& what, FileToSend file, const std::filesystem::path& volume) {
    const Sendable sendable = MakeSendable(volume, scratch);
    file.subject = subject["id"], file.suffix = sendable.suffix, file.file = sendable.path;
    show("uploading " + what, part / parts);
    const ServiceJson answer =
        client.Upload(file, [&](double fraction) { show("uploading " + what, (part + fraction) / parts); });
    part += 1;
    return answer;
  };
  for (const StudyScan& scan : study.scans) upload(scan.name, {.name = scan.name}, scan.volume);
  std::string bones;
  if (!study.bone_labels.empty()) {
    bones = upload("bones", {.bones = true, .name = study.template_scan}, study.bone_labels)["id"];
  } else if (!study.bone_seeds.empty()) {
    const ServiceJson job =
        upload("strokes", {.bones = true, .strokes = true, .name = study.template_scan}, study.bone_seeds);
    bones = SegmentedBy(job["id"], client, show);
  } else {
    bones = SegmentedBy(client.Post(ThresholdPath(subject["id"], study), {})["job"], client, show);
  }
  ServiceJson request = ModelRequest(study_file, study, subject["id"], bones, OptionsOf(arguments));
  if (arguments.priority != 0) request["priority"] = arguments.priority;
  return request;
}

ServiceJson ErrorOf(const std::exception& error) {
  return {{"type", "urn:kinevox:problem:not-submitted"}, {"detail", error.what()}};
}

void SendAll(std::vector<Submission>& submissions, const SubmitArguments& arguments, ServiceClient& client,
             StudyLines& lines) {
  for (size_t i = 0; i < submissions.size(); ++i) {
    Submission& one = submissions[i];
    one.outcome["study"] = one.study.string();
    try {
      one.request = Send(one.study, arguments, client,
                         [&](const std::string& what, double f) { lines.Show(i, what, f); });
    } catch (const InputError& error) {
      if (submissions.size() == 1) throw;
      one.outcome["state"] = "failed";
      one.outcome["error"] = ErrorOf(error);
      lines.Show(i, std::string("not submitted: ") + error.what(), 0);
    }
  }
}

// One request for all: a single model by itself, more as a batch. Returns the batch's id, or nothing.
std::string Ask(std::vector<Submission>& submissions, ServiceClient& client) {
  std::vector<Submission*> asked;
  for (Submission& one : submissions) {
    if (!one.request.is_null()) asked.push_back(&one);
  }
  if (asked.empty()) return "";
  if (submissions.size() == 1) {
    asked[0]->outcome.update(client.Post("/v1/models", asked[0]->request));
    return "";
  }
  ServiceJson body{{"models", ServiceJson::array()}};
  for (const Submission* one : asked) body["models"].push_back(one->request);
  const ServiceJson batch = client.Post("/v1/batches", body);
  for (size_t i = 0; i < asked.size(); ++i) {
    const ServiceJson& model = batch["models"].at(i);
    for (const char* field : {"id", "job", "state"}) asked[i]->outcome[field] = model[field];
  }
  return batch["id"];
}

// False once all have ended.
bool Look(std::vector<Submission>& submissions, ServiceClient& client, StudyLines& lines) {
  bool going_on = false;
  for (size_t i = 0; i < submissions.size(); ++i) {
    ServiceJson& outcome = submissions[i].outcome;
    if (Ended(outcome["state"])) continue;
    const ServiceJson job = client.GetPatiently("/v1/jobs/" + outcome["job"].get<std::string>());
    outcome["state"] = job["state"];
    for (const char* field : {"result", "error"}) {
      if (job.contains(field)) outcome[field] = job[field];
    }
    std::string what = job["state"];
    if (what == "running") what = job["stage"];
    if (what == "queued" && job["queue_position"].is_number())
      what += ", number " + job["queue_position"].dump() + " in line";
    if (job["seconds_left"].is_number())
      what += ", about " + std::to_string(int(job["seconds_left"].get<double>() + 1)) + " s left";
    lines.Show(i, what, Ended(job["state"]) ? 1.0 : job["progress"].get<double>());
    going_on |= !Ended(job["state"]);
  }
  return going_on;
}

void Wait(std::vector<Submission>& submissions, ServiceClient& client, StudyLines& lines) {
  auto pause = std::chrono::milliseconds(200);
  while (Look(submissions, client, lines)) {
    if (InterruptRequested()) throw Cancelled();
    std::this_thread::sleep_for(pause);
    pause = std::min(pause * 2, std::chrono::milliseconds(2000));
  }
}

void PrintTable(const std::vector<Submission>& submissions, const std::string& batch) {
  if (!batch.empty()) std::printf("batch %s\n", batch.c_str());
  for (const Submission& one : submissions) {
    const ServiceJson& o = one.outcome;
    const std::string state = o["state"];
    if (submissions.size() == 1) {
      std::printf("model %s\njob %s %s\n", o["id"].get_ref<const std::string&>().c_str(),
                  o["job"].get_ref<const std::string&>().c_str(), state.c_str());
      continue;
    }
    std::printf("%-28s %-9s %s %s\n", TitleOf(one.study).c_str(), state.c_str(),
                o.value("id", std::string("-")).c_str(),
                state == "failed" || state == "cancelled" ? Reason(o).c_str() : "");
  }
}

void Print(const std::vector<Submission>& submissions, const std::string& batch,
           const CommandContext& context) {
  if (!context.json) return PrintTable(submissions, batch);
  if (submissions.size() == 1) return PrintDocument(submissions[0].outcome.dump(1));
  ServiceJson all{{"batch", batch.empty() ? ServiceJson() : ServiceJson(batch)},
                  {"studies", ServiceJson::array()}};
  for (const Submission& one : submissions) all["studies"].push_back(one.outcome);
  PrintDocument(all.dump(1));
}

void RequireAllWell(const std::vector<Submission>& submissions) {
  size_t failed = 0;
  for (const Submission& one : submissions) {
    const ServiceJson& state = one.outcome["state"];
    if (state != "failed" && state != "cancelled") continue;
    ++failed;
    if (submissions.size() == 1) throw Unavailable("the build failed: " + Reason(one.outcome));
  }
  if (failed > 0) {
    throw Unavailable(std::to_string(failed) + " of " + std::to_string(submissions.size()) +
                      " studies have no model");
  }
}

void Run(const SubmitArguments& arguments, const CommandContext& context) {
  CatchInterrupts();
  ServiceClient client(arguments.server);
  StudyLines lines(context.quiet);
  std::vector<Submission> submissions;
  for (const std::filesystem::path& study : arguments.studies) {
    submissions.push_back({study, {}, {}});
    lines.Add(TitleOf(study));
  }
  SendAll(submissions, arguments, client, lines);
  const std::string batch = Ask(submissions, client);
  if (arguments.wait) Wait(submissions, client, lines);
  Print(submissions, batch, context);
  RequireAllWell(submissions);
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
  command
      ->add_option("--method", arguments->method,
                   "adaptive (default: the service's); paper: as published in 2011")
      ->check(CLI::IsMember({"adaptive", "paper"}));
  command
      ->add_option("--max-blocks", arguments->max_blocks, "Method paper: at most this many blocks per scan")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command
      ->add_option("--max-seconds", arguments->max_seconds,
                   "Method paper: at most this many seconds per scan")
      ->check(CLI::NonNegativeNumber)
      ->type_name("S");
  command->add_option("--priority", arguments->priority, "-100 to 100; higher ones first")
      ->check(CLI::Range(-100, 100));
  command->add_flag("--wait", arguments->wait, "Return when the models are built");
  command->add_flag("--quiet", context.quiet, "No progress on stderr");
  AddJson(*command, context);
  command->footer(
      "Bytes that the service has are not sent again, and a lost connection is taken up where it broke: "
      "after an interruption\n"
      "the same command goes on. Several studies become one batch; one that cannot be read does not stop the "
      "others, and the\n"
      "exit code is 4 when any has no model.\n\n"
      "Examples:\n  kinevox submit knee-a/study.json --server http://127.0.0.1:8080 --wait\n"
      "  kinevox submit */study.json --wait --json > results.json");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
