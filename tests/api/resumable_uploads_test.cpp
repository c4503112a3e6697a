// tus in the handlers: offsets, checksums, the end, and what a refused upload leaves.
#include "api/handlers/resumable_uploads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <nlohmann/json.hpp>

#include "api/errors.h"
#include "api/handlers/scans.h"
#include "tests/support/service_world.h"

namespace kvx {
namespace {

using testing_support::ServiceWorld;

std::string Base64(const std::string& bytes) {
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  text.resize(
      size_t(EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                             reinterpret_cast<const unsigned char*>(bytes.data()), int(bytes.size()))));
  return text;
}

struct TusWorld : ServiceWorld {
  std::string subject = Json::parse(CreateSubject(services, R"({"region":"knee"})", "").body)["id"];

  std::string Metadata(const std::string& name, const std::string& more = "") const {
    return "subject " + Base64(subject) + ",name " + Base64(name) + ",filename " + Base64("a.nii") +
           ",theirs" + more;
  }
  std::string Create(size_t length, const std::string& more = "") {
    return CreateResumableUpload(services, std::to_string(length), Metadata("pose00", more)).id;
  }
  ResumableUpload Send(const std::string& id, int64_t offset, const std::string& bytes,
                       const std::string& checksum = "") {
    ResumablePart part(services, id, std::to_string(offset), checksum);
    part.Write(bytes);
    return part.Finish();
  }
};

TEST(Resumable, PartsBecomeAScan) {
  TusWorld w;
  const std::string id = w.Create(8, ",sha256 " + Base64(Sha256("VOXELS01").Hex()));
  EXPECT_EQ(w.Send(id, 0, "VOX").received, 3);
  EXPECT_THROW(w.Send(id, 2, "x"), Conflict);
  EXPECT_EQ(Json::parse(GetResumableUpload(w.services, id))["state"], "receiving");
  const ResumableUpload done = w.Send(id, 3, "ELS01");
  EXPECT_EQ(done.received, 8);
  const std::string scan = done.location->substr(done.location->rfind('/') + 1);
  const Json record = Json::parse(GetScan(w.services, w.subject, scan));
  EXPECT_EQ(record["sha256"], Sha256("VOXELS01").Hex());
  EXPECT_EQ(record["name"], "pose00");
  EXPECT_EQ(Json::parse(GetResumableUpload(w.services, id))["location"], *done.location);
  EXPECT_EQ(w.FilesUnder("uploads") + w.FilesUnder("incoming"), 0u);
  EXPECT_EQ(w.FilesUnder("blobs"), 1u);
  EXPECT_EQ(w.Send(id, 8, "").location, done.location) << "an empty part after the end changes nothing";
}

// A digest that goes unread would let other bytes pass.
TEST(Resumable, MetadataMayHaveBlanksBehindItsCommas) {
  TusWorld w;
  const std::string id = w.Create(8, ", sha256 " + Base64(Sha256("VOXELS01").Hex()) + ", ,");
  EXPECT_THROW(w.Send(id, 0, "VOXELS02"), InputError);
}

TEST(Resumable, UnfinishedOnesOfASubjectAreCounted) {
  TusWorld w;
  const std::string first = w.Create(7);
  for (int i = 1; i < 256; ++i) w.Create(1);
  EXPECT_THROW(w.Create(1), LimitReached);
  w.Send(first, 0, "VOXELS0");
  EXPECT_NO_THROW(CreateResumableUpload(w.services, "1", w.Metadata("pose01")))
      << "a finished one counts no more";
  EXPECT_THROW(CreateResumableUpload(w.services, "1", w.Metadata("pose02")), LimitReached);
}

TEST(Resumable, ABrokenConnectionKeepsWhatCame) {
  TusWorld w;
  const std::string id = w.Create(8);
  {
    ResumablePart part(w.services, id, "0", "");
    part.Write(std::string("VOXE"));
    part.BrokeOff();
  }
  EXPECT_EQ(w.resumable.Require(id).received, 4);
  const std::string sha1 = "sha1 " + Base64(std::string(20, 'x'));
  {
    ResumablePart part(w.services, id, "4", sha1);
    part.Write(std::string("LS"));
    part.BrokeOff();
  }
  EXPECT_EQ(w.resumable.Require(id).received, 4) << "with a checksum: all or none";
}

TEST(Resumable, AChecksumThatDoesNotMatchDiscardsThePart) {
  TusWorld w;
  const std::string id = w.Create(8);
  const auto digest = Sha256("VOX").bytes;
  const std::string good = "sha256 " + Base64(std::string(digest.begin(), digest.end()));
  EXPECT_THROW(w.Send(id, 0, "VOY", good), ChecksumMismatch);
  EXPECT_EQ(w.resumable.Require(id).received, 0);
  EXPECT_EQ(w.Send(id, 0, "VOX", good).received, 3);
  EXPECT_THROW(w.Send(id, 3, "E", "crc32 AAAA"), InputError);
  EXPECT_THROW(w.Send(id, 3, "E", "sha1 ?"), InputError);
}

TEST(Resumable, ARefusedWholeLeavesNothing) {
  TusWorld w;
  const std::string damaged = w.Create(7);
  EXPECT_THROW(w.Send(damaged, 0, "rubbish"), InputError);
  EXPECT_THROW(w.resumable.Require(damaged), NotFound);
  const std::string other = w.Create(7, ",sha256 " + Base64(std::string(64, '0')));
  EXPECT_THROW(w.Send(other, 0, "VOXELS1"), InputError);
  EXPECT_THROW(w.resumable.Require(other), NotFound);
  EXPECT_EQ(w.FilesUnder("uploads") + w.FilesUnder("incoming") + w.FilesUnder("blobs"), 0u);
}

// Its subject's removal takes the bytes that came, too.
TEST(Resumable, WhoseSubjectIsRemovedWhileItIsSentFindsNone) {
  TusWorld w;
  const std::string id = w.Create(6);
  ResumablePart part(w.services, id, "0", "");
  part.Write(std::string_view("VOXELS"));
  DeleteSubject(w.services, w.subject, "key_a", "default");
  EXPECT_THAT([&] { part.Finish(); },
              testing::ThrowsMessage<NotFound>(testing::HasSubstr("no such subject")));
  EXPECT_EQ(w.FilesUnder("blobs") + w.FilesUnder("incoming") + w.FilesUnder("uploads"), 0u);
}

TEST(Resumable, IsRefusedBeforeTheFirstByteWhereItCanBe) {
  TusWorld w;
  w.Send(w.Create(7), 0, "VOXELS1");
  EXPECT_THROW(w.Create(7), Conflict) << "the name is taken";
  EXPECT_THROW(CreateResumableUpload(w.services, "", w.Metadata("b")), InputError);
  EXPECT_THROW(CreateResumableUpload(w.services, "-1", w.Metadata("b")), InputError);
  EXPECT_THROW(CreateResumableUpload(w.services, "0", w.Metadata("b")), InputError);
  EXPECT_THROW(CreateResumableUpload(w.services, std::to_string((1 << 20) + 1), w.Metadata("b")),
               QuotaExceeded);
  EXPECT_THROW(CreateResumableUpload(w.services, "7", "name " + Base64("b")), InputError) << "no subject";
  EXPECT_THROW(CreateResumableUpload(w.services, "7", "subject ?"), InputError);
  EXPECT_THROW(
      CreateResumableUpload(w.services, "7",
                            "subject " + Base64("sub_none") + ",name YQ==,filename " + Base64("a.nii")),
      NotFound);
  EXPECT_THROW(CreateResumableUpload(w.services, "7", w.Metadata("../b")), InputError);
  EXPECT_THROW(CreateResumableUpload(w.services, "7", w.Metadata("b", ",name " + Base64("c"))), InputError)
      << "which of the two?";
}

// A service that is killed has at most the last 16 MiB to ask for again.
TEST(Resumable, ALongPartIsCountedAsItComes) {
  TusWorld w;
  constexpr int64_t kMebibyte = 1 << 20;
  ResumableUpload upload;
  upload.subject = w.subject, upload.kind = "scan", upload.length = 24 * kMebibyte;
  upload.parameters = R"({"name":"pose00","filename":"a.nii"})";
  const std::string id = w.resumable.Create(upload).id;
  ResumablePart part(w.services, id, "0", "");
  const std::string mebibyte(size_t(kMebibyte), 'V');
  for (int i = 0; i < 20; ++i) part.Write(mebibyte);
  EXPECT_GE(w.resumable.Require(id).received, 16 * kMebibyte);
  EXPECT_LE(w.resumable.Require(id).received, 20 * kMebibyte);
}

TEST(Uploads, BytesThatAreThereNeedNotBeSent) {
  ServiceWorld w;
  const auto subject = [&] {
    return Json::parse(CreateSubject(w.services, R"({"region":"knee"})", "").body)["id"].get<std::string>();
  };
  const auto send = [&](const std::string& to, const std::string& bytes, const std::string& sha256) {
    Upload upload =
        Upload::OfScan(w.services, to, {{"name", "a"}, {"filename", "a.nii"}, {"sha256", sha256}}, "");
    upload.Write(bytes);
    return upload.Finish();
  };
  const std::string first = subject(), second = subject(), sha256 = Sha256("VOXELS1").Hex();
  EXPECT_THROW(send(first, "", sha256), NotFound);
  EXPECT_THROW(send(first, "VOXELS2", sha256), InputError) << "other bytes than announced";
  EXPECT_EQ(send(first, "VOXELS1", sha256).status, 201);
  const Json record = Json::parse(send(second, "", sha256).body);
  EXPECT_EQ(record["sha256"], sha256);
  EXPECT_EQ(record["size"], (Json{4, 5, 6}));
  EXPECT_EQ(w.FilesUnder("blobs"), 1u);
  EXPECT_THROW(send(first, "VOXELS1", "zz"), InputError);
}

TEST(Uploads, PutTwiceIsOnce) {
  ServiceWorld w;
  const std::string subject = Json::parse(CreateSubject(w.services, R"({"region":"knee"})", "").body)["id"];
  const auto put = [&](const std::string& bytes) {
    Upload upload = Upload::OfScan(w.services, subject, {{"name", "a"}, {"filename", "a.nii"}}, "");
    upload.SameAgainIsFine();
    upload.Write(bytes);
    return upload.Finish();
  };
  const Answer first = put("VOXELS1"), again = put("VOXELS1");
  EXPECT_EQ(first.status, 201);
  EXPECT_EQ(again.status, 200);
  EXPECT_EQ(again.body, first.body);
  EXPECT_THROW(put("VOXELS2"), Conflict);
}

TEST(Resumable, StrokesWhoseClientGoesWhileTheyWaitStay) {
  TusWorld w;
  w.Send(w.Create(7), 0, "VOXELS0");
  const std::string strokes = CreateResumableUpload(w.services, "7",
                                                    "subject " + Base64(w.subject) + ",kind " +
                                                        Base64("seeds") + ",template " + Base64("pose00"))
                                  .id;
  w.services.reading_turn = []() -> std::shared_ptr<void> { throw Cancelled(); };
  EXPECT_THROW(w.Send(strokes, 0, "VOXELSs"), Cancelled);
  w.services.reading_turn = [] { return nullptr; };
  EXPECT_TRUE(w.Send(strokes, 0, "VOXELSs").location);
}

}  // namespace
}  // namespace kvx
