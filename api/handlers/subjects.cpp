// POST /v1/subjects {name?, region, external_id?}
#include "api/handlers/subjects.h"

#include <nlohmann/json.hpp>

#include "api/views.h"
#include "core/errors.h"
#include "core/name.h"
#include "core/region_presets.h"

namespace kvx {
namespace {

std::optional<std::string> OptionalText(const Json& json, const std::string& field) {
  const auto found = json.find(field);
  if (found == json.end() || found->is_null()) return std::nullopt;
  if (!found->is_string() || !IsTitle(found->get_ref<const std::string&>()))
    throw InputError("'" + field + "' is a text of at most 256 bytes, without line breaks and the like");
  return found->get<std::string>();
}

NewSubject ParseSubject(const std::string& body) {
  const Json json = ParseBody(body);
  RequireFields(json, {"name", "region", "external_id"}, "a subject");
  const std::string region = OptionalText(json, "region").value_or("");
  RegionFromName(region);
  const auto external_id = OptionalText(json, "external_id");
  if (external_id == "") throw InputError("'external_id' is empty; leave it out where the subject has none");
  return {OptionalText(json, "name"), region, external_id};
}

}  // namespace

Answer CreateSubject(Services& services, const std::string& body, const std::string& idempotency_key) {
  const NewSubject wanted = ParseSubject(body);
  return services.idempotency.Once(KeyOf("POST /v1/subjects", idempotency_key, {body}), [&]() -> Answer {
    const SubjectRecord subject = services.catalogue.AddSubject(wanted);
    return {201, "/v1/subjects/" + subject.id, Dump(View(subject))};
  });
}

std::string ListSubjects(Services& services, const Query& query) {
  const PageRequest page = ParsePage(query, "external_id");
  return Dump(PageView(services.catalogue.Subjects(page, QueryText(query, "external_id"))));
}

void RemoveModelBytes(Services& services, const std::string& model) {
  services.results.DropOf(model + ".");
  services.poser.Forget(model);
}

void DeleteSubject(Services& services, const std::string& id, const std::string& who,
                   const std::string& project) {
  services.catalogue.RequireSubject(id);
  services.retention.DeleteSubject(id, who, project);
  services.retention.RemoveBytes([&](const std::string& model) { RemoveModelBytes(services, model); });
  services.poser.Sweep();  // once for all: it looks at the models of all subjects
}

std::string GetSubject(Services& services, const std::string& id) {
  return Dump(View(services.catalogue.RequireSubject(id)));
}

}  // namespace kvx
