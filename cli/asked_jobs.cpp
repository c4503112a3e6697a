// What came of a question under its key is looked at before it counts as an answer.
#include "cli/asked_jobs.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>

#include "cli/named_files.h"
#include "core/digest.h"
#include "core/parse_number.h"
#include "storage/job_queue.h"

namespace kvx {
namespace {

// A job that is newer than the newest before is this command's own, however it fared. An earlier one counts
// unless it is spent: it has ended, and not well, or is gone.
enum class JobFate { kOwn, kEarlier, kSpent };

class NewestBefore {
 public:
  explicit NewestBefore(ServiceClient& client) : client_(client) {
    const ServiceJson newest = client.GetPatiently("/v1/jobs?limit=1")["items"];
    if (!newest.empty()) job_ = newest[0];
  }
  // Jobs of one request are made at one moment, the newest among them.
  bool AreOwn(const ServiceJson& models) const {
    const auto is_newest = [&](const ServiceJson& model) { return model["job"] == job_["id"]; };
    if (!job_.is_null() && std::ranges::any_of(models, is_newest)) return false;
    return FateOf(models.at(0)["job"]) == JobFate::kOwn;
  }
  JobFate FateOf(const std::string& id) const {
    try {
      const ServiceJson job = client_.GetPatiently("/v1/jobs/" + id);
      const bool own = job_.is_null() || (job["id"] != job_["id"] && job["created"] >= job_["created"]);
      return own ? JobFate::kOwn : EndedBadly(job["state"]) ? JobFate::kSpent : JobFate::kEarlier;
    } catch (const NotFound&) {
      return JobFate::kSpent;
    }
  }

 private:
  ServiceClient& client_;
  ServiceJson job_;
};

// States of the batch's jobs that are still there, by job.
std::map<std::string, ServiceJson> StatesOf(ServiceClient& client, const std::string& batch) {
  std::map<std::string, ServiceJson> states;
  try {
    const ServiceJson now = client.GetPatiently("/v1/batches/" + batch);
    for (const ServiceJson& model : now["models"]) states[model["job"]] = model["state"];
  } catch (const NotFound&) {
  }
  return states;
}

// "the service says: models[3]: 'bones' ...": what the service finds wrong with one model of a batch.
struct Refusal {
  size_t index = 0;
  std::string detail;
};
std::optional<Refusal> RefusalIn(const std::string& message) {
  constexpr std::string_view kBefore = "models[", kAfter = "]: ";
  const size_t start = message.find(kBefore), end = message.find(kAfter, start);
  if (start == message.npos || end == message.npos) return std::nullopt;
  const size_t digits = start + kBefore.size();
  const auto index = ParseAs<size_t>(std::string_view(message).substr(digits, end - digits));
  if (!index) return std::nullopt;
  return Refusal{*index, message.substr(0, start) + message.substr(end + kAfter.size())};
}

// Takes the one that the service refuses out of those that are asked for. False: it is not about one of them.
bool SetAside(const Error& error, std::vector<size_t>& asked, std::vector<ServiceJson>& models) {
  const std::optional<Refusal> refusal = RefusalIn(error.what());
  if (!refusal || refusal->index >= asked.size()) return false;
  models[asked[refusal->index]] = {{"state", "failed"}, {"error", ProblemOf(refusal->detail)}};
  asked.erase(asked.begin() + std::ptrdiff_t(refusal->index));
  return true;
}

ServiceJson BatchOf(const std::vector<ServiceJson>& requests, const std::vector<size_t>& asked) {
  ServiceJson body{{"models", ServiceJson::array()}};
  for (const size_t i : asked) body["models"].push_back(requests[i]);
  return body;
}

// The batch of those that are asked for. Null where the service refuses one of them, which is set aside then.
ServiceJson PostBatch(ServiceClient& client, const std::vector<ServiceJson>& requests,
                      const std::string& after, std::vector<size_t>& asked,
                      std::vector<ServiceJson>& models) {
  const ServiceJson body = BatchOf(requests, asked);
  try {
    return client.Post("/v1/batches", body, NextKey(after, body.dump()));
  } catch (const InputError& error) {
    if (!SetAside(error, asked, models)) throw;
  } catch (const NotFound& error) {
    if (!SetAside(error, asked, models)) throw;
  }
  return {};
}

ServiceJson ModelOf(const ServiceJson& batch, size_t i) {
  const ServiceJson& model = batch["models"].at(i);
  return {{"id", model["id"]}, {"job", model["job"]}, {"state", model["state"]}, {"batch", batch["id"]}};
}

// Those of an earlier command's batch that have to be asked for again.
std::vector<size_t> SpentOf(const std::map<std::string, ServiceJson>& states, const ServiceJson& batch,
                            const std::vector<size_t>& asked) {
  std::vector<size_t> spent;
  for (size_t i = 0; i < asked.size(); ++i) {
    const auto state = states.find(batch["models"].at(i)["job"]);
    const bool gone = state == states.end();
    if (gone || EndedBadly(state->second)) spent.push_back(asked[i]);
  }
  return spent;
}

}  // namespace

std::string NextKey(const std::string& key, const std::string& spent_id) {
  return "submit-" + Hasher().Add(key).Add(spent_id).Finish().Hex();
}

AskedJob AskForJob(ServiceClient& client, const std::string& path, const ServiceJson& body, std::string key) {
  const NewestBefore before(client);
  while (true) {
    const ServiceJson answer = client.Post(path, body, key);
    const JobFate fate = before.FateOf(answer["job"]);
    if (fate != JobFate::kSpent) return {answer, fate != JobFate::kOwn};
    key = NextKey(key, answer["job"]);
  }
}

AskedModels AskForModels(ServiceClient& client, const std::vector<ServiceJson>& requests,
                         const std::string& key) {
  const NewestBefore before(client);
  AskedModels all{.models = std::vector<ServiceJson>(requests.size()), .batch = "", .earlier = true};
  std::vector<size_t> asked(requests.size());
  std::iota(asked.begin(), asked.end(), size_t(0));
  std::string after = key;
  while (!asked.empty()) {
    const ServiceJson batch = PostBatch(client, requests, after, asked, all.models);
    if (batch.is_null()) continue;
    all.batch = batch["id"];
    for (size_t i = 0; i < asked.size(); ++i) all.models[asked[i]] = ModelOf(batch, i);
    if (before.AreOwn(batch["models"])) {
      all.earlier = false;
      break;
    }
    asked = SpentOf(StatesOf(client, all.batch), batch, asked);
    after = NextKey(after, batch["models"].at(0)["job"]);
  }
  all.earlier = all.earlier && !all.batch.empty();
  return all;
}

bool Ended(const ServiceJson& state) { return IsEnd(state.get_ref<const std::string&>()); }
bool EndedBadly(const ServiceJson& state) { return Ended(state) && state != "succeeded"; }

ServiceJson ProblemOf(const std::string& detail) {
  return {{"type", "urn:kinevox:problem:not-submitted"}, {"detail", detail}};
}

std::string ReasonOf(const ServiceJson& job) {
  if (job["state"] == "cancelled") return "cancelled on the service";
  return job.value("/error/detail"_json_pointer, std::string("no reason was given"));
}

std::vector<std::string> WarningsOf(const ServiceJson& job) {
  return job.value("/result/warnings"_json_pointer, std::vector<std::string>());
}

void TellWarnings(const ServiceJson& job, const std::string& about) {
  for (const std::string& warning : WarningsOf(job)) Warn(about + warning);
}

}  // namespace kvx
