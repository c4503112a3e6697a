// A study on its way to the service: what the service lacks is sent. The same study finds its subject again.
#pragma once
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/service_client.h"

namespace kvx {

using UploadProgress = std::function<void(const std::string& what, double fraction)>;

// Idempotency-Key of a study by its names and the bytes of its files.
std::string KeyOfStudy(const std::filesystem::path& study_file);

// Sends what the service does not have, and returns what POST /v1/models takes, without options. Under a key
// that was used before it is the subject of then, with the scans and bones that it has. Throws InputError
// naming the scan.
ServiceJson SendStudy(const std::filesystem::path& study_file, const std::string& key, ServiceClient& client,
                      const UploadProgress& show);

// A question that makes jobs, and what became of it. The same question under the same key gets the answer
// that it got before, unless its jobs have all ended and not all of them well, or are gone: then a new one.
struct Asked {
  ServiceJson answer;
  bool earlier = false;  // the answer of an earlier command
};
Asked AskOnce(ServiceClient& client, const std::string& path, const ServiceJson& body, std::string key);

bool Ended(const ServiceJson& state);
std::string ReasonOf(const ServiceJson& ended_job);
// What the job says of its study in its result.
std::vector<std::string> WarningsOf(const ServiceJson& ended_job);
void TellWarnings(const ServiceJson& ended_job, const std::string& about = {});  // before each

}  // namespace kvx
