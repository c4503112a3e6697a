// Names are ASCII (core/name.h), so no text here needs a character set.
#include "pipeline/model/posed_series.h"

#include <algorithm>
#include <cmath>

#include "pipeline/io/dicom/segmentation_writer.h"

namespace kvx {
namespace {

constexpr size_t kLongestDescription = 64, kLongestComment = 10240;  // of LO and LT, PS3.5 6.2
constexpr double kShownExtrapolation = 0.005, kMostExtrapolation = 9999;
const char kIntroduction[] = "For research, not for diagnosis. Computed, not acquired. ";

std::string Written(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value == 0 ? 0.0 : value);
  return text;
}

std::string Number(double value) { return Written("%.6g", value); }

std::string Counted(size_t more) { return more ? " +" + std::to_string(more) : ""; }

// Then how many do not; of a first one that is too long its end.
std::string AsManyAsFit(const std::vector<std::string>& items, size_t most) {
  std::string text;
  for (size_t n = 0; n < items.size(); ++n) {
    const std::string longer = text + (n ? " " : "") + items[n], rest = Counted(items.size() - n - 1);
    if (longer.size() + rest.size() > most) {
      if (n) return text + Counted(items.size() - n);
      const size_t kept = most - rest.size() - 3;
      return "..." + longer.substr(longer.size() - kept) + rest;
    }
    text = longer;
  }
  return text;
}

std::string Scanned(const ScanPose& pose, const std::vector<std::string>& scan_names) {
  const auto found = std::ranges::find(scan_names, pose.scan);
  return found == scan_names.end() ? "template pose"
                                   : "scan " + std::to_string(found - scan_names.begin() + 1);
}

std::vector<std::string> Motions(const AnglePose& pose) {
  std::vector<std::string> out;
  for (const auto& [name, angle_rad] : pose.angles_rad)
    if (angle_rad != 0) out.push_back(name + "=" + Number(DegFromRad(angle_rad)));
  return out;
}

std::vector<std::string> Turns(const BonePose& pose) {
  std::vector<std::string> out;
  for (const auto& [bone, scan_from_template] : pose.scan_from_template) {
    const double turn_rad = 2 * std::acos(std::min(1.0, std::abs(scan_from_template.rotation.w())));
    out.push_back(bone + " turned " + Number(DegFromRad(turn_rad)));
  }
  return out;
}

std::vector<std::string> Transforms(const BonePose& pose) {
  std::vector<std::string> out;
  for (const auto& [bone, scan_from_template] : pose.scan_from_template) {
    out.push_back(bone + "=");
    const auto numbers = RowMajor(scan_from_template);
    for (int i = 0; i < 12; ++i) out.back() += (i ? "," : "") + Number(numbers[size_t(i)]);
  }
  return out;
}

std::string ShortPose(const PosedAs& posed, const std::vector<std::string>& scan_names, size_t most) {
  if (const auto* as_in = std::get_if<ScanPose>(&posed.request)) return Scanned(*as_in, scan_names);
  const auto* angles = std::get_if<AnglePose>(&posed.request);
  const std::vector<std::string> items = angles ? Motions(*angles) : Turns(std::get<BonePose>(posed.request));
  return items.empty() ? "template pose" : AsManyAsFit(items, most);
}

std::string WholePose(const PosedAs& posed, const std::vector<std::string>& scan_names, size_t most) {
  if (const auto* bones = std::get_if<BonePose>(&posed.request))
    return "Scan from template (rows of 3 x 4, LPS mm): " + AsManyAsFit(Transforms(*bones), most);
  const std::string pose = ShortPose(posed, scan_names, most);
  return std::holds_alternative<AnglePose>(posed.request) ? "Degrees, of shifts mm: " + pose : pose;
}

}  // namespace

SeriesText TextOf(const PosedAs& posed, const std::vector<std::string>& scan_names) {
  const std::string beyond = Written("%.2f", std::min(posed.extrapolation, kMostExtrapolation));
  const std::string first =
      (posed.extrapolation < kShownExtrapolation ? "" : "EXTRAPOLATED " + beyond + " ") + "Kinevox ";
  const std::string last = (posed.mode != DeformationMode::kEvd ? " " + NameOf(posed.mode) : "") +
                           (posed.level ? " level " + std::to_string(posed.level) : "");
  const std::string rest = ". Mode " + NameOf(posed.mode) + ", level " + std::to_string(posed.level) +
                           ". Extrapolation " + beyond + " (0: inside the scanned poses)";
  constexpr size_t kHeading = 64;  // what is said before a whole pose
  return {first + ShortPose(posed, scan_names, kLongestDescription - first.size() - last.size()) + last,
          kIntroduction +
              WholePose(posed, scan_names, kLongestComment - kHeading - sizeof kIntroduction - rest.size()) +
              rest};
}

DicomSeries SeriesOf(const Model& model, const PosedAs& posed, const std::string& modality,
                     const std::string& patient_id) {
  const ModelManifest& manifest = model.manifest();
  const SeriesText text = TextOf(posed, model.scan_names());
  return {modality.empty() ? model.template_scan().modality : modality,
          patient_id,
          manifest.ContentDigest(),
          WorldOf(manifest, posed.request),
          text.description,
          text.comment};
}

void WritePosedBones(const std::filesystem::path& path, const Model& model, const LabelMap& labels,
                     const Volume& posed, const DicomSeries& series) {
  std::map<int, std::string> names;
  for (const Bone& bone : model.bones().bones) names[bone.label] = bone.name;
  WriteDicomSegmentation(path, labels, names, series,
                         ImagesOf(posed, DicomGreysOf(model.template_scan()), series));
}

}  // namespace kvx
