// What handlers work with: storage and ports, put together by server/.
#pragma once
#include "api/ports.h"
#include "storage/blob_store.h"
#include "storage/catalogue.h"
#include "storage/idempotency.h"
#include "storage/job_queue.h"
#include "storage/resumable_uploads.h"
#include "storage/result_cache.h"
#include "storage/webhook_outbox.h"

namespace kvx {

struct Services {
  Catalogue& catalogue;
  JobQueue& jobs;
  Idempotency& idempotency;
  BlobStore& blobs;
  ResultCache& results;
  ScanInspector& inspector;
  ModelBuilder& builder;
  ModelPoser& poser;
  ResumableUploads& resumable;
  WebhookOutbox& webhooks;
  int64_t upload_quota_bytes = int64_t(4) << 30;
};

}  // namespace kvx
