// Every POST carries a key made of the study, so that a command that was cut off goes on where it was.
#include "cli/service/study_upload.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "api/request.h"
#include "api/upload_format.h"
#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/service/asked_jobs.h"
#include "cli/service/patience.h"
#include "cli/terminal/interrupt.h"
#include "core/digest.h"
#include "core/region_presets.h"
#include "pipeline/io/dicom/pack_series.h"
#include "pipeline/io/mask_folder.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/files/study_file.h"
#include "pipeline/model/warnings/study_warnings.h"
#include "pipeline/scans/load_scan.h"

namespace kvx {
namespace {

// Its place is the user's choice.
std::string PlaceOfTemporaryFiles() {
  std::error_code error;
  const std::string place = std::filesystem::temp_directory_path(error).string();
  return error ? "the folder that the variable TMPDIR names" : place;
}

// Of what is written for the upload alone: other studies need none of it.
template <class Make>
auto Packed(const Make& make) {
  try {
    return make();
  } catch (const Denied&) {
    throw;
  } catch (const Unavailable&) {
    throw NotPacked("its files cannot be packed in " + PlaceOfTemporaryFiles() +
                    "; make room there, or name another folder by the variable TMPDIR");
  }
}

// What is wrong with a part of a study is told with its name.
template <class Make>
auto About(const std::string& part, const Make& make) {
  return WithName<InputError, Denied, TooLarge, NotPacked>(part, make);
}

// Files that exist only for the upload.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code error;
    std::string name = (std::filesystem::temp_directory_path(error) / "kinevox-submit-XXXXXX").string();
    if (error || !::mkdtemp(name.data())) throw Unavailable("there is no room for temporary files");
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

std::string ScanNamed(const std::string& name) { return "scan '" + name + "'"; }

struct Sendable {
  std::filesystem::path path;
  std::string suffix;
};

// All records of a list, newest first.
std::vector<ServiceJson> Records(ServiceClient& client, const std::string& path) {
  std::vector<ServiceJson> records;
  std::string cursor;
  do {
    const ServiceJson page = client.GetPatiently(path + "?limit=200" + cursor);
    records.insert(records.end(), page["items"].begin(), page["items"].end());
    cursor = page["next"].is_string() ? "&cursor=" + page["next"].get<std::string>() : "";
  } while (!cursor.empty());
  return records;
}

struct Recipient {
  std::string subject, key;
  std::set<std::string> scans;  // that it has
};

// A key whose subject was removed leads to the next key.
Recipient RecipientOf(const Study& study, std::string key, ServiceClient& client) {
  while (true) {
    const std::string id =
        client.Post("/v1/subjects", {{"name", study.name}, {"region", NameOf(study.region)}}, key)["id"];
    try {
      Recipient recipient{id, key, {}};
      for (const ServiceJson& scan : Records(client, "/v1/subjects/" + id + "/scans"))
        recipient.scans.insert(scan["name"].get<std::string>());
      return recipient;
    } catch (const NotFound&) {
      key = NextKey(key, id);
    }
  }
}

// The label map that an earlier command sent or had made: the oldest of the template.
std::string BonesAlready(const Recipient& to, const std::string& template_scan, ServiceClient& client) {
  std::string oldest;
  for (const ServiceJson& bones : Records(client, "/v1/subjects/" + to.subject + "/bones"))
    if (bones["template"] == template_scan) oldest = bones["id"];
  return oldest;
}

ServiceJson ListOf(const std::vector<StudyBone>& bones) {
  ServiceJson list = ServiceJson::array();
  for (const StudyBone& bone : bones) {
    const ServiceJson parent = bone.parent.empty() ? ServiceJson() : ServiceJson(bone.parent);
    list.push_back({{"label", bone.label}, {"name", bone.name}, {"parent", parent}});
  }
  return list;
}

// As the study has them, but for fields that nobody reads: the service refuses those.
ServiceJson JointsOf(const ServiceJson& study_file) {
  ServiceJson joints = ServiceJson::array();
  for (const ServiceJson& joint : study_file["joints"])
    joints.push_back({{"child", joint["child"]}, {"dofs", joint["dofs"]}});
  return joints;
}

ServiceJson ModelRequest(const std::filesystem::path& study_file, const Study& study,
                         const std::string& subject, const std::string& bones) {
  std::ifstream in(study_file);
  const ServiceJson file = ServiceJson::parse(in);  // ReadStudy has checked it
  ServiceJson request{{"subject", subject}, {"template", study.template_scan}};
  request["bones"]["id"] = bones;
  if (!study.bones.empty()) request["bones"]["list"] = ListOf(study.bones);
  if (!study.joints.empty()) request["joints"] = JointsOf(file);
  if (file.contains("initial_poses")) request["initial_poses"] = file["initial_poses"];
  return request;
}

std::string ThresholdPath(const std::string& subject, const Study& study) {
  const std::string level = study.bone_level_hu ? ServiceJson(*study.bone_level_hu).dump() : "auto";
  return "/v1/subjects/" + subject + "/bones?kind=threshold&template=" + UrlEncoded(study.template_scan) +
         "&threshold=" + UrlEncoded(level);
}

// The model can be asked for only when the template's bones are there. Returns the label map's id.
std::string SegmentedBy(const std::string& job_id, ServiceClient& client, const UploadProgress& show,
                        const UploadWarning& warn) {
  GrowingPause pause;
  while (true) {
    const ServiceJson job = client.GetPatiently("/v1/jobs/" + job_id);
    if (job["state"] == "succeeded") {
      for (const std::string& warning : WarningsOf(job)) warn(warning);
      return job["result"]["bones"];
    }
    if (Ended(job["state"])) throw InputError("the bones could not be segmented: " + ReasonOf(job));
    show("segmenting the bones", job["progress"]);
    pause.Wait();
  }
}

// Sends the parts of one study, counting them.
class Sender {
 public:
  Sender(const Study& study, Recipient to, ServiceClient& client, const UploadProgress& show,
         const UploadWarning& warn)
      : study_(study), to_(std::move(to)), client_(client), show_(show), warn_(warn) {}

  void SendScans() {
    for (const StudyScan& scan : study_.scans) {
      if (!to_.scans.contains(scan.name)) Upload(ScanNamed(scan.name), {.name = scan.name}, scan.volume);
      part_ += 1;
    }
  }

  // Returns the label map's id.
  std::string SendBones() {
    const std::string already = BonesAlready(to_, study_.template_scan, client_);
    if (!already.empty()) return already;
    if (!study_.bone_labels.empty()) {
      Upload("bones", {.bones = true, .name = study_.template_scan}, LabelMapFile());
      // The same command elsewhere may have sent its own first, and asks for the model of that.
      return BonesAlready(to_, study_.template_scan, client_);
    }
    if (study_.bone_seeds.empty()) {
      const std::string path = ThresholdPath(to_.subject, study_);
      return SegmentedBy(AskForJob(client_, path, {}, to_.key).answer["job"], client_, show_, warn_);
    }
    const ServiceJson job =
        Upload("strokes", {.bones = true, .strokes = true, .name = study_.template_scan}, study_.bone_seeds);
    return SegmentedBy(job["id"], client_, show_, warn_);
  }

 private:
  // A folder of masks is sent as one label map, and so is a DICOM segmentation.
  std::filesystem::path LabelMapFile() {
    const std::filesystem::path& labels = study_.bone_labels;
    if (!HoldsDicom(labels)) return labels;
    RequireReadableSegments(labels, "DICOM", study_.bones);
    Show("packing the bones");
    const LayeredLabels given = ReadLabelsOrMasks(labels, study_.bones);
    const std::filesystem::path file = Scratch("bones.nii.gz");
    Packed([&] { WriteLabels(file, given.labels); });
    for (const std::string& warning : SharedVoxelWarnings(Named(given.shared_voxels))) warn_(warning);
    return file;
  }

  // Without a list the service names the bones, and numbers tell them apart.
  std::vector<std::pair<std::string, size_t>> Named(const std::map<int, size_t>& voxels_of_label) const {
    std::vector<std::pair<std::string, size_t>> named;
    for (const auto& [label, voxels] : voxels_of_label) {
      const auto bone = std::ranges::find(study_.bones, label, &StudyBone::label);
      if (bone != study_.bones.end())
        named.emplace_back(bone->name, voxels);
      else if (study_.bones.empty())
        named.emplace_back("label " + std::to_string(label), voxels);
    }
    return named;
  }

  // A folder is packed; a header with its data in another file becomes one file.
  Sendable MakeSendable(const std::string& what, const std::filesystem::path& volume) {
    if (std::filesystem::is_directory(volume)) {
      const Progress progress([&](std::string_view, double) { Show("packing " + what); }, InterruptRequested);
      const std::filesystem::path packed = Scratch("series.tar.gz");
      Packed([&] { PackSeries(volume, packed, progress); });
      return {packed, ".tar.gz"};
    }
    const std::optional<UploadFormat> format = FindUploadFormat(volume.filename().string());
    if (format && !format->archive) return {volume, format->suffix};
    Show("packing " + what);
    RequireReadableDicom(volume, "DICOM");
    const Scan scan = ReadScan(volume);
    const std::filesystem::path single = Scratch("volume.mha");
    Packed([&] { WriteVolume(single, scan.volume, scan.stored_as); });
    return {single, ".mha"};
  }

  ServiceJson Upload(const std::string& what, FileToSend file, const std::filesystem::path& volume) {
    return About(what, [&] {
      const Sendable sendable = MakeSendable(what, volume);
      file.subject = to_.subject, file.suffix = sendable.suffix, file.file = sendable.path;
      Show("uploading " + what);
      return client_.Upload(file, [&](double fraction) { Show("uploading " + what, fraction); });
    });
  }

  // `fraction`: of the part that is sent now.
  void Show(const std::string& what, double fraction = 0) {
    ThrowIfInterrupted();
    show_(what, (part_ + fraction) / (double(study_.scans.size()) + 1));
  }

  std::filesystem::path Scratch(const char* name) {
    if (!scratch_) Packed([this] { scratch_.emplace(); });
    return scratch_->path() / name;
  }

  const Study& study_;
  const Recipient to_;
  ServiceClient& client_;
  const UploadProgress& show_;
  const UploadWarning& warn_;
  std::optional<TemporaryFolder> scratch_;
  double part_ = 0;
};

Study SendableStudy(const std::filesystem::path& file) {
  Study study = ReadStudy(file);
  for (const StudyScan& scan : study.scans) RequireName(scan.name, "the name of " + ScanNamed(scan.name));
  return study;
}

}  // namespace

std::string KeyOfStudy(const std::filesystem::path& study_file, const UploadProgress& show) {
  const Study study = SendableStudy(study_file);
  show("reading", 0);
  Hasher hasher;
  const auto add_content = [&](const std::string& part, const std::filesystem::path& file) {
    ThrowIfInterrupted();
    hasher.Add(About(part, [&] { return ContentDigest(file); }));
  };
  hasher.Add("study").Add(study.name).Add(NameOf(study.region)).Add(study.template_scan);
  for (const StudyScan& scan : study.scans) {
    hasher.Add(scan.name);
    add_content(ScanNamed(scan.name), scan.volume);
  }
  for (const std::filesystem::path& file : {study.bone_labels, study.bone_seeds}) {
    if (file.empty())
      hasher.Add(Digest{});
    else
      add_content("bones", file);
  }
  if (is_directory(study.bone_labels)) {  // the list says which masks count
    for (const StudyBone& bone : study.bones) hasher.Add(bone.name).Add(int64_t(bone.label));
  }
  hasher.Add(study.bone_level_hu ? std::to_string(*study.bone_level_hu) : "auto");
  return "submit-" + hasher.Finish().Hex();
}

ServiceJson SendStudy(const std::filesystem::path& study_file, const std::string& key, ServiceClient& client,
                      const UploadProgress& show, const UploadWarning& warn) {
  const Study study = SendableStudy(study_file);
  for (const std::string& warning : UnreadFieldWarnings(study.unread_fields))
    warn(warning);  // the service gets none of them
  const Recipient to = RecipientOf(study, key, client);
  Sender sender(study, to, client, show, warn);
  sender.SendScans();
  return ModelRequest(study_file, study, to.subject, sender.SendBones());
}

}  // namespace kvx
