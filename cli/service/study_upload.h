// A study on its way to the service: what the service lacks is sent. The same study finds its subject again.
#pragma once
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/service/service_client.h"

namespace kvx {

using UploadProgress = std::function<void(const std::string& what, double fraction)>;  // of the study, 0..1
using UploadWarning = std::function<void(const std::string& sentence)>;

// The temporary files that a study is sent as cannot be written.
class NotPacked : public Unavailable {
  using Unavailable::Unavailable;
};

// Idempotency-Key of a study by its names and the bytes of its files.
std::string KeyOfStudy(const std::filesystem::path& study_file, const UploadProgress& show);

// Sends what the service does not have, and returns what POST /v1/models takes, without options. Under a key
// that was used before it is the subject of then, with the scans and bones that it has. Throws InputError,
// Denied or TooLarge naming the scan, and NotPacked.
ServiceJson SendStudy(const std::filesystem::path& study_file, const std::string& key, ServiceClient& client,
                      const UploadProgress& show, const UploadWarning& warn);

}  // namespace kvx
