// Removal of a subject beside uploads and jobs that begin meanwhile: nothing of it is left, and nobody waits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "tests/support/handler_requests.h"

namespace kvx {
namespace {

using testing_support::NewSubjectId;
using testing_support::SendScan;
using testing_support::ServiceWorld;
using testing_support::SubjectWithScans;

void Remove(ServiceWorld& w, const std::string& subject) {
  DeleteSubject(w.services, subject, "key_a", "default");
}

// Looking at a large scan takes minutes.
TEST(SubjectRemoval, WaitsForNoUploadThatIsLookedAt) {
  ServiceWorld w;
  const std::string mine = SubjectWithScans(w), other = NewSubjectId(w);
  std::future<void> removal;
  w.inspector.meanwhile = [&] {
    removal = std::async(std::launch::async, [&] { Remove(w, mine); });
    EXPECT_EQ(removal.wait_for(std::chrono::seconds(30)), std::future_status::ready);
  };
  EXPECT_EQ(SendScan(w, other, "pose00", "VOXELS of another").status, 201);
  removal.get();
  EXPECT_EQ(w.FilesUnder("blobs"), 1u);
}

// Bytes that another subject has need no second look; that one may be removed at any moment.
TEST(SubjectRemoval, TakesNoBytesThatAnotherSubjectHasJustBeenGiven) {
  ServiceWorld w;
  const std::string first = NewSubjectId(w), second = NewSubjectId(w);
  SendScan(w, first, "pose00", "VOXELS");
  w.inspector.meanwhile = [&] {
    SendScan(w, second, "pose00", "VOXELS of both");
    Remove(w, first);
  };
  const std::string third = NewSubjectId(w);
  SendScan(w, third, "pose00", "VOXELS of both");
  Remove(w, second);
  EXPECT_EQ(w.FilesUnder("blobs"), 1u);
  const StoredFile file = w.catalogue.FindScan(third, "pose00")->file;
  EXPECT_EQ(testing_support::Content(w.blobs.PathOf(file.content)), "VOXELS of both");
}

TEST(SubjectRemoval, BytesThatGoJustAsTheyAreUsedAgainAreKeptAnew) {
  ServiceWorld w;
  const std::string mine = NewSubjectId(w), other = NewSubjectId(w);
  SendScan(w, mine, "pose00", "VOXELS");
  std::future<Answer> upload;
  {
    const auto removal = w.blobs.KeepOthersOut();
    upload = std::async(std::launch::async, [&] { return SendScan(w, other, "pose00", "VOXELS"); });
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // until it knows the bytes and waits
    w.retention.DeleteSubject(mine, "key_a", "default");
    w.blobs.Remove(Sha256("VOXELS").Hex());
  }
  EXPECT_EQ(upload.get().status, 201);
  w.retention.RemoveBytes([](const std::string&) {});
  const StoredFile file = w.catalogue.FindScan(other, "pose00")->file;
  EXPECT_EQ(testing_support::Content(w.blobs.PathOf(file.content)), "VOXELS");
}

}  // namespace
}  // namespace kvx
