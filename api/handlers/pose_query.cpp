// A posed thing is named by all it depends on, so that whoever has it need not be sent it again.
#include "api/handlers/pose_query.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/errors.h"
#include "core/errors.h"

namespace kvx {
namespace {

constexpr int kCoarsestLevel = 5;

std::string Joined(const Json& numbers) {
  std::string text;
  for (const Json& number : numbers) text += (text.empty() ? "" : ",") + number.dump();
  return text;
}

bool IsPoseParameter(const std::string& name) {
  return name == "scan" || name.find('.') != std::string::npos;
}

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

// RFC 9110, 13.1: If-None-Match compares weakly, If-Match strongly, where no weak one is the same.
enum class EtagComparison { kWeak, kStrong };
bool MatchesEtag(const std::string& condition, const std::string& etag, EtagComparison comparison) {
  for (size_t begin = 0; begin < condition.size();) {
    const size_t end = std::min(condition.find(',', begin), condition.size());
    std::string_view item = std::string_view(condition).substr(begin, end - begin);
    while (item.starts_with(' ')) item.remove_prefix(1);
    while (item.ends_with(' ')) item.remove_suffix(1);
    if (comparison == EtagComparison::kWeak && item.starts_with("W/")) item.remove_prefix(2);
    if (item == etag || item == "*") return true;
    begin = end + 1;
  }
  return false;
}

}  // namespace

PosedQuery PosedQueryOf(Services& services, const std::string& model, const Query& query,
                        std::initializer_list<std::string_view> known, const std::string& pose_body) {
  Query rest;
  for (const auto& item : query) {
    if (!IsPoseParameter(item.first)) {
      rest.insert(item);
      continue;
    }
    if (!pose_body.empty()) throw InputError("the pose is in the body; leave it out of the query");
    RequireGiven(item.first, item.second);
  }
  RequireKnown(rest, known);
  RequireFewValues(pose_body);
  PosedQuery posed;
  posed.model = model;
  posed.asker = services.asker();
  posed.mode = DeformationModeFromName(QueryValue(query, "mode", "evd"));
  posed.level = QueryLevel(query);
  posed.pose = pose_body.empty() ? PoseOfQuery(query) : services.poser.ParsePose(pose_body);
  return posed;
}

std::optional<double> QueryNumber(const Query& query, const std::string& name) {
  const std::string text = QueryValue(query, name);
  if (text.empty()) return std::nullopt;
  return ParseNumber(text, "'" + name + "'");
}

int QueryLevel(const Query& query, int otherwise) {
  return QueryInt(query, "level", otherwise, 0, kCoarsestLevel);
}

bool QueryYesOrNo(const Query& query, const std::string& name) {
  const std::string text = QueryValue(query, name, "false");
  if (text != "true" && text != "false") throw InputError("'" + name + "' is true or false");
  return text == "true";
}

void RequireBuilt(Services& services, const std::string& id) {
  const ModelRecord model = services.catalogue.RequireModel(id);
  if (model.job_state == "succeeded") return;
  throw Conflict("the model is not built: its job " + model.job + " is " + model.job_state);
}

std::string PosedFileName(const std::string& model, const Digest& digest, std::string_view ending) {
  constexpr size_t kDigits = 8;
  return model + "." + digest.Hex().substr(0, kDigits) + "." + std::string(ending);
}

FileAnswer AnswerWith(const Digest& digest, const Conditions& conditions, const std::string& content_type,
                      const std::string& filename,
                      const std::function<std::shared_ptr<const CachedFile>()>& file) {
  FileAnswer answer;
  answer.etag = "\"" + digest.Hex() + "\"";
  if (!conditions.if_match.empty() && !MatchesEtag(conditions.if_match, answer.etag, EtagComparison::kStrong))
    throw PreconditionFailed("what you ask for has changed since: If-Match is not its ETag");
  answer.not_modified = MatchesEtag(conditions.if_none_match, answer.etag, EtagComparison::kWeak);
  if (answer.not_modified) return answer;
  answer.file = file();
  answer.content_type = content_type;
  answer.filename = filename;
  return answer;
}

void TellGeometry(FileAnswer& answer) {
  std::string text(kRawHeaderBytes, ' ');
  answer.file->ReadAt(0, text.data(), text.size());
  const Json header = Json::parse(text);
  answer.offset = kRawHeaderBytes;
  const auto tell = [&](const char* name, const std::string& value) {
    answer.headers.push_back({name, value});
  };
  tell("X-Kinevox-Size", Joined(header["size"]));
  tell("X-Kinevox-Spacing", Joined(header["spacing"]));
  tell("X-Kinevox-Origin", Joined(header["origin"]));
  tell("X-Kinevox-Direction", Joined(header["direction"]));
  tell("X-Kinevox-Type", header["type"].get<std::string>());
  if (header.contains("window")) tell("X-Kinevox-Window", Joined(header["window"]));
  if (!header.contains("components")) return;
  tell("X-Kinevox-Components", header["components"].dump());
  tell("X-Kinevox-Largest-Error-Mm", header["largest_error_mm"].dump());
  tell("X-Kinevox-P99-Error-Mm", header["p99_error_mm"].dump());
  tell("X-Kinevox-Mean-Error-Mm", header["mean_error_mm"].dump());
}

FileAnswer Told(FileAnswer answer, const PoseFacts& facts) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", facts.extrapolation);
  answer.headers.push_back({"X-Kinevox-Extrapolation", text});
  return ToldOfScan(std::move(answer), facts);
}

FileAnswer ToldOfScan(FileAnswer answer, const PoseFacts& facts) {
  if (!facts.scan_verdict.empty()) answer.headers.push_back({"X-Kinevox-Scan-Verdict", facts.scan_verdict});
  return answer;
}

}  // namespace kvx
