// What is counted is on disk; what is not counted is cut off; nobody writes beside another.
#include "storage/resumable_uploads.h"

#include <gtest/gtest.h>

#include <fstream>

#include "storage/catalogue.h"
#include "storage/files/blob_store.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;

struct UploadWorld {
  testing_support::ScratchFolder scratch;
  int64_t now_ms = 1000;
  Database database{scratch.path() / "test.db", [this] { return now_ms; }};
  Catalogue catalogue{database};
  ResumableUploads uploads{database, scratch.path() / "uploads", 500};
  std::string subject = catalogue.AddSubject({{}, "knee", {}}).id;

  std::string Start(int64_t length) {
    ResumableUpload upload;
    upload.subject = subject;
    upload.kind = "scan";
    upload.parameters = "{}";
    upload.length = length;
    return uploads.Create(upload).id;
  }
  void Append(const std::string& id, const std::string& bytes, bool keep) {
    const auto writer = uploads.Continue(id);
    writer->Write(bytes);
    if (keep) writer->Keep();
  }
  std::string Bytes(const std::string& id) {
    return testing_support::Content(scratch.path() / "uploads" / id);
  }
};

TEST(ResumableUploads, WhatWasNotKeptIsWrittenAgain) {
  UploadWorld w;
  const std::string id = w.Start(9);
  w.Append(id, "abc", true);
  w.Append(id, "xyz", false);  // as if the process had died here
  EXPECT_EQ(w.uploads.Require(id).received, 3);
  w.Append(id, "de", true);
  EXPECT_EQ(w.Bytes(id), "abcde");
  EXPECT_EQ(w.uploads.Require(id).received, 5);
}

TEST(ResumableUploads, TheLastByteCountsOnlyWithItsRecord) {
  UploadWorld w;
  const std::string id = w.Start(3);
  w.Append(id, "abc", true);
  EXPECT_EQ(w.uploads.Require(id).received, 0) << "else a client would think that all is done";
  {
    const auto writer = w.uploads.Continue(id);
    writer->Write(std::string("abc"));
    writer->Keep();
    EXPECT_TRUE(writer->Complete());
    writer->Finish("/v1/there");
  }
  EXPECT_EQ(w.uploads.Require(id).received, 3);
  EXPECT_EQ(*w.uploads.Require(id).location, "/v1/there");
}

TEST(ResumableUploads, RefusesMoreThanAnnouncedAndTwoAtATime) {
  UploadWorld w;
  const std::string id = w.Start(4);
  const auto writer = w.uploads.Continue(id);
  EXPECT_THROW(w.uploads.Continue(id), Locked);
  EXPECT_THROW(w.uploads.Remove(id), Locked);
  EXPECT_THROW(writer->Write(std::string("abcde")), InputError);
  EXPECT_THROW(w.uploads.Continue("upl_none"), NotFound);
  EXPECT_THROW(w.uploads.Continue("upl_none"), NotFound) << "a failure holds no lock";
}

TEST(ResumableUploads, ExpireAfterTheLastSignOfLife) {
  UploadWorld w;
  const std::string idle = w.Start(4), busy = w.Start(4);
  w.Append(idle, "ab", true);
  w.now_ms += 300;
  w.Append(busy, "ab", true);
  w.now_ms += 300;
  EXPECT_THROW(w.uploads.Require(idle), Gone);
  EXPECT_EQ(w.uploads.RemoveExpired(), 1);
  EXPECT_THROW(w.uploads.Require(idle), NotFound);
  EXPECT_FALSE(fs::exists(w.scratch.path() / "uploads" / idle));
  EXPECT_EQ(w.uploads.Require(busy).received, 2);
  w.uploads.Remove(busy);
  EXPECT_FALSE(fs::exists(w.scratch.path() / "uploads" / busy));
}

// A folder of before a crash, or put together by hand: zeros in place of bytes would be a wrong scan.
TEST(ResumableUploads, NothingGoesOnAfterLostBytes) {
  UploadWorld w;
  for (const bool whole : {true, false}) {
    const std::string id = w.Start(9);
    w.Append(id, "abcd", true);
    const fs::path file = w.scratch.path() / "uploads" / id;
    whole ? (void)fs::remove(file) : fs::resize_file(file, 3);
    EXPECT_THROW(w.uploads.Require(id), Gone) << whole;
    EXPECT_THROW(w.uploads.Continue(id), Gone) << whole;
    EXPECT_THROW(w.uploads.Continue(id), Gone) << "a failure holds no lock";
  }
}

TEST(ResumableUploads, OfWhichNothingWasCountedNeedsNoFile) {
  UploadWorld w;
  const std::string id = w.Start(3);
  EXPECT_EQ(w.uploads.Require(id).received, 0);
  w.Append(id, "ab", true);
  EXPECT_EQ(w.Bytes(id), "ab");
}

TEST(ResumableUploads, BytesThatNoRecordNamesGo) {
  UploadWorld w;
  const std::string open = w.Start(4);
  w.Append(open, "ab", true);
  const fs::path left = w.scratch.path() / "uploads/upl_left_by_a_subject_that_is_gone";
  std::ofstream(left) << "half a scan";
  w.uploads.RemoveExpired();
  EXPECT_FALSE(fs::exists(left));
  EXPECT_EQ(w.Bytes(open), "ab");
}

TEST(ResumableUploads, AKilledFinishLeavesTheBlobAlone) {
  UploadWorld w;
  BlobStore blobs(w.scratch.path());
  const std::string id = w.Start(3);
  w.Append(id, "abc", true);
  const std::string blob =
      blobs.Keep(blobs.Adopt(w.scratch.path() / "uploads" / id, ".nii"));  // killed before the record
  w.Append(id, "xy", true);                                                // the client starts again
  EXPECT_EQ(testing_support::Content(blobs.PathOf(blob)), "abc");
  EXPECT_EQ(w.Bytes(id), "xy");
}

TEST(BlobStore, UnusedBlobsGoAfterTheirGrace) {
  const testing_support::ScratchFolder scratch;
  BlobStore blobs(scratch.path());
  const auto keep = [&](const std::string& bytes) {
    IncomingBlob blob = blobs.Receive(".nii", 100);
    blob.Write(bytes);
    return blobs.Keep(std::move(blob));
  };
  const auto age = [&](const std::string& name, int hours) {
    fs::last_write_time(blobs.PathOf(name), fs::file_time_type::clock::now() - std::chrono::hours(hours));
  };
  const std::string used = keep("used"), unused = keep("unused"), fresh = keep("fresh"),
                    again = keep("again");
  for (const std::string& name : {used, unused, again}) age(name, 2);
  EXPECT_EQ(keep("again"), again) << "placing the same bytes is a sign of life";
  EXPECT_EQ(blobs.RemoveUnused([&] { return std::set<std::string>{used}; }, std::chrono::hours(1)), 1);
  EXPECT_TRUE(fs::exists(blobs.PathOf(used)));
  EXPECT_TRUE(fs::exists(blobs.PathOf(fresh)));
  EXPECT_TRUE(fs::exists(blobs.PathOf(again)));
  EXPECT_FALSE(fs::exists(blobs.PathOf(unused)));
}

// The last byte of a long upload may come hours after its file was begun: the grace counts from its end.
TEST(BlobStore, ABlobIsFreshWhenItIsPlacedHoweverOldItsFile) {
  const testing_support::ScratchFolder scratch;
  BlobStore blobs(scratch.path());
  const fs::path whole = scratch.path() / "upl_whole";
  std::ofstream(whole) << "bytes";
  fs::last_write_time(whole, fs::file_time_type::clock::now() - std::chrono::hours(2));
  const std::string name = blobs.Keep(blobs.Adopt(whole, ".nii"));
  EXPECT_EQ(blobs.RemoveUnused([] { return std::set<std::string>(); }, std::chrono::hours(1)), 0);
  EXPECT_TRUE(fs::exists(blobs.PathOf(name)));
}

TEST(BlobStore, WhatAKilledUploadLeftGoesAfterADay) {
  const testing_support::ScratchFolder scratch;
  BlobStore blobs(scratch.path());
  const auto age = [&](const char* name, int hours) {
    std::ofstream(scratch.path() / "incoming" / name) << "half a scan";
    fs::last_write_time(scratch.path() / "incoming" / name,
                        fs::file_time_type::clock::now() - std::chrono::hours(hours));
  };
  age("in_old.nii", 30), age("in_now.nii", 1);
  blobs.RemoveAbandoned(std::chrono::hours(24));
  EXPECT_FALSE(fs::exists(scratch.path() / "incoming/in_old.nii"));
  EXPECT_TRUE(fs::exists(scratch.path() / "incoming/in_now.nii"));
}

TEST(BlobStore, ABlobThatIsPlacedWhileUnusedOnesGoStays) {
  const testing_support::ScratchFolder scratch;
  BlobStore blobs(scratch.path());
  const auto keep = [&] {
    IncomingBlob blob = blobs.Receive(".nii", 100);
    blob.Write(std::string("bytes"));
    return blobs.Keep(std::move(blob));
  };
  const std::string name = keep();
  fs::last_write_time(blobs.PathOf(name), fs::file_time_type::clock::now() - std::chrono::hours(2));
  const auto uploaded_meanwhile = [&] {
    keep();
    return std::set<std::string>();
  };
  EXPECT_EQ(blobs.RemoveUnused(uploaded_meanwhile, std::chrono::hours(1)), 0);
  EXPECT_TRUE(fs::exists(blobs.PathOf(name)));
}

}  // namespace
}  // namespace kvx
