// All of storage/ over one data folder, put together in the order of need.
#pragma once
#include "storage/api_keys.h"
#include "storage/audit.h"
#include "storage/catalogue.h"
#include "storage/database/database.h"
#include "storage/files/blob_store.h"
#include "storage/files/data_folder.h"
#include "storage/files/result_cache.h"
#include "storage/idempotency.h"
#include "storage/ids.h"
#include "storage/job_queue.h"
#include "storage/resumable_uploads.h"
#include "storage/retention.h"
#include "storage/webhook_outbox.h"

namespace kvx {

struct StoresOptions {
  DataFolder::Use use = DataFolder::Use::kService;
  int64_t lease_ms = 15'000;
  int64_t memory_bytes = 0;  // that running jobs may declare together; 0: any
  int64_t result_bytes = int64_t(1) << 30;
  uintmax_t least_free_bytes = 0;  // of the disk
  ClockMs now = SystemClockMs;     // of records
};

struct Stores {
  // Throws what DataFolder and Database throw.
  Stores(const std::filesystem::path& folder, const StoresOptions& options)
      : data(folder, options.use),
        database(data.database(), options.now),
        jobs(database, options.lease_ms),
        blobs(data.root(), data.alone()),
        has_room(
            [this, least = options.least_free_bytes](int64_t more) { return data.HasRoom(least, more); }),
        results(options.use == DataFolder::Use::kService ? data.results() : data.work() / NewId("res"),
                options.result_bytes, ResultCache::kMemoryBytes, has_room) {
    if (options.memory_bytes > 0) jobs.set_memory_budget(options.memory_bytes);
  }

  DataFolder data;
  Database database;
  Catalogue catalogue{database};
  JobQueue jobs;
  Idempotency idempotency{database};
  AuditTrail audit{database};
  ApiKeys keys{database};
  BlobStore blobs;
  Retention retention{database, blobs, audit, data.uploads()};
  ResultCache::HasRoom has_room;
  ResultCache results;  // a worker's own go with it
  ResumableUploads resumable{database, data.uploads()};
  WebhookOutbox webhooks{database};
};

}  // namespace kvx
