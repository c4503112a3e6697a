// What came of a question under its key is looked at before it counts as an answer.
#include "cli/service/asked_jobs.h"

#include <numeric>
#include <optional>

#include "cli/options/named_files.h"
#include "core/digest.h"
#include "core/text/parse_number.h"
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

// A request with the key that it stands under: another after a job of it is spent.
struct KeyedRequest {
  ServiceJson request;
  std::string key;
};

ServiceJson BatchOf(const std::vector<KeyedRequest>& requests, const std::vector<size_t>& asked) {
  ServiceJson body{{"models", ServiceJson::array()}, {"keys", ServiceJson::array()}};
  for (const size_t i : asked) {
    body["models"].push_back(requests[i].request);
    body["keys"].push_back(requests[i].key);
  }
  return body;
}

// The batch of those that are asked for. Null where the service refuses one of them, which is set aside then.
ServiceJson PostBatch(ServiceClient& client, const std::vector<KeyedRequest>& requests,
                      std::vector<size_t>& asked, std::vector<ServiceJson>& models) {
  try {
    return client.Post("/v1/batches", BatchOf(requests, asked));
  } catch (const Error& error) {
    if (!IsOneOf<InputError, NotFound, Conflict>(error) || !SetAside(error, asked, models)) throw;
  }
  return {};
}

// What the answer says of one model. Without a batch it was asked for alone; one of then may have ended.
ServiceJson ModelOf(const ServiceJson& told) {
  ServiceJson model{{"id", told["id"]}, {"job", told["job"]}, {"state", told["state"]}};
  for (const char* field : {"batch", "result", "error"})
    if (told.contains(field) && !told[field].is_null()) model[field] = told[field];
  return model;
}

// Returns those whose jobs of then are spent, and which are to be asked for anew; where the service refuses
// one, all the others.
std::vector<size_t> AskOnce(ServiceClient& client, std::vector<KeyedRequest>& keyed,
                            std::vector<size_t> asked, AskedModels& all) {
  const ServiceJson batch = PostBatch(client, keyed, asked, all.models);
  if (batch.is_null()) return asked;
  all.batch = batch["id"];
  std::vector<size_t> spent;
  for (size_t i = 0; i < asked.size(); ++i) {
    const ServiceJson& told = batch["models"].at(i);
    all.models[asked[i]] = ModelOf(told);
    all.earlier = all.earlier && told["earlier"] == true;
    if (told["earlier"] != true || !EndedBadly(told["state"])) continue;
    keyed[asked[i]].key = NextKey(keyed[asked[i]].key, told["job"]);
    spent.push_back(asked[i]);
  }
  return spent;
}

}  // namespace

std::string NextKey(const std::string& key, const std::string& spent_id) {
  return "submit-" + Hasher().Add(key).Add(spent_id).Finish().Hex();
}

std::string KeyOfModel(const std::string& again, const ServiceJson& request) {
  return NextKey(again, Sha256(request.dump()).Hex());
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
                         const std::string& again) {
  AskedModels all{
      .models = std::vector<ServiceJson>(requests.size()), .batch = "", .earlier = true, .broke = nullptr};
  std::vector<KeyedRequest> keyed;
  for (const ServiceJson& request : requests) keyed.push_back({request, KeyOfModel(again, request)});
  std::vector<size_t> asked(requests.size());
  std::iota(asked.begin(), asked.end(), size_t(0));
  try {
    while (!asked.empty()) asked = AskOnce(client, keyed, asked, all);
  } catch (const Error& error) {
    if (!IsOneOf<Unavailable, Refused>(error)) throw;
    all.broke = std::current_exception();
    const std::string came_of_it =
        IsOneOf<NoAnswer>(error)
            ? "its files have arrived; whether its model was asked for is not known, and the same command "
              "again finds out: "
            : "its files have arrived; its model could not be asked for: ";
    const ServiceJson failed{{"state", "failed"}, {"error", ProblemOf(came_of_it + error.what())}};
    for (const size_t i : asked) {  // which may have had a job that is spent
      if (all.models[i].is_null()) all.models[i] = ServiceJson::object();
      all.models[i].update(failed);
    }
  }
  all.earlier = all.earlier && !all.batch.empty() && !all.broke;
  return all;
}

bool IsBatch(const std::string& id) { return id.starts_with("bat_"); }
std::string AddressOf(const std::string& id) {
  return (IsBatch(id) ? "/v1/batches/" : "/v1/jobs/") + UrlEncoded(id);
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

std::string CountedWarnings(size_t warnings) {
  if (warnings == 0) return "";
  return std::to_string(warnings) + (warnings == 1 ? " warning" : " warnings");
}

void TellWarnings(const ServiceJson& job, const std::string& about) {
  for (const std::string& warning : WarningsOf(job)) Warn(about + warning);
}

}  // namespace kvx
