// A posed volume is named by all it depends on, so that a client or a cache may keep it for ever.
#include "api/handlers/posing.h"

#include <nlohmann/json.hpp>

#include "api/point_list.h"
#include "core/errors.h"

namespace kvx {
namespace {

constexpr int kCoarsestLevel = 4;

struct FormatName {
  std::string_view name;
  VolumeFormat format;
  const char* content_type;
};
constexpr FormatName kFormats[] = {{"nii.gz", VolumeFormat::kNiftiGz, "application/gzip"},
                                   {"nrrd", VolumeFormat::kNrrd, "application/octet-stream"},
                                   {"mha", VolumeFormat::kMha, "application/octet-stream"},
                                   {"raw", VolumeFormat::kRaw, "application/octet-stream"}};

const FormatName& FormatOf(const Query& query) {
  const std::string wanted = QueryValue(query, "format", "nii.gz");
  for (const FormatName& format : kFormats) {
    if (format.name == wanted) return format;
  }
  throw InputError("'format' is nii.gz, nrrd, mha or raw");
}

PosingMode ModeOf(const Query& query) {
  const std::string mode = QueryValue(query, "mode", "evd");
  if (mode != "evd" && mode != "vbd") throw InputError("'mode' is evd or vbd");
  return mode == "evd" ? PosingMode::kEvd : PosingMode::kVbd;
}

bool IsPoseParameter(const std::string& name) { return name == "scan" || name.find('.') != std::string::npos; }

PoseRequest PoseOfQuery(const Query& query) {
  AnglePose angles;
  for (const auto& [name, value] : query) {
    if (name.find('.') == std::string::npos) continue;
    angles.angles_rad[name] = RadFromDeg(ParseNumber(QueryValue(query, name), "'" + name + "'"));
  }
  const std::string scan = QueryValue(query, "scan");
  if (scan.empty()) return angles;
  if (!angles.angles_rad.empty()) throw InputError("give joint angles or 'scan', not both");
  return ScanPose{scan};
}

void RequirePoseParametersOr(const Query& query, std::initializer_list<std::string_view> known, bool pose_in_body) {
  Query rest;
  for (const auto& item : query) {
    if (!IsPoseParameter(item.first)) rest.insert(item);
    else if (pose_in_body) throw InputError("the pose is in the body; leave it out of the query");
  }
  RequireKnown(rest, known);
}

void RequireBuilt(Services& services, const std::string& id) {
  const ModelRecord model = services.catalogue.RequireModel(id);
  if (model.job_state == "succeeded") return;
  throw Conflict("the model is not built: its job " + model.job + " is " + model.job_state);
}

std::string Joined(const Json& numbers) {
  std::string text;
  for (const Json& number : numbers) text += (text.empty() ? "" : ",") + number.dump();
  return text;
}

void AddRawHeaders(VolumeAnswer& answer) {
  std::string text(kRawHeaderBytes, ' ');
  answer.file->ReadAt(0, text.data(), text.size());
  const Json header = Json::parse(text);
  answer.offset = kRawHeaderBytes;
  answer.headers = {{"X-Kinevox-Size", Joined(header["size"])},
                    {"X-Kinevox-Spacing", Joined(header["spacing"])},
                    {"X-Kinevox-Origin", Joined(header["origin"])},
                    {"X-Kinevox-Direction", Joined(header["direction"])},
                    {"X-Kinevox-Type", header["type"].get<std::string>()}};
}

}  // namespace

bool MatchesEtag(const std::string& if_none_match, const std::string& etag) {
  for (size_t begin = 0; begin < if_none_match.size();) {
    size_t end = if_none_match.find(',', begin);
    if (end == std::string::npos) end = if_none_match.size();
    std::string_view item = std::string_view(if_none_match).substr(begin, end - begin);
    while (item.starts_with(' ')) item.remove_prefix(1);
    while (item.ends_with(' ')) item.remove_suffix(1);
    if (item.starts_with("W/")) item.remove_prefix(2);  // the comparison here is the weak one (RFC 9110, 13.1.2)
    if (item == etag || item == "*") return true;
    begin = end + 1;
  }
  return false;
}

VolumeAnswer GetVolume(Services& services, const std::string& model, const Query& query, const std::string& pose,
                       const std::string& if_none_match) {
  RequirePoseParametersOr(query, {"format", "mode", "level"}, !pose.empty());
  const FormatName& format = FormatOf(query);
  PosedQuery posed{model, {}, ModeOf(query), QueryInt(query, "level", 0, 0, kCoarsestLevel)};
  posed.pose = pose.empty() ? PoseOfQuery(query) : services.poser.ParsePose(pose);
  RequireBuilt(services, model);
  const Digest digest = Hasher().Add(services.poser.PoseDigest(posed)).Add(format.name).Finish();
  VolumeAnswer answer;
  answer.etag = "\"" + digest.Hex() + "\"";
  answer.not_modified = MatchesEtag(if_none_match, answer.etag);
  if (answer.not_modified) return answer;
  const std::string suffix = "." + std::string(format.name);
  answer.file = services.results.Get(model + "." + digest.Hex() + suffix, [&](const std::filesystem::path& path) {
    const Turns::Held turn(services.posing_turns);
    services.poser.WriteVolume(posed, format.format, path);
  });
  answer.content_type = format.content_type;
  answer.filename = model + suffix;
  if (format.format == VolumeFormat::kRaw) AddRawHeaders(answer);
  return answer;
}

PointsAnswer MapPoints(Services& services, const std::string& model, const Query& query,
                       const std::string& content_type, const std::string& accept, const std::string& body) {
  const bool json = content_type.find("json") != std::string::npos;
  PointList list = json ? PointsOfJson(body) : PointsOfCsv(body);
  RequirePoseParametersOr(query, {"mode"}, !list.pose.empty());
  PosedQuery posed{model, {}, ModeOf(query), 0};
  posed.pose = list.pose.empty() ? PoseOfQuery(query) : services.poser.ParsePose(list.pose);
  RequireBuilt(services, model);
  {
    const Turns::Held turn(services.posing_turns);
    list.points = services.poser.MapPoints(posed, list.points);
  }
  const bool wants_json = accept.find("application/json") != std::string::npos;
  const bool wants_csv = accept.find("text/csv") != std::string::npos;
  if (wants_json || (json && !wants_csv)) return {"application/json", JsonOfPoints(list)};
  return {"text/csv; charset=utf-8", CsvOfPoints(list)};
}

}  // namespace kvx
