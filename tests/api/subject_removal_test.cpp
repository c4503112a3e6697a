// Removal of a subject beside uploads and jobs that begin meanwhile: nothing of it is left, and nobody waits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "api/handlers/animations.h"
#include "api/handlers/batches.h"
#include "tests/support/handler_requests.h"

namespace kvx {
namespace {

using testing_support::BuiltModel;
using testing_support::Field;
using testing_support::NewSubjectId;
using testing_support::RefusalOf;
using testing_support::SendScan;
using testing_support::ServiceWorld;
using testing_support::SubjectWithScans;

void Remove(ServiceWorld& w, const std::string& subject) {
  DeleteSubject(w.services, subject, "key_a", "default");
}

// Each sweep looks at the models of all subjects.
TEST(SubjectRemoval, OfManyModelsSweepsOnce) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  for (int model = 0; model < 3; ++model) {
    CreateModel(w.services, R"({"subject":")" + subject + R"(","template":"pose00"})", "");
    w.jobs.Succeed(*w.jobs.Claim("w"), "{}");
  }
  Remove(w, subject);
  EXPECT_EQ(w.poser.forgotten, 3);
  EXPECT_EQ(w.poser.sweeps, 1);
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

// Whatever begins before a removal and would be recorded after it.
TEST(SubjectRemoval, WhatWasUnderWayFindsNoSubjectAndLeavesNothing) {
  ServiceWorld w;
  const auto refused = [&](testing_support::Meanwhile& meanwhile, const auto& act) {
    const std::string subject = SubjectWithScans(w);
    meanwhile = [&w, subject] { Remove(w, subject); };
    EXPECT_THROW(act(subject), NotFound);
    EXPECT_TRUE(w.jobs.List({}).items.empty());
    EXPECT_EQ(w.FilesUnder("blobs") + w.FilesUnder("incoming"), 0u);
  };
  const auto send = [](Upload upload) {
    upload.Write(std::string("VOXELS with descrip=Doe^John"));
    upload.Finish();
  };
  const auto bones = [&](const std::string& subject, const Query& more) {
    Query query{{"template", "pose00"}};
    query.insert(more.begin(), more.end());
    return Upload::OfBones(w.services, subject, query, "");
  };
  refused(w.inspector.meanwhile, [&](const auto& s) { SendScan(w, s, "pose02", "VOXELS"); });
  refused(w.inspector.meanwhile, [&](const auto& s) { send(bones(s, {})); });
  refused(w.builder.meanwhile, [&](const auto& s) { send(bones(s, {{"kind", "seeds"}})); });
  refused(w.builder.meanwhile, [&](const auto& s) {
    CreateThresholdBones(w.services, s, {{"template", "pose00"}, {"kind", "threshold"}}, "");
  });
  const auto body = [](const auto& s) { return R"({"subject":")" + s + R"(","template":"pose00"})"; };
  refused(w.builder.meanwhile, [&](const auto& s) { CreateModel(w.services, body(s), ""); });
  refused(w.builder.meanwhile,
          [&](const auto& s) { CreateBatch(w.services, R"({"models":[)" + body(s) + "]}", ""); });
}

TEST(SubjectRemoval, ACheckedModelOrSegmentationFindsNoSubject) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const PreparedModel model = PrepareModel(w.services, {{"subject", subject}, {"template", "pose00"}});
  const PreparedSegmentation bones =
      PrepareSegmentation(w.services, {subject, "pose00", std::nullopt, ""}, nullptr, {});
  Remove(w, subject);
  EXPECT_EQ(RefusalOf([&] { SubmitModel(w.services, model); }), "there is no such subject");
  EXPECT_EQ(RefusalOf([&] { SubmitSegmentation(w.services, bones); }), "there is no such subject");
}

TEST(SubjectRemoval, AnAnimationUnderWayFindsNoModel) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  w.poser.meanwhile = [&] { Remove(w, w.catalogue.RequireModel(model).subject); };
  EXPECT_THROW(CreateAnimation(w.services, model, {}, R"({"frames":[]})", ""), NotFound);
  EXPECT_TRUE(w.jobs.List({}).items.empty());
}

// Once the job has ended nothing else names them.
TEST(SubjectRemoval, StrokesGoWithTheirSubject) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w), other = SubjectWithScans(w);
  const auto send_strokes = [&](const std::string& to, const std::string& bytes) {
    Upload upload = Upload::OfBones(w.services, to, {{"template", "pose00"}, {"kind", "seeds"}}, "");
    upload.Write(bytes);
    w.jobs.Cancel(Field(upload.Finish().body, "job"));
  };
  send_strokes(subject, "VOXELS with descrip=Doe^John");
  const size_t before = w.FilesUnder("blobs");
  Remove(w, subject);
  EXPECT_EQ(w.FilesUnder("blobs"), before - 1) << "the other subject has the same scans";
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
