// The hinge study and one model of it, for all tests of a suite.
#pragma once
#include <gtest/gtest.h>

#include "pipeline/model/build/build_model.h"
#include "pipeline/model/files/study_file.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_study.h"

namespace kvx::testing_support {

class BuiltHinge : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scratch_ = new ScratchFolder;
    study_ = new Study(ReadStudy(WriteHingeStudy(scratch_->path())));
    BuildModel(*study_, {}, ModelPath(), {}, SharedBackend(), {});
    model_ = new Model(Model::Load(ModelPath()));
  }
  static void TearDownTestSuite() {
    delete model_;
    delete study_;
    delete scratch_;
  }
  static std::filesystem::path ModelPath() { return scratch_->path() / "model"; }

  inline static ScratchFolder* scratch_ = nullptr;
  inline static Study* study_ = nullptr;
  inline static Model* model_ = nullptr;
};

}  // namespace kvx::testing_support
