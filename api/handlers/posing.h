// Posed volumes and posed points of a built model.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

struct VolumeAnswer {
  std::string etag;                              // strong, with its quotes
  bool not_modified = false;                     // the client has it: no file
  std::shared_ptr<const CachedFile> file;
  size_t offset = 0;                             // where the content starts in the file
  std::string content_type, filename;
  std::vector<std::pair<std::string, std::string>> headers;
};

// Query: any bone.dof=degrees, or scan=NAME; mode, level, format. `pose` is the body of a POST, empty for GET.
VolumeAnswer GetVolume(Services& services, const std::string& model, const Query& query, const std::string& pose,
                       const std::string& if_none_match);

struct PointsAnswer {
  std::string content_type, body;
};

// Template points to the pose; CSV (header x,y,z, further columns carried through) or {"points": [[x,y,z], ...], "pose"?}.
PointsAnswer MapPoints(Services& services, const std::string& model, const Query& query,
                       const std::string& content_type, const std::string& accept, const std::string& body);

bool MatchesEtag(const std::string& if_none_match, const std::string& etag);

}  // namespace kvx
