// Subjects, and their scans and bones on the way in.
#include "api/handlers/subject_uploads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <random>
#include <vector>

#include "api/handlers/scans.h"
#include "pipeline/io/dicom/pack_series.h"
#include "tests/support/handler_requests.h"

namespace kvx {
namespace {

using testing_support::Field;
using testing_support::NewSubjectId;
using testing_support::RefusalOf;
using testing_support::SendScan;
using testing_support::ServiceWorld;
using testing_support::SubjectWithScans;

TEST(Subjects, AreCheckedAndRepeatable) {
  ServiceWorld w;
  const Answer first = CreateSubject(w.services, R"({"region":"hand","external_id":"e1"})", "k");
  EXPECT_EQ(first.status, 201);
  EXPECT_EQ(first.location, "/v1/subjects/" + Field(first.body, "id"));
  EXPECT_EQ(CreateSubject(w.services, R"({"region":"hand","external_id":"e1"})", "k").body, first.body);
  EXPECT_THROW(CreateSubject(w.services, R"({"region":"knee"})", "k"), Conflict);
  EXPECT_THROW(CreateSubject(w.services, R"({"region":"hand","external_id":"e1"})", ""), Conflict);
  for (const char* field : {"name", "external_id"}) {
    const auto body = [&](const std::string& text) {
      return std::string(R"({"region":"hand",")") + field + "\":\"" + text + "\"}";
    };
    for (const char* text : {"a\\nb", "\\u0000", "\x7f"})
      EXPECT_THROW(CreateSubject(w.services, body(text), ""), InputError) << field << text;
    EXPECT_EQ(CreateSubject(w.services, body("K\xc3\xb6ln 2"), "").status, 201);
  }
  EXPECT_THROW(CreateSubject(w.services, R"({"region":"hand","external_id":""})", ""), InputError)
      << "the next one without an id of its own would be in its way";
  EXPECT_THROW(CreateSubject(w.services, R"({"region":"foot"})", ""), InputError);
  EXPECT_THROW(CreateSubject(w.services, "[]", ""), InputError);
  EXPECT_THROW(CreateSubject(w.services, "{", ""), InputError);
  EXPECT_THAT(RefusalOf([&] { CreateSubject(w.services, R"({"region":"hand","age":3})", ""); }),
              testing::HasSubstr("'age'"));
}

TEST(Uploads, AnswerWithWhatIsInTheFile) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const Json scan = Json::parse(SendScan(w, subject, "pose00", "VOXELS").body);
  EXPECT_EQ(scan["name"], "pose00");
  EXPECT_EQ(scan["sha256"], Sha256("VOXELS").Hex());
  EXPECT_EQ(scan["size"], (Json{4, 5, 6}));
  EXPECT_EQ(scan["modality"], "MR");
  EXPECT_EQ(GetScan(w.services, subject, scan["id"]), Dump(scan));
  EXPECT_THROW(GetScan(w.services, NewSubjectId(w), scan["id"]), NotFound);
}

TEST(Uploads, RefusedOnesLeaveNothing) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  EXPECT_THROW(SendScan(w, subject, "pose00", "rubbish"), InputError);
  EXPECT_THROW(SendScan(w, subject, "pose00", ""), InputError);
  EXPECT_THROW(SendScan(w, subject, "pose00", std::string(1 << 20, 'V') + "x"), QuotaExceeded);
  EXPECT_THROW(SendScan(w, subject, "pose00", "not an archive", "", "a.zip"), InputError);
  EXPECT_THROW(SendScan(w, subject, "../up", "VOXELS"), InputError);
  EXPECT_THROW(SendScan(w, subject, "pose00", "VOXELS", "", "a.exe"), InputError);
  EXPECT_THROW(SendScan(w, "sub_none", "pose00", "VOXELS"), NotFound);
  EXPECT_EQ(w.FilesUnder("blobs") + w.FilesUnder("incoming"), 0u);
  SendScan(w, subject, "pose00", "VOXELS1");
  EXPECT_THROW(SendScan(w, subject, "pose00", "VOXELS2"), Conflict);
  EXPECT_EQ(w.FilesUnder("blobs") + w.FilesUnder("incoming"), 1u);
}

// 70 MB of which most are zeros, so that they come as one.
TEST(Uploads, ASeriesIsUnpackedAsLongAsTheDiskHasRoom) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const auto series = w.scratch.path() / "series", packed = w.scratch.path() / "a.tar.gz";
  std::filesystem::create_directories(series);
  std::string image(size_t(70) << 20, '\0');
  std::mt19937 random(1);
  std::generate_n(image.begin(), 1 << 20, [&] { return char(random()); });
  std::ofstream(series / "IM1", std::ios::binary) << image;
  PackSeries(series, packed);
  w.services.upload_quota_bytes = 4 << 20;
  const std::string bytes = testing_support::Content(packed);
  w.services.has_room = [&](int64_t) { return w.FilesUnder("incoming") < 2; };  // the archive alone
  EXPECT_THROW(SendScan(w, subject, "pose00", bytes, "", "a.tar.gz"), DiskNearlyFull);
  EXPECT_EQ(w.FilesUnder("blobs") + w.FilesUnder("incoming"), 0u);
  w.services.has_room = [](int64_t) { return true; };
  EXPECT_EQ(SendScan(w, subject, "pose00", bytes, "", "a.tar.gz").status, 201);
}

TEST(Uploads, WhoseNameIsTakenMeanwhileLeavesNothing) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  w.inspector.meanwhile = [&] { SendScan(w, subject, "pose00", "VOXELS of the faster one"); };
  EXPECT_THROW(SendScan(w, subject, "pose00", "VOXELS of the slower one"), Conflict);
  EXPECT_EQ(w.FilesUnder("blobs") + w.FilesUnder("incoming"), 1u);
}

TEST(Uploads, ADicomImageMayBeAScanOrALabelMap) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const Json scan = Json::parse(SendScan(w, subject, "pose00", "VOXELS", "", "IM0001.DCM").body);
  EXPECT_EQ(w.catalogue.RequireScan(scan["id"]).file.suffix, ".dcm");
  const auto bones = [&](const std::string& name) {
    return Upload::OfBones(w.services, subject, {{"template", "pose00"}, {"filename", name}}, "");
  };
  EXPECT_THROW(bones("b.zip"), InputError);
  Upload segmentation = bones("b.dcm");
  segmentation.Write(std::string("VOXELS"));
  const Json made = Json::parse(segmentation.Finish().body);
  EXPECT_EQ(w.catalogue.RequireBones(made["id"]).file.suffix, ".dcm");
}

TEST(Uploads, TheSameRequestAgainGetsTheSameAnswer) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const Answer first = SendScan(w, subject, "pose00", "VOXELS", "k");
  EXPECT_EQ(SendScan(w, subject, "pose00", "VOXELS", "k").body, first.body);
  EXPECT_THROW(SendScan(w, subject, "pose00", "VOXELS other", "k"), Conflict);
}

// A client that waits no longer sends it again while the first one is still looked at.
TEST(Uploads, APutThatIsSentTwiceAtTheSameTimeIsNoConflict) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const auto put_scan = [&] {
    Upload scan = Upload::OfScan(w.services, subject, {{"name", "pose02"}, {"filename", "a.nii"}}, "");
    scan.SameAgainIsFine();
    scan.Write(std::string("VOXELS2"));
    return scan.Finish();
  };
  const auto put_bones = [&] {
    Upload bones = Upload::OfBones(w.services, subject, {{"template", "pose01"}}, "");
    bones.SameAgainIsFine();
    bones.Write(std::string("VOXELS of bones"));
    return bones.Finish();
  };
  for (const auto& put : std::vector<std::function<Answer()>>{put_scan, put_bones}) {
    Answer overtaking;
    w.inspector.meanwhile = [&] { overtaking = put(); };
    const Answer overtaken = put();
    EXPECT_EQ(overtaking.status, 201);
    EXPECT_EQ(overtaken.status, 200);
    EXPECT_EQ(overtaken.location, overtaking.location);
  }
  EXPECT_EQ(w.catalogue.Bones(subject, {}).items.size(), 2u) << "that of pose00, and one";
}

// What the service has checked for one scan says nothing of where another lies.
TEST(Uploads, AKnownLabelMapIsRefusedForAScanThatLiesElsewhere) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const auto send_bones = [&](Query query, const std::string& bytes) {
    Upload bones = Upload::OfBones(w.services, subject, query, "");
    bones.Write(bytes);
    return bones.Finish();
  };
  SendScan(w, subject, "here", "VOXELS0");
  EXPECT_EQ(send_bones({{"template", "here"}}, "VOXELSb").status, 201);
  w.inspector.origin.lps = {500, 0, 0};
  SendScan(w, subject, "elsewhere", "VOXELS1");
  EXPECT_THROW(send_bones({{"template", "elsewhere"}}, "VOXELSb"), InputError);
  EXPECT_THROW(send_bones({{"template", "elsewhere"}, {"sha256", Sha256("VOXELSb").Hex()}}, ""), InputError);
  EXPECT_FALSE(w.catalogue.LatestBones(subject, "elsewhere"));
}

// The names of its bones are those of the region.
TEST(Uploads, AKnownLabelMapIsLookedAtAnewForAnotherRegion) {
  ServiceWorld w;
  const auto first_bone = [&](const std::string& region, const Query& more, const std::string& bytes) {
    const std::string subject =
        Field(CreateSubject(w.services, R"({"region":")" + region + R"("})", "").body, "id");
    SendScan(w, subject, "pose00", "VOXELS0");
    Query query{{"template", "pose00"}};
    query.insert(more.begin(), more.end());
    Upload bones = Upload::OfBones(w.services, subject, query, "");
    bones.Write(bytes);
    return Json::parse(bones.Finish().body)["list"][0]["name"].get<std::string>();
  };
  const Query announced{{"sha256", Sha256("VOXELSb").Hex()}};
  EXPECT_EQ(first_bone("hand", {}, "VOXELSb"), "hand");
  EXPECT_EQ(first_bone("hand", announced, ""), "hand");
  EXPECT_THROW(first_bone("knee", announced, ""), NotFound) << "it is to be sent";
  EXPECT_EQ(first_bone("knee", {}, "VOXELSb"), "knee");
  EXPECT_EQ(first_bone("knee", announced, ""), "knee");
  EXPECT_EQ(w.FilesUnder("blobs"), 2u) << "the bytes lie once";
}

TEST(Uploads, BytesThatCameAsOneFormatAreNotKnownAsAnother) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const auto kept_as = [&](const std::string& name, const std::string& filename) {
    const Answer answer = SendScan(w, subject, name, "VOXELS", "", filename);
    return w.catalogue.RequireScan(Field(answer.body, "id")).file.suffix;
  };
  EXPECT_EQ(kept_as("pose00", "a.nii"), ".nii");
  EXPECT_EQ(kept_as("pose01", "b.nrrd"), ".nrrd");
  EXPECT_EQ(kept_as("pose02", "c.nii"), ".nii");
}

// A disk that lost a file: the record alone is no reason to do without the bytes.
TEST(Uploads, BytesThatAreGoneFromTheDiskAreKeptAnew) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const auto file_of = [&](const Answer& answer) {
    return w.blobs.PathOf(w.catalogue.RequireScan(Field(answer.body, "id")).file.content);
  };
  const auto first = file_of(SendScan(w, subject, "pose00", "VOXELS"));
  ASSERT_TRUE(std::filesystem::remove(first));
  const auto second = file_of(SendScan(w, subject, "pose01", "VOXELS"));
  EXPECT_EQ(testing_support::Content(second), "VOXELS");
}

TEST(Uploads, PreviousGoesWithStrokesAlone) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const auto refusal = [&](const Query& query) {
    return RefusalOf([&] { Upload::OfBones(w.services, subject, query, ""); });
  };
  EXPECT_THAT(refusal({{"template", "pose00"}, {"previous", "job_1"}}), testing::HasSubstr("'previous'"));
  EXPECT_EQ(refusal({{"template", "pose00"}, {"previous", "job_1"}, {"kind", "seeds"}}), "");
}

}  // namespace
}  // namespace kvx
