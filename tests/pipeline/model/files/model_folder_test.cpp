// What a build may write into, and what it leaves alone.
#include "pipeline/model/files/model_folder.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

class ModelFolder : public testing::Test {
 protected:
  void Put(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  bool Takes(const std::string& stages = "artifacts") {
    try {
      MakeModelFolder(folder_, stages);
      return true;
    } catch (const InputError&) {
      return false;
    }
  }
  testing_support::ScratchFolder scratch_;
  const std::filesystem::path folder_ = scratch_.path() / "knee.model";
  const std::string document_ = R"({"kind": "kinevox-model"})";
};

TEST_F(ModelFolder, IsMadeWhereNothingIs) {
  EXPECT_TRUE(Takes());
  EXPECT_TRUE(std::filesystem::is_directory(folder_));
}

TEST_F(ModelFolder, WithOtherThingsThatNoBuildLeftIsRefused) {
  Put("thesis.docx", "text");
  EXPECT_FALSE(Takes());
  Put("artifacts/ab/cd.kva", "stage");
  EXPECT_FALSE(Takes());
}

TEST_F(ModelFolder, OfAnotherProgramsDocumentIsRefused) {
  Put("model.json", R"({"kind": "something else"})");
  EXPECT_FALSE(Takes());
}

// A posed volume, written beside the document, is no reason to build elsewhere from the beginning.
TEST_F(ModelFolder, OfAWholeModelMayHoldWhatTheUserPutThere) {
  Put("model.json", document_);
  Put("artifacts/ab/cd.kva", "stage");
  Put("bent.nii.gz", "posed");
  EXPECT_TRUE(Takes());
}

TEST_F(ModelFolder, OfADamagedModelIsTakenWithItsStagesAlone) {
  Put("model.json", document_.substr(0, 9));
  EXPECT_FALSE(Takes());
  Put("artifacts/ab/cd.kva", "stage");
  EXPECT_TRUE(Takes());
  Put("bent.nii.gz", "posed");
  EXPECT_FALSE(Takes());
}

// As a mount of a container leaves one.
TEST_F(ModelFolder, WhoseDocumentIsAFolderIsRefused) {
  Put("model.json/file", "text");
  Put("artifacts/ab/cd.kva", "stage");
  EXPECT_FALSE(Takes());
}

// A build that was killed goes on, whatever its stages' folder is called.
TEST_F(ModelFolder, OfAKilledBuildHoldsStagesUnderTheNameThatWasAskedFor) {
  Put("stages/all/ab/cd.kva", "stage");
  EXPECT_FALSE(Takes());
  EXPECT_TRUE(Takes("stages/all"));
}

}  // namespace
}  // namespace kvx
