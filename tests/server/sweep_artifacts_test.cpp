// What a model's document names stays, with how long it took; what none names goes.
#include "server/sweep_artifacts.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace kvx
