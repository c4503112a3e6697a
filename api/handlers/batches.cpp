// A batch is a name on its jobs; each job lives and ends by itself.
#include "api/handlers/batches.h"

#include <nlohmann/json.hpp>

#include "api/handlers/models.h"
#include "api/views.h"
#include "core/errors.h"

namespace kvx {
namespace {

constexpr size_t kMostModels = 500;

std::optional<std::string> NameOf(const Json& request) {
  if (!request.contains("name") || request["name"].is_null()) return std::nullopt;
  if (!request["name"].is_string() || request["name"].get_ref<const std::string&>().size() > 256) {
    throw InputError("'name' is a text of at most 256 bytes");
  }
  return request["name"].get<std::string>();
}

// Says which of the models is at fault.
PreparedModel PrepareItem(Services& services, const Json& item, size_t index, int priority) {
  const std::string where = "models[" + std::to_string(index) + "]: ";
  if (!item.is_object()) throw InputError(where + "a model is a JSON object");
  try {
    return PrepareModel(services, item, priority);
  } catch (const NotFound& e) {
    throw NotFound(where + e.what());
  } catch (const InputError& e) {
    throw InputError(where + e.what());
  }
}

Json WithJobs(const BatchRecord& batch, const std::vector<JobRecord>& jobs) {
  Json json = View(batch);
  Json counts{{"queued", 0}, {"running", 0}, {"succeeded", 0}, {"failed", 0}, {"cancelled", 0}};
  double progress = 0;
  json["ended"] = true;
  json["models"] = Json::array();
  for (const JobRecord& job : jobs) {
    counts[job.state] = counts[job.state].get<int>() + 1;
    progress += job.Ended() ? 1.0 : job.progress;
    if (!job.Ended()) json["ended"] = false;
    Json item{{"id", job.model},
              {"job", job.id},
              {"state", job.state},
              {"stage", job.stage},
              {"progress", job.progress}};
    if (job.error) item["error"] = Json::parse(*job.error);
    if (job.result) item["result"] = Json::parse(*job.result);
    json["models"].push_back(item);
  }
  json["counts"] = counts;
  json["progress"] = jobs.empty() ? 1.0 : progress / double(jobs.size());
  return json;
}

}  // namespace

Answer CreateBatch(Services& services, const std::string& body, const std::string& idempotency_key) {
  const RequestKey key = KeyOf("POST /v1/batches", idempotency_key, {body});
  if (auto answer = services.idempotency.Find(key)) return *answer;
  const Json request = ParseBody(body);
  RequireFields(request, {"models", "name", "priority"}, "a batch");
  const std::optional<std::string> name = NameOf(request);
  const int priority = PriorityOf(request);
  const auto models = request.find("models");
  if (models == request.end() || !models->is_array() || models->empty() || models->size() > kMostModels) {
    throw InputError("'models' is a list of 1 to 500 models, each as in POST /v1/models");
  }
  std::vector<PreparedModel> prepared;
  for (const Json& item : *models) prepared.push_back(PrepareItem(services, item, prepared.size(), priority));
  const Answer answer = services.idempotency.Once(key, [&]() -> Answer {
    const BatchRecord batch = services.catalogue.AddBatch(name);
    for (const PreparedModel& model : prepared) SubmitModel(services, model, batch.id);
    return {202, "/v1/batches/" + batch.id, Dump(WithJobs(batch, services.jobs.OfBatch(batch.id)))};
  });
  services.jobs.WakeAll();
  return answer;
}

std::string ListBatches(Services& services, const Query& query) {
  return Dump(PageView(services.catalogue.Batches(ParsePage(query))));
}

std::string GetBatch(Services& services, const std::string& id) {
  return Dump(WithJobs(services.catalogue.RequireBatch(id), services.jobs.OfBatch(id)));
}

std::string CancelBatch(Services& services, const std::string& id) {
  const BatchRecord batch = services.catalogue.RequireBatch(id);
  int asked = 0;
  for (const JobRecord& job : services.jobs.OfBatch(id)) {
    try {
      services.jobs.Cancel(job.id);
      ++asked;
    } catch (const Conflict&) {  // it has ended meanwhile
    }
  }
  if (asked == 0) throw Conflict("all jobs of the batch have ended already");
  return Dump(WithJobs(batch, services.jobs.OfBatch(id)));
}

}  // namespace kvx
