// What requests for posed things have in common: the pose, its mode, and how a made file is answered.
#pragma once
#include <optional>

#include "api/request.h"
#include "api/services.h"
#include "storage/files/content_encoding.h"

namespace kvx {

// Of an HTTP request, as far as it concerns the answer's form.
struct Conditions {
  Conditions() = default;
  Conditions(std::string none_match) : if_none_match(std::move(none_match)) {}
  Conditions(const char* none_match) : if_none_match(none_match) {}
  std::string if_match, if_none_match, accept_encoding;
};

struct FileAnswer {
  std::string etag;           // strong, with its quotes
  bool not_modified = false;  // the client has it: no file
  std::shared_ptr<const CachedFile> file;
  size_t offset = 0;  // where the content starts in the file
  std::string content_type, filename;
  std::vector<std::pair<std::string, std::string>> headers;
};

// The pose, mode and level of a query; with a body the pose is there.
// Parameters beside `known` and the pose are refused.
PosedQuery PosedQueryOf(Services& services, const std::string& model, const Query& query,
                        std::initializer_list<std::string_view> known, const std::string& pose_body);
std::optional<double> QueryNumber(const Query& query, const std::string& name);
int QueryLevel(const Query& query, int otherwise = 0);
bool QueryYesOrNo(const Query& query, const std::string& name);   // no when it is not there
void RequireBuilt(Services& services, const std::string& model);  // throws NotFound, Conflict

// Of a posed file, for who keeps several: the model, a part of the digest, and the ending.
std::string PosedFileName(const std::string& model, const Digest& digest, std::string_view ending);

// The kept file of this name, or a new one; nothing when the client has it.
FileAnswer AnswerWith(const Digest& digest, const Conditions& conditions, const std::string& content_type,
                      const std::string& filename,
                      const std::function<std::shared_ptr<const CachedFile>()>& file);

// Geometry as headers, of a file that begins with RawHeader or the like; the content begins behind it.
void TellGeometry(FileAnswer& answer);

// X-Kinevox-Extrapolation: how far outside the examples the pose is; and as ToldOfScan.
FileAnswer Told(FileAnswer answer, const PoseFacts& facts);
// X-Kinevox-Scan-Verdict: of a scan, whether it belongs to its study.
FileAnswer ToldOfScan(FileAnswer answer, const PoseFacts& facts);

}  // namespace kvx
