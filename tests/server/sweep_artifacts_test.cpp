// What a model's document names stays, with how long it took; what none names goes.
#include "server/sweep_artifacts.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <utility>
#include <vector>

#include "pipeline/model/build/step.h"
#include "server/log.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;

TEST(SweepArtifacts, KeepsWhatModelsNameAndItsSeconds) {
  SetLogLevel("off");
  const testing_support::ScratchFolder scratch;
  const DataFolder data(scratch.path());
  const Digest named = Sha256("named"), other = Sha256("other");
  const StageCache cache(data.artifacts());
  for (const Digest& key : {named, SecondsKey(named), other, SecondsKey(other)}) cache.Write(key, "bytes");
  fs::create_directories(scratch.path() / "models/mdl_1");
  std::ofstream(scratch.path() / "models/mdl_1/model.json") << R"({"bones":")" << named.Hex() << R"("})";
  SweepArtifacts(data);
  EXPECT_TRUE(cache.Has(other)) << "nobody wants a sweep";
  WantSweep(data);
  SweepArtifacts(data);
  EXPECT_TRUE(cache.Has(named));
  EXPECT_TRUE(cache.Has(SecondsKey(named)));
  EXPECT_FALSE(cache.Has(other));
  EXPECT_FALSE(cache.Has(SecondsKey(other)));
}

// As where the process may open no further file: what it names is not known, and must not count as unused.
TEST(SweepArtifacts, NothingGoesWhileAModelsDocumentCannotBeRead) {
  SetLogLevel("off");
  const testing_support::ScratchFolder scratch;
  const DataFolder data(scratch.path());
  const StageCache cache(data.artifacts());
  const Digest key = Sha256("of a model that somebody uses");
  cache.Write(key, "bytes");
  const fs::path document = scratch.path() / "models/mdl_1/model.json";
  fs::create_directories(document.parent_path());
  const std::vector<std::pair<const char*, std::function<void()>>> unreadable = {
      {"cannot be opened", [&] { fs::create_symlink("model.json", document); }},
      {"cannot be read", [&] { fs::create_directory(document); }},
      {"is cut off", [&] { std::ofstream(document) << "{\"bones\": \""; }},
      {"is empty", [&] { std::ofstream{document}; }}};
  for (const auto& [what, make] : unreadable) {
    make();
    WantSweep(data);
    SweepArtifacts(data);
    EXPECT_TRUE(cache.Has(key)) << "a document that " << what;
    fs::remove(document);
  }
  SweepArtifacts(data);
  EXPECT_FALSE(cache.Has(key)) << "a model without a document is none; the sweep was still wanted";
}

// Builds would wait for ever for a lock that nobody lets go.
TEST(SweepArtifacts, OneThatFailsLocksNoBuildOut) {
  SetLogLevel("off");
  const testing_support::ScratchFolder scratch;
  const DataFolder data(scratch.path());
  WantSweep(data);
  fs::remove_all(scratch.path() / "models");
  SweepArtifacts(data);
  const int file = ::open((data.artifacts() / "sweep.lock").c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_GE(file, 0);
  EXPECT_EQ(::flock(file, LOCK_SH | LOCK_NB), 0);
  ::close(file);
}

}  // namespace
}  // namespace kvx
