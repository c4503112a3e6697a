// Tests of what is made from a model of the hinge, which is built once for all of them.
#pragma once
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/support/fixtures.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program.h"

namespace kvx::testing_support {

class HingeModelTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scratch_ = std::make_unique<ScratchFolder>();
    WriteHingeStudy(scratch_->path());
    const Ended built = Run({"build", At("study.json"), "--out", At("model"), "--quiet"});
    ASSERT_EQ(built.code, 0) << built.err;
  }
  static void TearDownTestSuite() { scratch_.reset(); }
  static std::string At(const std::string& name) { return (scratch_->path() / name).string(); }
  static Ended Run(const std::vector<std::string>& arguments) {
    return RunProgram(scratch_->path(), arguments);
  }
  static void ExpectDone(const std::vector<std::string>& arguments) {
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 0) << arguments[0] << ": " << ended.err;
  }
  inline static std::unique_ptr<ScratchFolder> scratch_;
};

}  // namespace kvx::testing_support
