// kinevox fetch: one posed volume from the service.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/options/pose_options.h"
#include "cli/service/service_client.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/progress_bar.h"
#include "core/text/extension.h"
#include "core/text/parse_number.h"

namespace kvx {
namespace {

struct FetchArguments {
  std::string server, model;
  PoseOptions pose;
  int level = 0;
  bool label = false;
  std::string modality;
  std::filesystem::path out;
};

std::string FormatOf(const std::filesystem::path& out, bool label) {
  for (const char* format : {"nii.gz", "nii", "nrrd", "mha", "raw"}) {
    if (HasExtension(out, std::string(".") + format)) return format;
  }
  const std::string dicom = label ? ".dcm" : ".zip";
  if (HasExtension(out, dicom)) return "dicom";
  throw InputError("--out must end in .nii.gz, .nii, .nrrd, .mha, .raw or " + dicom +
                   " (DICOM): the extension chooses the format");
}

std::string PathOf(const FetchArguments& arguments) {
  std::string path = "/v1/models/" + UrlEncoded(arguments.model) +
                     "/volume?format=" + FormatOf(arguments.out, arguments.label) +
                     "&mode=" + arguments.pose.mode + "&level=" + std::to_string(arguments.level);
  if (arguments.label) path += "&label=true";
  if (!arguments.modality.empty()) path += "&modality=" + arguments.modality;
  if (!arguments.pose.scan.empty()) path += "&scan=" + UrlEncoded(arguments.pose.scan);
  for (const std::string& joint : arguments.pose.joints) {
    ParseJoint(joint);  // throws UsageError
    const size_t equals = joint.find('=');
    path += "&" + UrlEncoded(joint.substr(0, equals)) + "=" + UrlEncoded(joint.substr(equals + 1));
  }
  return path;
}

std::string PoseBody(const FetchArguments& arguments) {
  if (arguments.pose.pose_file.empty()) return "";
  return FromFile(arguments.pose.pose_file, [](const std::filesystem::path& named) {
    std::string body = ContentOf(named);
    if (body.empty()) throw InputError("the file is empty; a pose is a JSON object");
    return body;
  });
}

// Without the model nobody knows here which joint is beyond its limits; what is told is enough for a warning.
void WarnOf(const ToldOfPose& told) {
  if (ParseFinite(told.extrapolation).value_or(0) > 0)
    Warn("the pose is " + told.extrapolation +
         " example distances outside the scanned poses (0: inside); what is there is a guess");
  if (!told.scan_verdict.empty() && told.scan_verdict != "belongs")
    Warn("the scan may not belong to its study (" + told.scan_verdict +
         "); the model's document on the service says what to do");
}

ServiceJson NumbersIn(const std::string& header) {
  return ServiceJson::parse("[" + header + "]", nullptr, false);
}

// Raw voxels have no header of their own.
void AddGeometry(ServiceJson& document, const ToldOfPose& told) {
  if (told.size.empty()) return;
  document["size"] = NumbersIn(told.size);
  document["spacing"] = NumbersIn(told.spacing);
  document["origin"] = NumbersIn(told.origin);
  document["direction"] = NumbersIn(told.direction);
  document["type"] = told.type;
}

void TellGeometry(const ToldOfPose& told) {
  if (told.size.empty()) return;
  std::fprintf(stderr, "voxels %s of %s, spacing %s, origin %s, direction %s (LPS mm)\n", told.size.c_str(),
               told.type.c_str(), told.spacing.c_str(), told.origin.c_str(), told.direction.c_str());
}

std::string Document(const FetchArguments& arguments, const ToldOfPose& told) {
  ServiceJson document{{"model", arguments.model}, {"bytes", std::filesystem::file_size(arguments.out)}};
  if (const auto extrapolation = ParseFinite(told.extrapolation)) document["extrapolation"] = *extrapolation;
  if (!told.scan_verdict.empty()) document["scan_verdict"] = told.scan_verdict;
  AddGeometry(document, told);
  return document.dump();
}

void Run(const FetchArguments& arguments, const CommandContext& context) {
  CatchInterrupts();
  ServiceClient client(arguments.server);
  ProgressBar bar(context.quiet);
  double come = 0;
  client.OnWait([&](const std::string& reason) { bar.Show("waiting: " + reason, come); });
  const ToldOfPose told = client.Download(PathOf(arguments), PoseBody(arguments), arguments.out,
                                          [&](double fraction) { bar.Show("download", come = fraction); });
  bar.Show("downloaded", 1);
  bar.Finish();
  WarnOf(told);
  if (context.json) return PrintDocument(Document(arguments, told));
  TellGeometry(told);
}

}  // namespace

void AddFetch(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("fetch", "Fetch one posed volume from the service");
  auto arguments = std::make_shared<FetchArguments>();
  command->add_option("model", arguments->model, "ID of a model on the service")
      ->required()
      ->type_name("MODEL");
  AddServer(*command, arguments->server);
  AddPoseOptions(*command, arguments->pose);
  AddLevel(*command, arguments->level);
  command->add_flag("--label", arguments->label, "Posed bone labels instead of intensities");
  AddModality(*command, arguments->modality);
  AddOut(*command, arguments->out,
         "File to write (.nii.gz, .nii, .nrrd, .mha; .raw: voxels alone, whose geometry is told; .zip: a "
         "DICOM series; with --label .dcm: a DICOM segmentation of that series)");
  AddQuiet(*command, context);
  AddJson(*command, context);
  command->footer("Example:\n  kinevox fetch mdl_7k2... --joint tibia.flexion=35 --out bent.nii.gz");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
