// A whole service but for the pipeline: real storage in a scratch folder, fake ports.
#pragma once
#include "api/handlers/models.h"
#include "api/handlers/subject_uploads.h"
#include "api/handlers/subjects.h"
#include "tests/support/fake_builder.h"
#include "tests/support/fake_inspector.h"
#include "tests/support/fake_poser.h"
#include "tests/support/fixtures.h"

namespace kvx::testing_support {

struct ServiceWorldFolder {
  ScratchFolder scratch;
  int64_t now_ms = 1'000'000;
};

struct ServiceWorld : ServiceWorldFolder, Stores {
  ServiceWorld() : Stores(scratch.path(), {.result_bytes = 1 << 20, .now = [this] { return now_ms; }}) {
    poser.results = scratch.path() / "results";
  }
  FakeInspector inspector;
  FakeBuilder builder;
  FakePoser poser;
  Services services = ServicesOver(*this, inspector, builder, poser, 1 << 20);

  size_t FilesUnder(const std::string& folder) const {
    return testing_support::FilesUnder(scratch.path() / folder);
  }
};

}  // namespace kvx::testing_support
