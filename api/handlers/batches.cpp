// A batch is a name on its jobs; each job lives and ends by itself.
#include "api/handlers/batches.h"

#include <algorithm>
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

// One of the models that are asked for.
struct Item {
  RequestKey key;
  std::optional<PreparedModel> model;  // none: it was asked for before, under its key
};

const Json& ModelsOf(const Json& request) {
  const auto models = request.find("models");
  if (models == request.end() || !models->is_array() || models->empty() || models->size() > kMostModels) {
    throw InputError("'models' is a list of 1 to 500 models, each as in POST /v1/models");
  }
  return *models;
}

// One for each model; empty ones where the request has none.
std::vector<std::string> KeysOf(const Json& request, size_t models) {
  const auto keys = request.find("keys");
  if (keys == request.end() || keys->is_null()) return std::vector<std::string>(models);
  const auto is_key = [](const Json& key) {
    return key.is_string() && !key.get_ref<const std::string&>().empty();
  };
  if (!keys->is_array() || keys->size() != models || !std::ranges::all_of(*keys, is_key))
    throw InputError("'keys' has a text of 1 to 255 characters for each of the models");
  return keys->get<std::vector<std::string>>();
}

// Says which of the models is at fault.
Item PrepareItem(Services& services, const Json& model, const std::string& key, size_t index, int priority) {
  const std::string where = "models[" + std::to_string(index) + "]: ";
  if (!model.is_object()) throw InputError(where + "a model is a JSON object");
  try {
    Item item{ModelKey(key, Dump(model)), std::nullopt};
    if (!services.idempotency.Find(item.key)) item.model = PrepareModel(services, model, priority);
    return item;
  } catch (const NotFound& e) {
    throw NotFound(where + e.what());
  } catch (const Conflict& e) {
    throw Conflict(where + e.what());
  } catch (const InputError& e) {
    throw InputError(where + e.what());
  }
}

std::vector<Item> PrepareItems(Services& services, const Json& request) {
  const int priority = PriorityOf(request);
  const Json& models = ModelsOf(request);
  const std::vector<std::string> keys = KeysOf(request, models.size());
  std::vector<Item> items;
  for (size_t i = 0; i < models.size(); ++i)
    items.push_back(PrepareItem(services, models[i], keys[i], i, priority));
  return items;
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
    if (job.subject) item["subject"] = *job.subject;
    if (job.subject_name) item["subject_name"] = *job.subject_name;
    if (job.error) item["error"] = Json::parse(*job.error);
    if (job.result) item["result"] = Json::parse(*job.result);
    json["models"].push_back(item);
  }
  json["counts"] = counts;
  json["progress"] = jobs.empty() ? 1.0 : progress / double(jobs.size());
  return json;
}

// The jobs of the items, in their order: of those that were asked for before the job of then.
std::vector<JobRecord> SubmitItems(Services& services, const std::vector<Item>& items,
                                   const std::optional<std::string>& batch) {
  std::vector<JobRecord> jobs;
  for (const Item& item : items) {
    const Answer answer = services.idempotency.Once(item.key, [&] {
      if (!item.model) throw Conflict("a model that was asked for before was removed just now; ask again");
      return AnswerOf(*item.model, SubmitModel(services, *item.model, batch));
    });
    jobs.push_back(services.jobs.Require(Json::parse(answer.body)["job"].get<std::string>()));
  }
  return jobs;
}

// A new batch is made for new models alone; where there is none, it is the newest batch that one of them is
// of.
BatchRecord BatchFor(Services& services, const std::vector<Item>& items,
                     const std::optional<std::string>& name) {
  const auto is_new = [](const Item& item) { return item.model.has_value(); };
  if (std::ranges::any_of(items, is_new)) return services.catalogue.AddBatch(name);
  std::optional<BatchRecord> newest;
  for (const JobRecord& job : SubmitItems(services, items, std::nullopt)) {
    if (!job.batch) continue;
    const BatchRecord batch = services.catalogue.RequireBatch(*job.batch);
    if (!newest || batch.seq > newest->seq) newest = batch;
  }
  return newest ? *newest : services.catalogue.AddBatch(name);
}

// As GET tells of the batch, but of all models that were asked for, and which of them are another request's.
Json Asked(const BatchRecord& batch, const std::vector<JobRecord>& jobs, const std::vector<Item>& items) {
  Json json = WithJobs(batch, jobs);
  for (size_t i = 0; i < jobs.size(); ++i) {
    json["models"][i]["batch"] = jobs[i].batch ? Json(*jobs[i].batch) : Json();
    json["models"][i]["earlier"] = !items[i].model || items[i].model->id != jobs[i].model;
  }
  return json;
}

}  // namespace

Answer CreateBatch(Services& services, const std::string& body, const std::string& idempotency_key) {
  const RequestKey key = KeyOf("POST /v1/batches", idempotency_key, {body});
  if (auto answer = services.idempotency.Find(key)) return *answer;
  const Json request = ParseBody(body);
  RequireFields(request, {"models", "keys", "name", "priority"}, "a batch");
  const std::optional<std::string> name = NameOf(request);
  const std::vector<Item> items = PrepareItems(services, request);
  const Answer answer = services.idempotency.Once(key, [&]() -> Answer {
    const BatchRecord batch = BatchFor(services, items, name);
    const std::vector<JobRecord> jobs = SubmitItems(services, items, batch.id);
    return {202, "/v1/batches/" + batch.id, Dump(Asked(batch, jobs, items))};
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
