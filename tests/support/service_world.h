// A whole service but for the pipeline: real storage in a scratch folder, fake ports.
#pragma once
#include "api/handlers/models.h"
#include "api/handlers/subjects.h"
#include "api/handlers/uploads.h"
#include "tests/support/fake_ports.h"
#include "tests/support/fixtures.h"

namespace kvx::testing_support {

struct ServiceWorld {
  ServiceWorld() { poser.results = scratch.path() / "results"; }
  ScratchFolder scratch;
  int64_t now_ms = 1'000'000;
  Database database{scratch.path() / "test.db", [this] { return now_ms; }};
  Catalogue catalogue{database};
  JobQueue jobs{database, 15'000};
  Idempotency idempotency{database};
  AuditTrail audit{database};
  ApiKeys keys{database};
  BlobStore blobs{scratch.path()};
  Retention retention{database, blobs, audit, scratch.path() / "uploads"};
  ResultCache results{scratch.path() / "results", 1 << 20};
  FakeInspector inspector;
  FakeBuilder builder;
  FakePoser poser;
  ResumableUploads resumable{database, scratch.path() / "uploads"};
  WebhookOutbox webhooks{database};
  Services services{catalogue, jobs, idempotency, blobs, results, audit, keys, retention, inspector,
                    builder, poser, resumable, webhooks, 1 << 20};

  size_t FilesUnder(const std::string& folder) const {
    size_t count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(scratch.path() / folder)) {
      count += entry.is_regular_file();
    }
    return count;
  }
};

}  // namespace kvx::testing_support
