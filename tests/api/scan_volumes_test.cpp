// Uploaded scans are fetched again, in every format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/handlers/scans.h"
#include "tests/support/handler_requests.h"

namespace kvx {
namespace {

using testing_support::SendScan;
using testing_support::ServiceWorld;

std::string Bytes(const FileAnswer& answer) {
  std::string bytes(answer.file->size() - answer.offset, ' ');
  answer.file->ReadAt(answer.offset, bytes.data(), bytes.size());
  return bytes;
}

struct ScanWorld : ServiceWorld {
  std::string subject = testing_support::NewSubjectId(*this);
  ScanWorld() { SendScan(*this, subject, "pose00", "VOXELS0"); }
  FileAnswer Volume(const Query& query, const Conditions& conditions = {}) {
    return GetScanVolume(services, subject, "pose00", query, conditions);
  }
};

TEST(ScanVolumes, AreAsUploadedOrInAnotherFormat) {
  ScanWorld w;
  const FileAnswer plain = w.Volume({}), other = w.Volume({{"format", "nrrd"}});
  EXPECT_EQ(Bytes(plain), "VOXELS0");
  EXPECT_EQ(plain.content_type, "application/gzip");
  EXPECT_THAT(plain.filename, testing::MatchesRegex("scn_[a-z0-9]+\\.nii\\.gz")) << "no name of a user's";
  EXPECT_EQ(Bytes(other), "volume.nii.gz as .nrrd");
  EXPECT_NE(other.etag, plain.etag);
  EXPECT_TRUE(w.Volume({}, {plain.etag}).not_modified);
  EXPECT_THROW(w.Volume({{"format", "dicom"}}), InputError);
  EXPECT_THROW(w.Volume({{"level", "1"}}), InputError);
  EXPECT_EQ(w.FilesUnder("incoming"), 0u);
}

// A browser must not keep what a defect of reading or writing made; as it was uploaded a file stays.
TEST(ScanVolumes, AreFetchedAgainOnceTheyAreConvertedOtherwise) {
  ScanWorld w;
  const std::string plain = w.Volume({}).etag, other = w.Volume({{"format", "nrrd"}}).etag;
  w.builder.conversion = "2";
  EXPECT_FALSE(w.Volume({{"format", "nrrd"}}, {other}).not_modified);
  EXPECT_TRUE(w.Volume({}, {plain}).not_modified);
}

TEST(ScanVolumes, ARawOneHasItsGeometryInHeaders) {
  ScanWorld w;
  const FileAnswer raw = w.Volume({{"format", "raw"}});
  EXPECT_EQ(Bytes(raw), "ab");
  EXPECT_THAT(raw.headers, testing::Contains(std::pair<std::string, std::string>("X-Kinevox-Size", "2,1,1")));
  EXPECT_THAT(raw.headers, testing::Contains(std::pair<std::string, std::string>("X-Kinevox-Type", "uint8")));
}

TEST(ScanVolumes, AreConvertedInTheirTurn) {
  ScanWorld w;
  int turns = 0;
  w.services.reading_turn = [&] { return std::make_shared<int>(++turns); };
  w.Volume({});
  EXPECT_EQ(turns, 0) << "nothing is converted";
  w.Volume({{"format", "raw"}});
  EXPECT_EQ(turns, 1);
  w.services.reading_turn = []() -> std::shared_ptr<void> { throw Unavailable("too many wait"); };
  EXPECT_THROW(w.Volume({{"format", "raw"}}), Unavailable);
}

TEST(ScanVolumes, AreOfTheirSubjectAlone) {
  ScanWorld w;
  const std::string other = testing_support::NewSubjectId(w);
  const std::string id = w.catalogue.FindScan(w.subject, "pose00")->id;
  EXPECT_EQ(Bytes(GetScanVolume(w.services, w.subject, id, {}, {})), "VOXELS0");
  EXPECT_THROW(GetScanVolume(w.services, other, id, {}, {}), NotFound);
  EXPECT_THROW(GetScanVolume(w.services, other, "pose00", {}, {}), NotFound);
}

}  // namespace
}  // namespace kvx
