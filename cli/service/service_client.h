// The HTTP client of the service's subcommands: JSON, uploads and downloads;
// problem documents become our errors.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "cli/commands.h"
#include "core/errors.h"

namespace kvx {

using ServiceJson = nlohmann::ordered_json;
using FractionSink = std::function<void(double)>;  // told how much of a transfer is done, 0..1

std::string UrlEncoded(const std::string& text);

using WaitSink = std::function<void(const std::string& reason)>;

WaitSink TellOnStderr();  // `kinevox: waiting: ...`, each reason once

class NoAnswer : public Unavailable {
  using Unavailable::Unavailable;
};  // nobody answers, or no longer

class TooLarge : public Refused {
  using Refused::Refused;
};  // more than the service takes at once

// A file on its way to a subject: a scan by its name, or bones by the name of their template.
struct FileToSend {
  std::string subject;
  bool bones = false, strokes = false;  // strokes: bones to be made of them
  std::string name, suffix;             // suffix: ".nii.gz", ...
  std::filesystem::path file;
};

// What an answer's headers say of a posed thing, as they say it; empty: nothing.
struct ToldOfPose {
  std::string extrapolation, scan_verdict;
  std::string size, spacing, origin, direction, type;  // of raw voxels
};

class ServiceClient {
 public:
  explicit ServiceClient(const std::string& url);  // http://host:port; throws UsageError
  ~ServiceClient();

  // Whom to tell of pauses that are more than a moment, each time, before they begin.
  void OnWait(WaitSink sink);
  // 400 -> InputError, 404 -> NotFound, 401, 403, 429 -> Refused, 413 -> TooLarge,
  // 409 -> Conflict, others and no answer -> Unavailable.
  // Body null: without one. Without a key of the caller's the request gets one of its own.
  ServiceJson Post(const std::string& path, const ServiceJson& body, const std::string& key = "");
  // The record that the file became; of strokes, the job. Bytes that the service has are not sent again,
  // those that an earlier command sent among them; a lost connection costs a pause: it goes on where the
  // service is (tus), for two minutes without progress.
  ServiceJson Upload(const FileToSend& file, const FractionSink& progress);
  // Asks again, for two minutes, while the service has no time (429, 502, 503, 504) or a service that has
  // answered before does not. So do Post and Upload. A 429 whose Retry-After is above a minute (a quota of
  // the day) is Refused at once.
  ServiceJson GetPatiently(const std::string& path);
  // Why the service begins no job now, by its own account (/readyz); empty: it would, or says nothing.
  std::string WhyNotReady();
  // Of a job or batch; asks again as GetPatiently does. One whose answer was lost counts when it has
  // cancelled.
  ServiceJson Delete(const std::string& path);
  // `post_body` empty: GET. Written under a temporary name, then renamed. Asks again as GetPatiently does,
  // and goes on where it was.
  ToldOfPose Download(const std::string& path, const std::string& post_body, const std::filesystem::path& out,
                      const FractionSink& progress);

 private:
  struct Standing;
  ServiceJson Announce(const FileToSend& file, const std::string& sha256);
  Standing CreateUpload(const std::string& metadata, size_t size, const std::string& key);
  ServiceJson SendParts(Standing upload, const std::filesystem::path& file, const FractionSink& progress);
  ServiceJson SendResumably(const FileToSend& file, const std::string& sha256, const FractionSink& progress);
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
