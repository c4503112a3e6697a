// A step makes its artefact once, finds it again, and makes it anew when the file is damaged.
#include "pipeline/model/build/step.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>

#include "core/host/parallel.h"
#include "kernels/device/device_buffer.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

std::atomic<int> runs = 0;

struct Double {
  static constexpr std::string_view kName = "double";
  static constexpr int kVersion = 1;
  struct Inputs {
    const Artifact<double>& number;
    std::vector<Digest> Keys() const { return {number.key}; }
  };
  using Options = NoOptions;
  using Output = double;
  static Output Run(const Inputs& inputs, const Options&, StageContext& context) {
    context.progress.Report(kName, 0.5);
    ++runs;
    return 2 * *inputs.number;
  }
};

class StepTest : public testing::Test {
 protected:
  void SetUp() override { runs = 0; }
  Step<Double> MakeStep() {
    return Step<Double>(cache_, testing_support::SharedBackend(), Double::Inputs{number_}, NoOptions{},
                        [this] { number_.value = std::make_shared<double>(21); });
  }
  testing_support::ScratchFolder scratch_;
  StageCache cache_{scratch_.path() / "artifacts"};
  Artifact<double> number_{Sha256("21"), nullptr};
};

TEST_F(StepTest, FindsWhatAnEarlierBuildMadeWithoutItsInputs) {
  EXPECT_EQ(MakeStep().Load(), 42);
  number_.value.reset();
  Step<Double> again = MakeStep();
  again.Make({});
  EXPECT_EQ(again.Load(), 42);
  EXPECT_EQ(runs, 1);
  EXPECT_FALSE(number_.value) << "inputs of a finished stage were loaded";
}

TEST_F(StepTest, RemembersWhatTheArtefactCost) {
  MakeStep().Make({});
  const double seconds = MakeStep().Seconds();
  EXPECT_GT(seconds, 0);
  MakeStep().Make({});
  EXPECT_EQ(MakeStep().Seconds(), seconds);
}

TEST_F(StepTest, TwoThatNeedItAtOnceMakeItOnce) {
  Step<Double> step = MakeStep();
  for (int time = 0; time < 20; ++time) {
    double first = 0, second = 0;
    SideBySide([&] { first = step.Load(); }, [&] { second = step.Load(); });
    EXPECT_EQ(first, 42);
    EXPECT_EQ(second, 42);
    step.Release();
  }
  EXPECT_EQ(runs, 1);
}

// For the build that looks for races.
TEST_F(StepTest, ItsKeyIsReadWhileItIsMade) {
  Step<Double> step = MakeStep();
  const Digest key = step.key();
  bool same = true;
  SideBySide([&] { step.Load(); },
             [&] {
               for (int time = 0; time < 1000; ++time) same = same && step.artifact().key == key;
             });
  EXPECT_TRUE(same);
}

TEST_F(StepTest, ADamagedArtefactIsMadeAgain) {
  MakeStep().Make({});
  const std::string hex = MakeStep().key().Hex();
  const auto file = cache_.folder() / hex.substr(0, 2) / (hex + ".kva");
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 1);
  EXPECT_FALSE(cache_.Intact(MakeStep().key()));
  MakeStep().Make({});
  EXPECT_EQ(runs, 2);
  EXPECT_TRUE(cache_.Intact(MakeStep().key()));
  EXPECT_EQ(MakeStep().Load(), 42);
}

// Of a device that has no room for what it asks.
struct AskForTooMuch {
  static constexpr std::string_view kName = "too much";
  static constexpr int kVersion = 1;
  using Inputs = Double::Inputs;
  using Options = NoOptions;
  using Output = double;
  static Output Run(const Inputs&, const Options&, StageContext& context) {
    DeviceBuffer<double> all(context.backend, size_t(1) << 55);
    all.Fill(context.backend.queue(), 1.0);  // some devices give memory no sooner than it is used
    context.backend.queue().finish();
    return double(all.size());
  }
};

TEST_F(StepTest, ADeviceWithoutMemorySaysWhatToDo) {
  Step<AskForTooMuch> step(cache_, testing_support::SharedBackend(), {number_}, {}, [] {});
  try {
    step.Make({});
    FAIL() << "there was room";
  } catch (const Unavailable& failure) {
    EXPECT_THAT(failure.what(), testing::HasSubstr("too little free memory"));
    EXPECT_THAT(failure.what(), testing::HasSubstr("choose another device"));
  }
}

TEST_F(StepTest, CancelledWorkLeavesNothing) {
  int asked = 0;
  const Progress progress({}, [&] { return ++asked > 2; });
  EXPECT_THROW(MakeStep().Make(progress), Cancelled);
  EXPECT_FALSE(cache_.Has(MakeStep().key()));
}

TEST_F(StepTest, ReportsUnderTheNameItIsGiven) {
  std::vector<std::string> names;
  const Progress whole([&](std::string_view name, double) { names.emplace_back(name); }, {});
  MakeStep().Make(Named(whole.Part(0, 0.5), "double pose01"));
  ASSERT_FALSE(names.empty());
  for (const std::string& name : names) EXPECT_EQ(name, "double pose01");
}

TEST(Named, ASilentViewStopsAsTheWholeDoes) {
  bool stop = false;
  const Progress named = Named(Progress({}, [&] { return stop; }), "register_bones pose01");
  EXPECT_NO_THROW(named.Silent().ThrowIfCancelled());
  stop = true;
  EXPECT_THROW(named.Silent().ThrowIfCancelled(), Cancelled);
  EXPECT_THROW(named.ThrowIfCancelled(), Cancelled);
}

}  // namespace
}  // namespace kvx
