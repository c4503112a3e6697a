// What is damaged or lost on either side of a backup.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "storage/backup.h"
#include "storage/database/sqlite.h"
#include "tests/support/backed_up.h"

namespace kvx {
namespace {
using namespace testing_support;

// A series is a folder: its name tells of all its files.
class BackupOfASeries : public Backup {
 protected:
  BackupOfASeries() {
    Stores stores(data(), {});
    IncomingFolder folder = stores.blobs.ReceiveFolder();
    for (const char* name : {"0001.dcm", "0002.dcm"}) Write(folder.path() / name, "SLICE");
    const std::string content = stores.blobs.KeepFolder(std::move(folder));
    stores.catalogue.AddScan(subject, "pose01", {content, content, ".zip", 10, "{}"});
    slice = fs::path("blobs") / content.substr(0, 2) / content / "0002.dcm";
  }
  fs::path slice;
};

TEST_F(BackupOfASeries, WithADamagedOrAMissingFileIsNotRestored) {
  BackUp(data(), copy());
  Write(copy() / slice, "SLICX");
  EXPECT_THROW(Restore(copy(), scratch.path() / "new"), InputError);
  fs::remove(copy() / slice);
  EXPECT_THROW(Restore(copy(), scratch.path() / "new"), InputError);
  EXPECT_EQ(BackUp(data(), copy()).files, 1) << "what went is copied again";
  EXPECT_NO_THROW(Restore(copy(), scratch.path() / "new"));
}

TEST_F(BackupOfASeries, WithADamagedFileDoesNotReplaceItsGoodCopy) {
  BackUp(data(), copy());
  for (const char* damaged : {"SL", "SLICX"}) {
    std::ofstream(data() / slice) << damaged;
    for (const auto before : {CopiedBefore::kTrusted, CopiedBefore::kChecked})
      EXPECT_TRUE(BackUp(data(), copy(), before).lost.empty());
    EXPECT_EQ(Content(copy() / slice), "SLICE") << damaged;
  }
}

TEST_F(Backup, WhatTheDataFolderLostStaysInTheCopy) {
  BackUp(data(), copy());
  fs::remove(data() / upload);
  EXPECT_TRUE(BackUp(data(), copy()).lost.empty());
  EXPECT_EQ(Content(copy() / upload), "VOXELS");
  EXPECT_NO_THROW(Restore(copy(), scratch.path() / "new"));
}

TEST_F(Backup, WhatNeitherSideHasIsNamedAndAllElseIsCopied) {
  const auto lost = [&] { return testing::ElementsAre(scan); };
  for (const bool there : {true, false}) {
    if (there)
      Write(data() / upload, "VOXELX");
    else
      fs::remove(data() / upload);
    const BackupFigures figures = BackUp(data(), copy());
    EXPECT_THAT(figures.lost, lost());
    EXPECT_EQ(figures.files, 0);
    EXPECT_FALSE(fs::exists(copy() / upload));
  }
  EXPECT_THAT([&] { Restore(copy(), scratch.path() / "new"); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr(scan)));
  EXPECT_THAT(Restore(copy(), scratch.path() / "rest", Lost::kLeftOut).lost, lost());
  EXPECT_EQ(Stores(scratch.path() / "rest", {}).catalogue.RequireScan(scan).name, "pose00");
  Write(data() / upload, "VOXELS");
  EXPECT_TRUE(BackUp(data(), copy()).lost.empty());
  EXPECT_NO_THROW(Restore(copy(), scratch.path() / "new"));
}

TEST_F(Backup, AModelWhoseFilesAreLostIsNamed) {
  const std::string model = NewId("mdl");
  {
    Stores stores(data(), {});
    stores.catalogue.AddModel({.id = model, .subject = subject, .template_scan = scan, .request = "{}"});
    stores.catalogue.SetModelDigest(model, "digest");
  }
  EXPECT_THAT(BackUp(data(), copy()).lost, testing::ElementsAre(model));
  Write(data() / "models" / model / "model.json", "{}");
  EXPECT_TRUE(BackUp(data(), copy()).lost.empty());
}

TEST_F(Backup, AnUploadThatMayNotBeReadIsNotCalledDamaged) {
  BackUp(data(), copy());
  for (const fs::path& closed : {copy() / upload, (copy() / upload).parent_path(), copy()}) {
    fs::permissions(closed, fs::perms::none);
    EXPECT_THAT(Denial([&] { Restore(copy(), scratch.path() / "new"); }),
                testing::HasSubstr("may not be read"));
    fs::permissions(closed, fs::perms::owner_all);
  }
}

TEST_F(Backup, AFileThatIsCutOffIsCopiedAnew) {
  BackUp(data(), copy());
  std::ofstream(copy() / upload) << "VOX";
  EXPECT_THROW(Restore(copy(), scratch.path() / "new"), InputError);
  BackUp(data(), copy());
  EXPECT_EQ(Content(copy() / upload), "VOXELS");
}

TEST_F(Backup, OtherBytesOfTheSameSizeAreFoundByACheck) {
  BackUp(data(), copy());
  std::ofstream(copy() / upload) << "VOXELX";
  BackUp(data(), copy());
  EXPECT_EQ(Content(copy() / upload), "VOXELX");
  EXPECT_EQ(BackUp(data(), copy(), CopiedBefore::kChecked).files, 1);
  EXPECT_EQ(Content(copy() / upload), "VOXELS");
}

TEST_F(Backup, ADamagedUploadDoesNotReplaceItsGoodCopy) {
  BackUp(data(), copy());
  for (const char* damaged : {"VOX", "VOXELX"}) {
    std::ofstream(data() / upload) << damaged;
    BackUp(data(), copy(), CopiedBefore::kChecked);
    EXPECT_EQ(Content(copy() / upload), "VOXELS") << damaged;
  }
}

TEST_F(Backup, WhichSideFailedIsTold) {
  const auto back_up = [&] { BackUp(data(), copy()); };
  const fs::path blob = data() / upload;
  for (const fs::path& closed : {blob, blob.parent_path()}) {
    fs::permissions(closed, fs::perms::none);
    EXPECT_THAT(Denial(back_up), testing::HasSubstr("what is copied cannot be read"));
    fs::permissions(closed, fs::perms::owner_all);
  }
  fs::create_directories(copy() / upload.parent_path());
  Write(copy() / "kinevox-backup", "");
  fs::permissions(copy() / upload.parent_path(), fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_THAT(Denial(back_up), testing::HasSubstr("copy cannot be written"));
  fs::permissions(copy() / upload.parent_path(), fs::perms::owner_all);
  back_up();
}

TEST_F(Backup, ACopyThatCannotBeReadIsMadeAnew) {
  BackUp(data(), copy());
  fs::permissions(copy() / upload, fs::perms::none);
  EXPECT_EQ(Denial([&] { EXPECT_EQ(BackUp(data(), copy(), CopiedBefore::kChecked).files, 1); }), "none");
  EXPECT_EQ(Content(copy() / upload), "VOXELS");
}

}  // namespace
}  // namespace kvx
