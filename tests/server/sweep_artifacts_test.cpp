// What a model's document names stays, with how long it took; what none names goes.
#include "server/sweep_artifacts.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <fstream>

#include "pipeline/model/step.h"
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
