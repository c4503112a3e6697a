// A backup removes what it made itself, goes where nothing else is, and mends what was damaged in it.
#include "storage/backup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <utility>

#include "core/errors.h"
#include "storage/database/sqlite.h"
#include "storage/stores.h"
#include "tests/support/backed_up.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
using namespace testing_support;

// The records that were copied name its upload still: what they name stays until the next backup.
TEST_F(Backup, ASubjectThatIsRemovedMeanwhileDoesNotSpoilIt) {
  BackUp(data(), copy());
  bool removed = false;
  const auto remove_once = [&](std::string_view, double) {
    if (!std::exchange(removed, true)) RemoveSubject();
  };
  BackUp(data(), copy(), CopiedBefore::kTrusted, Progress(remove_once, {}));
  ASSERT_TRUE(removed);
  EXPECT_TRUE(fs::exists(copy() / upload));
  const fs::path restored = scratch.path() / "restored";
  Restore(copy(), restored);
  EXPECT_EQ(Content(restored / upload), "VOXELS");
  BackUp(data(), copy());
  EXPECT_FALSE(fs::exists(copy() / upload));
}

// As where the data folder's disk was not mounted, and a service made a new one in its place.
TEST_F(Backup, AnEmptyDataFolderDoesNotReplaceAnother) {
  {
    Stores stores(data(), {});
    const std::string other = stores.catalogue.AddSubject({"John Doe", "knee", {}}).id;
    stores.retention.DeleteSubject(other, "-", "default");  // the trail has an entry
  }
  BackUp(data(), copy());
  const fs::path empty = scratch.path() / "empty";
  { const Stores stores(empty, {}); }
  EXPECT_THROW(BackUp(empty, copy()), InputError);
  EXPECT_TRUE(fs::exists(copy() / upload));
  RemoveSubject();
  EXPECT_NO_THROW(BackUp(data(), copy())) << "its own trail has grown";
}

TEST_F(Backup, FoldersOfOtherThingsStayAsTheyAre) {
  const fs::path thesis = copy() / "models" / "knee-a" / "thesis.txt";
  Write(thesis, "thesis");
  EXPECT_THROW(BackUp(data(), copy()), InputError);
  EXPECT_EQ(Content(thesis), "thesis");
  EXPECT_EQ(std::distance(fs::recursive_directory_iterator(copy()), {}), 3) << "nothing was put there";
}

TEST_F(Backup, AnotherServicesDataFolderStaysAsItIs) {
  std::string other;
  {
    Stores stores(copy(), {});
    other = stores.catalogue.AddSubject({"John Doe", "knee", {}}).id;
    EXPECT_THROW(BackUp(data(), copy()), InputError) << "while it runs";
  }
  EXPECT_THROW(BackUp(data(), copy()), InputError);
  EXPECT_NO_THROW(Stores(copy(), {}).catalogue.RequireSubject(other));
}

TEST_F(Backup, WhatWasRestoredOrServedIsADataFolder) {
  BackUp(data(), copy());
  const fs::path restored = scratch.path() / "restored";
  Restore(copy(), restored);
  EXPECT_THROW(BackUp(data(), restored), InputError);
  { const Stores served(copy(), {}); }
  EXPECT_THROW(BackUp(data(), copy()), InputError);
}

TEST_F(Backup, OthersThingsInABackupStayWhereRemovedUploadsGo) {
  BackUp(data(), copy());
  ASSERT_TRUE(fs::exists(copy() / upload));
  const fs::path notes[] = {copy() / "models" / "notes.txt", copy() / "blobs" / "aa" / "notes.txt",
                            copy() / "artifacts" / "notes" / "a" / "b.copying"};
  for (const fs::path& note : notes) Write(note, "note");
  RemoveSubject();
  BackUp(data(), copy());
  EXPECT_FALSE(fs::exists(copy() / upload));
  for (const fs::path& note : notes) EXPECT_EQ(Content(note), "note") << note;
}

// Half an upload is in no copy, so its record is not either; one that has ended says still what it became.
TEST_F(Backup, AnUnfinishedUploadEndsWithTheFolderItWasIn) {
  std::string half, whole;
  {
    Stores stores(data(), {});
    const auto send = [&](const char* bytes) {
      const std::string id = stores.resumable
                                 .Create({.subject = subject,
                                          .kind = "scan",
                                          .parameters = "{}",
                                          .length = 6,
                                          .metadata = "filename Jane Roe.nii"})
                                 .id;
      const auto writer = stores.resumable.Continue(id);
      writer->Write(std::string_view(bytes));
      writer->Keep();
      if (writer->Complete()) writer->Finish("/v1/there");
      return id;
    };
    half = send("VOX"), whole = send("VOXELS");
  }
  BackUp(data(), copy());
  EXPECT_EQ(Content(copy() / kDatabaseFile).find(half), std::string::npos) << "it is overwritten";
  const fs::path restored = scratch.path() / "restored";
  Restore(copy(), restored);
  Stores stores(restored, {});
  EXPECT_THROW(stores.resumable.Require(half), NotFound);
  EXPECT_EQ(stores.resumable.Require(whole).location, "/v1/there");
  EXPECT_EQ(Stores(data(), {}).resumable.Require(half).received, 3) << "where it came from it goes on";
}

// Ctrl-C between two files.
TEST_F(Backup, ThatIsStoppedLeavesTheOneBeforeItWhole) {
  BackUp(data(), copy());
  const std::string records = Content(copy() / kDatabaseFile);
  {
    Stores stores(data(), {});
    IncomingFolder folder = stores.blobs.ReceiveFolder();
    Write(folder.path() / "0001.dcm", "SLICE");
    const std::string content = stores.blobs.KeepFolder(std::move(folder));
    stores.catalogue.AddScan(subject, "pose01", {content, content, ".zip", 5, "{}"});
  }
  std::vector<double> told;
  const Progress stopped([&](std::string_view, double fraction) { told.push_back(fraction); },
                         [&] { return !told.empty(); });
  EXPECT_THROW(BackUp(data(), copy(), CopiedBefore::kTrusted, stopped), Cancelled);
  EXPECT_EQ(told, std::vector<double>{0});
  EXPECT_EQ(Content(copy() / kDatabaseFile), records);
  EXPECT_NO_THROW(Restore(copy(), scratch.path() / "new"));
}

// All of a large one is read before anything is copied.
TEST_F(Backup, IsNotReadForAFolderThatHoldsOtherThings) {
  BackUp(data(), copy());
  Write(scratch.path() / "new" / "thesis.txt", "thesis");
  int told = 0;
  const Progress counted([&](std::string_view, double) { ++told; }, {});
  EXPECT_THROW(Restore(copy(), scratch.path() / "new", Lost::kRefused, counted), InputError);
  EXPECT_EQ(told, 0);
}

TEST_F(Backup, IsNotReadForAPlaceThatMayNotBeWritten) {
  BackUp(data(), copy());
  int told = 0;
  const Progress counted([&](std::string_view, double) { ++told; }, {});
  const fs::path locked = scratch.path() / "locked";
  fs::create_directory(locked);
  fs::permissions(locked, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_THAT(Denial([&] { Restore(copy(), locked / "new", Lost::kRefused, counted); }),
              testing::HasSubstr("the data folder may not"));
  EXPECT_THAT(Denial([&] { Restore(copy(), locked, Lost::kRefused, counted); }),
              testing::HasSubstr("the data folder may not"));
  Write(scratch.path() / "file", "text");
  for (const char* place : {"file", "file/new"}) {
    EXPECT_THROW(Restore(copy(), scratch.path() / place, Lost::kRefused, counted), InputError) << place;
    EXPECT_THROW(BackUp(data(), scratch.path() / place), InputError) << place;
  }
  EXPECT_EQ(told, 0);
  fs::remove(copy() / upload);
  EXPECT_THROW(Restore(copy(), scratch.path() / "new"), InputError);
  EXPECT_FALSE(fs::exists(scratch.path() / "new")) << "nothing was left";
}

TEST_F(Backup, IsRestoredOnAFreshDisk) {
  BackUp(data(), copy());
  fs::create_directories(scratch.path() / "new" / "lost+found");
  EXPECT_NO_THROW(Restore(copy(), scratch.path() / "new"));
}

// A data folder itself, by somebody in a hurry: its service goes on meanwhile.
TEST_F(Backup, WhatIsRestoredIsAsOfOneMomentOrRefused) {
  bool done = false;
  const auto while_copying = [&](const std::function<void()>& change) {
    done = false;
    return Progress(
        [&done, change](std::string_view what, double) {
          if (what == "copying" && !std::exchange(done, true)) change();
        },
        {});
  };
  Restore(data(), scratch.path() / "new", Lost::kRefused, while_copying([&] {
            Stores stores(data(), {});
            IncomingBlob blob = stores.blobs.Receive(".nii", 100);
            blob.Write(std::string_view("LATER"));
            const std::string content = stores.blobs.Keep(std::move(blob));
            stores.catalogue.AddScan(subject, "pose01", {content, content, ".nii", 5, "{}"});
          }));
  EXPECT_TRUE(done);
  EXPECT_NO_THROW(BackUp(scratch.path() / "new", copy())) << "all that its records name is there";
  EXPECT_THROW(
      Restore(data(), scratch.path() / "newer", Lost::kRefused, while_copying([&] { RemoveSubject(); })),
      Unavailable);
  EXPECT_FALSE(fs::exists(scratch.path() / "newer" / kDatabaseFile));
}

TEST_F(Backup, OfBeforeTheMarkIsBroughtUpToDate) {
  BackUp(data(), copy());
  fs::remove(copy() / "kinevox-backup");
  RemoveSubject();
  EXPECT_NO_THROW(BackUp(data(), copy()));
  EXPECT_FALSE(fs::exists(copy() / upload));
}

// What it holds beside the tables that this program knows would be left out, or left behind.
TEST_F(Backup, OfANewerProgramIsNeitherMadeNorRestored) {
  const auto age = [](const fs::path& folder) {
    SQLite::Database(folder / kDatabaseFile, SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 900");
  };
  BackUp(data(), copy());
  age(copy());
  EXPECT_THROW(Restore(copy(), scratch.path() / "new"), Conflict);
  EXPECT_FALSE(fs::exists(scratch.path() / "new"));
  BackUp(data(), copy());
  age(data());
  EXPECT_THROW(BackUp(data(), copy()), Conflict);
  EXPECT_NO_THROW(Restore(copy(), scratch.path() / "new")) << "the copy before it is whole";
}

// The next backup leaves its empty folder.
TEST_F(Backup, ASeriesThatNoRecordNamesAnyLongerIsNotAskedFor) {
  BackUp(data(), copy());
  fs::create_directories(copy() / "blobs" / "ab" / std::string(64, 'a'));
  EXPECT_NO_THROW(Restore(copy(), scratch.path() / "new"));
}

}  // namespace
}  // namespace kvx
