// kinevox submit: a study goes to the service, which builds its model.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/progress_bar.h"
#include "cli/service_client.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/study_file.h"
#include "storage/archive.h"

namespace kvx {
namespace {

struct SubmitArguments {
  std::filesystem::path study;
  std::string server = "http://127.0.0.1:8080", method;
  std::optional<int64_t> max_blocks;
  std::optional<double> max_seconds;
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

ServiceJson ModelRequest(const std::filesystem::path& study_file, const Study& study, const std::string& subject,
                         const std::string& bones, const ServiceJson& options) {
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

ServiceJson Send(const SubmitArguments& arguments, ServiceClient& client, ProgressBar& bar) {
  const Study study = ReadStudy(arguments.study);
  const TemporaryFolder scratch;
  const ServiceJson subject = client.Post("/v1/subjects", {{"name", study.name}, {"region", NameOf(study.region)}});
  const std::string base = "/v1/subjects/" + subject["id"].get<std::string>();
  const double parts = double(study.scans.size()) + 1;
  double part = 0;
  const auto upload = [&](const std::string& stage, const std::string& path, const std::filesystem::path& volume) {
    const Sendable file = MakeSendable(volume, scratch);
    const ServiceJson answer = client.Upload(path + "&filename=upload" + file.suffix, file.path, [&](double fraction) {
      bar.Show(stage, (part + fraction) / parts);
    });
    part += 1;
    return answer;
  };
  for (const StudyScan& scan : study.scans) {
    upload("upload " + scan.name, base + "/scans?name=" + UrlEncoded(scan.name), scan.volume);
  }
  const ServiceJson bones =
      upload("upload bones", base + "/bones?template=" + UrlEncoded(study.template_scan), study.bone_labels);
  return client.Post("/v1/models", ModelRequest(arguments.study, study, subject["id"], bones["id"], OptionsOf(arguments)));
}

ServiceJson WaitFor(const std::string& job, ServiceClient& client, ProgressBar& bar) {
  auto pause = std::chrono::milliseconds(200);
  while (true) {
    ServiceJson state = client.Get("/v1/jobs/" + job);
    const std::string name = state["state"];
    if (name != "queued" && name != "running") return state;
    bar.Show(name == "queued" ? "queued" : state["stage"].get<std::string>(), state["progress"].get<double>());
    if (InterruptRequested()) throw Cancelled();
    std::this_thread::sleep_for(pause);
    pause = std::min(pause * 2, std::chrono::milliseconds(2000));
  }
}

void RequireSucceeded(const ServiceJson& job) {
  if (job["state"] == "succeeded") return;
  if (job["state"] == "cancelled") throw Unavailable("the job was cancelled on the service");
  throw Unavailable("the build failed: " + job.value("/error/detail"_json_pointer, std::string("no reason was given")));
}

void Run(const SubmitArguments& arguments, const CommandContext& context) {
  CatchInterrupts();
  ServiceClient client(arguments.server);
  ProgressBar bar(context.quiet);
  ServiceJson outcome = Send(arguments, client, bar);
  if (arguments.wait) {
    const ServiceJson job = WaitFor(outcome["job"], client, bar);
    bar.Finish();
    RequireSucceeded(job);
    outcome["state"] = job["state"];
    outcome["result"] = job["result"];
  }
  bar.Finish();
  if (context.json) return PrintDocument(outcome.dump(1));
  std::printf("model %s\njob %s %s\n", outcome["id"].get_ref<const std::string&>().c_str(),
              outcome["job"].get_ref<const std::string&>().c_str(),
              outcome["state"].get_ref<const std::string&>().c_str());
}

}  // namespace

void AddSubmit(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("submit", "Send a study to the service and have its model built");
  auto arguments = std::make_shared<SubmitArguments>();
  command->add_option("study", arguments->study, "study.json")->required()->type_name("STUDY");
  command->add_option("--server", arguments->server, "Address of the service")->capture_default_str()->type_name("URL");
  command->add_option("--method", arguments->method, "adaptive (default: the service's); paper: as published in 2011")
      ->check(CLI::IsMember({"adaptive", "paper"}));
  command->add_option("--max-blocks", arguments->max_blocks, "Method paper: at most this many blocks per scan")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N");
  command->add_option("--max-seconds", arguments->max_seconds, "Method paper: at most this many seconds per scan")
      ->check(CLI::NonNegativeNumber)
      ->type_name("S");
  command->add_flag("--wait", arguments->wait, "Return when the model is built");
  command->add_flag("--quiet", context.quiet, "No progress on stderr");
  AddJson(*command, context);
  command->footer("Examples:\n  kinevox submit knee-a/study.json --server http://127.0.0.1:8080 --wait");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
