// What handlers work with: storage and ports, put together by server/.
#pragma once
#include <functional>
#include <memory>

#include "api/ports.h"
#include "core/host/asker.h"
#include "storage/stores.h"

namespace kvx {

struct Services {
  Catalogue& catalogue;
  JobQueue& jobs;
  Idempotency& idempotency;
  BlobStore& blobs;
  ResultCache& results;
  AuditTrail& audit;
  ApiKeys& keys;
  Retention& retention;
  ScanInspector& inspector;
  ModelBuilder& builder;
  ModelPoser& poser;
  ResumableUploads& resumable;
  WebhookOutbox& webhooks;
  int64_t upload_quota_bytes = int64_t(4) << 30;
  std::string project{};              // whose records these are; empty: all
  std::function<bool()> abandoned{};  // of the request that asks for something, as in Asker
  // Waited for and held while an upload that is kept is read whole; throws Unavailable when too many wait.
  std::function<std::shared_ptr<void>()> reading_turn = [] { return nullptr; };
  // Whether the disk keeps its reserve when so many bytes more come. Without it no job is begun, and nothing
  // that is kept is taken.
  std::function<bool(int64_t more_bytes)> has_room = [](int64_t) { return true; };

  Asker asker() const { return {project, abandoned}; }
};

inline Services ServicesOver(Stores& stores, ScanInspector& inspector, ModelBuilder& builder,
                             ModelPoser& poser, int64_t upload_quota_bytes = int64_t(4) << 30) {
  return {.catalogue = stores.catalogue,
          .jobs = stores.jobs,
          .idempotency = stores.idempotency,
          .blobs = stores.blobs,
          .results = stores.results,
          .audit = stores.audit,
          .keys = stores.keys,
          .retention = stores.retention,
          .inspector = inspector,
          .builder = builder,
          .poser = poser,
          .resumable = stores.resumable,
          .webhooks = stores.webhooks,
          .upload_quota_bytes = upload_quota_bytes,
          .has_room = stores.has_room};
}

// The services as one project sees them: records of others are not there.
class ProjectServices {
 public:
  ProjectServices(const Services& all, const std::string& project)
      : catalogue_(all.catalogue.ForProject(project)),
        jobs_(all.jobs.ForProject(project)),
        idempotency_(all.idempotency.ForProject(project)),
        audit_(all.audit.ForProject(project)),
        webhooks_(all.webhooks.ForProject(project)),
        services{.catalogue = catalogue_,
                 .jobs = jobs_,
                 .idempotency = idempotency_,
                 .blobs = all.blobs,
                 .results = all.results,
                 .audit = audit_,
                 .keys = all.keys,
                 .retention = all.retention,
                 .inspector = all.inspector,
                 .builder = all.builder,
                 .poser = all.poser,
                 .resumable = all.resumable,
                 .webhooks = webhooks_,
                 .upload_quota_bytes = all.upload_quota_bytes,
                 .project = project,
                 .has_room = all.has_room} {}
  ProjectServices(const ProjectServices&) = delete;
  ProjectServices& operator=(const ProjectServices&) = delete;

 private:
  Catalogue catalogue_;
  JobQueue jobs_;
  Idempotency idempotency_;
  AuditTrail audit_;
  WebhookOutbox webhooks_;

 public:
  Services services;
};

}  // namespace kvx
