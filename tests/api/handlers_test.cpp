// Handlers as plain functions over real storage and fake ports.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "api/errors.h"
#include "api/handlers/animations.h"
#include "api/handlers/jobs.h"
#include "api/handlers/posed_points.h"
#include "api/handlers/posed_volumes.h"
#include "api/handlers/registration.h"
#include "api/handlers/scans.h"
#include "api/handlers/slice_query.h"
#include "api/handlers/slices.h"
#include "api/handlers/surfaces.h"
#include "api/point_list.h"
#include "tests/support/service_world.h"

namespace kvx {
namespace {

using testing_support::ServiceWorld;

std::string Field(const std::string& json, const std::string& field) { return Json::parse(json)[field]; }

Answer SendScan(ServiceWorld& w, const std::string& subject, const std::string& name,
                const std::string& bytes, const std::string& key = "",
                const std::string& filename = "a.nii.gz") {
  Upload upload = Upload::OfScan(w.services, subject, {{"name", name}, {"filename", filename}}, key);
  upload.Write(bytes);
  return upload.Finish();
}

std::string NewSubjectId(ServiceWorld& w) {
  return Field(CreateSubject(w.services, R"({"region":"knee"})", "").body, "id");
}

std::string SubjectWithScans(ServiceWorld& w) {
  const std::string subject = NewSubjectId(w);
  SendScan(w, subject, "pose00", "VOXELS0");
  SendScan(w, subject, "pose01", "VOXELS1");
  Upload bones = Upload::OfBones(w.services, subject, {{"template", "pose00"}}, "");
  bones.Write(std::string("VOXELSb"));
  bones.Finish();
  return subject;
}

std::string BuiltModel(ServiceWorld& w) {
  const std::string subject = SubjectWithScans(w);
  const Answer answer =
      CreateModel(w.services, R"({"subject":")" + subject + R"(","template":"pose00"})", "");
  const std::string model = Field(answer.body, "id");
  w.jobs.Succeed(*w.jobs.Claim("w"), "{}", [&] { w.catalogue.SetModelDigest(model, "d1"); });
  return model;
}

std::string RefusalOf(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(Subjects, AreCheckedAndRepeatable) {
  ServiceWorld w;
  const Answer first = CreateSubject(w.services, R"({"region":"hand","external_id":"e1"})", "k");
  EXPECT_EQ(first.status, 201);
  EXPECT_EQ(first.location, "/v1/subjects/" + Field(first.body, "id"));
  EXPECT_EQ(CreateSubject(w.services, R"({"region":"hand","external_id":"e1"})", "k").body, first.body);
  EXPECT_THROW(CreateSubject(w.services, R"({"region":"knee"})", "k"), Conflict);
  EXPECT_THROW(CreateSubject(w.services, R"({"region":"hand","external_id":"e1"})", ""), Conflict);
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

TEST(Uploads, ADicomImageMayBeAScanButNoLabelMap) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const Json scan = Json::parse(SendScan(w, subject, "pose00", "VOXELS", "", "IM0001.DCM").body);
  EXPECT_EQ(w.catalogue.RequireScan(scan["id"]).file.suffix, ".dcm");
  EXPECT_THROW(Upload::OfBones(w.services, subject, {{"template", "pose00"}, {"filename", "b.dcm"}}, ""),
               InputError);
}

TEST(Uploads, TheSameRequestAgainGetsTheSameAnswer) {
  ServiceWorld w;
  const std::string subject = NewSubjectId(w);
  const Answer first = SendScan(w, subject, "pose00", "VOXELS", "k");
  EXPECT_EQ(SendScan(w, subject, "pose00", "VOXELS", "k").body, first.body);
  EXPECT_THROW(SendScan(w, subject, "pose00", "VOXELS other", "k"), Conflict);
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

TEST(Models, BecomeAJobOverTheUploadedFiles) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const std::string body =
      R"({"subject":")" + subject + R"(","template":"pose00","options":{"method":"adaptive"}})";
  const Answer answer = CreateModel(w.services, body, "k");
  EXPECT_EQ(answer.status, 202);
  const ClaimedJob job = *w.jobs.Claim("w");
  EXPECT_EQ(answer.location, "/v1/jobs/" + job.id);
  const BuildTask task = TaskOf(w.blobs, job.model, job.request);
  EXPECT_EQ(task.method.name, "adaptive");
  ASSERT_EQ(task.files.size(), 3u);
  for (const StudyFile& file : task.files) EXPECT_TRUE(std::filesystem::exists(file.content));
  const Json study = Json::parse(task.study);
  EXPECT_EQ(study["region"], "knee");
  EXPECT_EQ(study["scans"][1]["volume"], "scans/pose01.nii.gz");
  EXPECT_EQ(CreateModel(w.services, body, "k").body, answer.body);
  EXPECT_FALSE(w.jobs.Claim("w")) << "the repeated request makes no second job";
}

TEST(Models, TheTemplateIsOneOfTheScansThatAreChosen) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const std::string body = R"({"subject":")" + subject + R"(","template":"pose00","scans":["pose01"]})";
  EXPECT_EQ(CreateModel(w.services, body, "k").status, 202);
  const ClaimedJob job = *w.jobs.Claim("w");
  const Json study = Json::parse(TaskOf(w.blobs, job.model, job.request).study);
  ASSERT_EQ(study["scans"].size(), 2u);
  EXPECT_EQ(study["scans"][0]["name"], "pose00");
  EXPECT_EQ(study["scans"][1]["name"], "pose01");
}

TEST(Models, ThePublishedMethodIsBuiltWithItsLimits) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const std::string body = R"({"subject":")" + subject +
                           R"(","template":"pose00","options":{"method":"paper","max_blocks":20,"seed":7}})";
  EXPECT_EQ(CreateModel(w.services, body, "k").status, 202);
  const ClaimedJob job = *w.jobs.Claim("w");
  const BuildTask task = TaskOf(w.blobs, job.model, job.request);
  EXPECT_EQ(task.method.name, "paper");
  EXPECT_EQ(task.method.max_blocks, 20);
  EXPECT_EQ(task.method.max_seconds, 0);
  EXPECT_EQ(task.method.seed, 7);
}

TEST(Models, AreCheckedBeforeTheyAreQueued) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const auto create = [&](const std::string& rest) {
    return RefusalOf(
        [&] { CreateModel(w.services, R"({"subject":")" + subject + R"(",)" + rest + "}", ""); });
  };
  EXPECT_THAT(create(R"("template":"pose09")"), testing::HasSubstr("'template'"));
  EXPECT_THAT(create(R"("template":"pose00","scans":["pose00","x"])"), testing::HasSubstr("scans[1]"));
  EXPECT_THAT(create(R"("template":"pose00","colour":1)"), testing::HasSubstr("'colour'"));
  EXPECT_THAT(create(R"("template":"pose00","options":{"method":"x"})"), testing::HasSubstr("'method'"));
  EXPECT_THAT(create(R"("template":"pose00","options":{"max_blocks":3})"),
              testing::HasSubstr("'max_blocks'"));
  EXPECT_THAT(create(R"("template":"pose00","options":{"method":"paper","seed":1.5})"),
              testing::HasSubstr("'seed'"));
  EXPECT_THAT(create(R"("template":"pose00","options":{"method":"paper","max_seconds":-1})"),
              testing::HasSubstr("'max_seconds'"));
  EXPECT_THAT(create(R"("template":"pose00","bones":[{"label":99,"name":"femur","parent":null}])"),
              testing::HasSubstr("99"));
  for (const char* bones : {"5", "true", R"("")"})
    EXPECT_THAT(create(R"("template":"pose00","bones":)" + std::string(bones)),
                testing::HasSubstr("'bones' is an id"));
  EXPECT_THAT(create(R"("template":"pose00","joints":[{"child":"xx","dofs":["flexion"]}])"),
              testing::HasSubstr("xx"));
  EXPECT_THAT(create(R"("template":"pose00","joints":[{"child":"tibia","dofs":1,"axis":[1,0,0]}])"),
              testing::HasSubstr("'axis'"));
  EXPECT_THAT(create(R"("template":"pose00","initial_poses":{"pose01":{"tib":[]}})"),
              testing::HasSubstr("tib"));
  for (const char* priority : {"101", "-101", "1.5", "18446744073709551615", "18446744073709551516"})
    EXPECT_THAT(create(R"("template":"pose00","priority":)" + std::string(priority)),
                testing::HasSubstr("'priority'"))
        << priority;
  w.builder.refuse = true;
  EXPECT_THAT(create(R"("template":"pose00")"), testing::HasSubstr("joints"));
  EXPECT_EQ(w.jobs.Count("queued"), 0);
}

TEST(Volumes, AreComputedOnceAndKnownByTheirEtag) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const Query query{{"tibia.flexion", "35"}, {"format", "nrrd"}};
  const FileAnswer first = GetVolume(w.services, model, query, "", "");
  const FileAnswer again =
      GetVolume(w.services, model, {{"tibia.flexion", "35.0"}, {"format", "nrrd"}}, "", "");
  EXPECT_EQ(again.etag, first.etag);
  EXPECT_EQ(w.poser.volumes, 1);
  EXPECT_TRUE(GetVolume(w.services, model, query, "", "W/\"x\", " + first.etag).not_modified);
  EXPECT_EQ(GetVolume(w.services, model, {{"format", "nrrd"}}, R"({"joints":{"tibia.flexion":35}})", "").etag,
            first.etag);
  for (const Query& other :
       {Query{{"tibia.flexion", "36"}, {"format", "nrrd"}}, Query{{"tibia.flexion", "35"}},
        Query{{"tibia.flexion", "35"}, {"format", "nrrd"}, {"level", "1"}},
        Query{{"tibia.flexion", "35"}, {"format", "nrrd"}, {"label", "true"}},
        Query{{"tibia.flexion", "35"}, {"format", "nrrd"}, {"mode", "vbd"}}}) {
    EXPECT_NE(GetVolume(w.services, model, other, "", "").etag, first.etag);
  }
}

TEST(Volumes, RawOnesCarryTheirGeometryInHeaders) {
  ServiceWorld w;
  const FileAnswer answer = GetVolume(w.services, BuiltModel(w), {{"format", "raw"}}, "", "");
  EXPECT_EQ(answer.file->size() - answer.offset, 2u);
  EXPECT_THAT(answer.headers, testing::Contains(testing::Pair("X-Kinevox-Size", "2,1,1")));
  EXPECT_THAT(answer.headers, testing::Contains(testing::Pair("X-Kinevox-Type", "uint8")));
}

TEST(Volumes, UnknownParametersAreNamed) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const auto refusal = [&](const Query& query) {
    return RefusalOf([&] { GetVolume(w.services, model, query, "", ""); });
  };
  EXPECT_THAT(refusal({{"colour", "red"}}), testing::HasSubstr("'colour'"));
  EXPECT_THAT(refusal({{"label", "femur"}}), testing::HasSubstr("'label' is true or false"));
  EXPECT_THAT(refusal({{"tibia.flexion", "steep"}}), testing::HasSubstr("tibia.flexion"));
  EXPECT_THAT(refusal({{"tibia.flexion", "nan"}}), testing::HasSubstr("tibia.flexion"));
  EXPECT_THAT(refusal({{"tibia.twist", "1"}}), testing::HasSubstr("there is tibia.flexion"));
  EXPECT_THAT(refusal({{"format", "jpg"}}), testing::HasSubstr("'format'"));
  EXPECT_THAT(refusal({{"level", "99"}}), testing::HasSubstr("'level'"));
  EXPECT_THAT(refusal({{"scan", "pose01"}, {"tibia.flexion", "1"}}), testing::HasSubstr("not both"));
  EXPECT_THROW(GetVolume(w.services, "mdl_none", {}, "", ""), NotFound);
}

TEST(Volumes, OfAModelThatIsNotBuiltConflict) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const Answer answer =
      CreateModel(w.services, R"({"subject":")" + subject + R"(","template":"pose00"})", "");
  EXPECT_THROW(GetVolume(w.services, Field(answer.body, "id"), {}, "", ""), Conflict);
}

TEST(Volumes, RawAndNiiComeInTheCodingThatTheClientPrefers) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  Conditions zstd, gzip;
  zstd.accept_encoding = "gzip, zstd", gzip.accept_encoding = "gzip";
  const Query nii{{"format", "nii"}};
  const FileAnswer plain = GetVolume(w.services, model, nii, "", ""),
                   packed = GetVolume(w.services, model, nii, "", zstd);
  EXPECT_NE(packed.etag, plain.etag) << "a coding has bytes of its own";
  EXPECT_LT(packed.file->size(), plain.file->size());
  EXPECT_THAT(packed.headers, testing::Contains(testing::Pair("Content-Encoding", "zstd")));
  EXPECT_THAT(plain.headers, testing::Contains(testing::Pair("Vary", "Accept-Encoding")));
  EXPECT_EQ(w.poser.volumes, 1) << "packed from the plain one";
  const FileAnswer raw = GetVolume(w.services, model, {{"format", "raw"}}, "", gzip);
  EXPECT_THAT(raw.headers, testing::Contains(testing::Pair("Content-Encoding", "gzip")));
  EXPECT_THAT(raw.headers, testing::Contains(testing::Pair("X-Kinevox-Size", "2,1,1")));
  const FileAnswer packed_already = GetVolume(w.services, model, {{"format", "nii.gz"}}, "", gzip);
  EXPECT_THAT(packed_already.headers, testing::Not(testing::Contains(testing::Key("Content-Encoding"))));
}

// Minutes of work, and a place among the few that pose.
TEST(Posing, AFieldOrARegistrationThatNobodyWaitsForIsNotMade) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  Conditions gone;
  gone.abandoned = [] { return true; };
  EXPECT_THROW(GetField(w.services, model, {}, "", gone), Cancelled);
  EXPECT_THROW(GetRegistration(w.services, model, {{"scan", "pose01"}}, gone), Cancelled);
}

TEST(Posing, ADicomSeriesIsOfOurIdsAndSaysItsModality) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const auto series = [&](const Query& more) {
    Query query{{"format", "dicom"}};
    query.insert(more.begin(), more.end());
    return GetVolume(w.services, model, query, "", "");
  };
  const FileAnswer mr = series({{"modality", "MR"}});
  EXPECT_EQ(mr.content_type, "application/zip");
  EXPECT_EQ(mr.filename, model + ".zip");
  std::string text(size_t(mr.file->size()), ' ');
  mr.file->ReadAt(0, text.data(), text.size());
  EXPECT_THAT(text,
              testing::HasSubstr("series of " + w.services.catalogue.RequireModel(model).subject + " as MR"));
  EXPECT_NE(series({}).etag, mr.etag);
  EXPECT_THAT(RefusalOf([&] { series({{"modality", "US"}}); }), testing::HasSubstr("MR or CT"));
  EXPECT_THAT(RefusalOf([&] { series({{"label", "true"}}); }), testing::HasSubstr("labels"));
  EXPECT_THAT(RefusalOf([&] {
                GetVolume(w.services, model, {{"modality", "MR"}}, "", "");
              }),
              testing::HasSubstr("format=dicom"));
}

TEST(Products, SlicesAndSurfacesAreNamedByWhatTheyShow) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const Query query{{"axis", "coronal"}, {"mm", "12.5"}, {"tibia.flexion", "35"}};
  const FileAnswer slice = GetSlice(w.services, model, query, "", "");
  EXPECT_EQ(slice.content_type, "image/png");
  std::string text(slice.file->size(), ' ');
  slice.file->ReadAt(0, text.data(), text.size());
  EXPECT_EQ(text, "slice coronal 12.5 35");
  EXPECT_TRUE(GetSlice(w.services, model, query, "", slice.etag).not_modified);
  for (const auto& other :
       {std::pair{"mm", "12.6"}, {"window", "0,10"}, {"projection", "max"}, {"pixel_mm", "2"}}) {
    Query changed = query;
    changed.erase(other.first);
    changed.emplace(other.first, other.second);
    EXPECT_NE(GetSlice(w.services, model, changed, "", "").etag, slice.etag) << other.first;
  }
  const auto refusal = [&](const Query& q) {
    return RefusalOf([&] { GetSlice(w.services, model, q, "", ""); });
  };
  EXPECT_THAT(refusal({{"window", "5,1"}}), testing::HasSubstr("'window'"));
  EXPECT_THAT(refusal({{"centre", "1,2"}}), testing::HasSubstr("'centre'"));
  EXPECT_THAT(refusal({{"centre", "1,2,3"}}), testing::HasSubstr("'right'"));
  EXPECT_THAT(refusal({{"colour", "1"}}), testing::HasSubstr("'colour'"));
  EXPECT_THAT(refusal({{"slab_mm", "5"}}), testing::HasSubstr("projection"));
  const FileAnswer glb =
      GetSurface(w.services, model, {{"bone", "tibia"}}, R"({"joints":{"tibia.flexion":35}})", "");
  EXPECT_EQ(glb.content_type, "model/gltf-binary");
  EXPECT_NE(GetSurface(w.services, model, {{"bone", "tibia"}, {"format", "stl"}}, "", "").etag, glb.etag);
  EXPECT_THROW(GetSurface(w.services, model, {{"bone", "tail"}}, "", ""), NotFound);
  EXPECT_THROW(GetSurface(w.services, model, {{"format", "obj"}}, "", ""), InputError);
}

TEST(Products, ASurfaceIsOfWhatIsChosenEachOnce) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const auto shown = [&](const Query& query) {
    const FileAnswer answer = GetSurface(w.services, model, query, "", "");
    std::string text(answer.file->size(), ' ');
    answer.file->ReadAt(0, text.data(), text.size());
    return text.substr(0, text.find('.') - 1);
  };
  EXPECT_EQ(shown({}), "glTF 0") << "everything";
  EXPECT_EQ(shown({{"skin", "false"}}), "glTF no skin 0") << "all bones";
  EXPECT_EQ(shown({{"skin", "true"}}), "glTF skin 0") << "the skin alone";
  EXPECT_EQ(shown({{"bone", "tibia,tibia"}}), "glTF 1");
  EXPECT_EQ(shown({{"bone", "tibia"}, {"skin", "true"}}), "glTF skin 1");
}

TEST(Products, AnAnimationIsAJobAndThenAFile) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const std::string body = R"({"frames":[{"time":0,"joints":{}}]})";
  const Answer accepted = CreateAnimation(w.services, model, {{"format", "nii"}}, body, "key");
  EXPECT_EQ(accepted.status, 202);
  const std::string id = Field(accepted.body, "job");
  EXPECT_EQ(accepted.location, "/v1/jobs/" + id);
  EXPECT_EQ(CreateAnimation(w.services, model, {{"format", "nii"}}, body, "key").body, accepted.body);
  EXPECT_THROW(GetAnimation(w.services, model, id, ""), Conflict);
  const ClaimedJob job = *w.jobs.Claim("w");
  EXPECT_EQ(job.kind, "animation");
  w.jobs.Succeed(job, MakeAnimation(w.services, job, {}));
  const int checked = w.poser.animations_checked;
  const FileAnswer file = GetAnimation(w.services, model, id, "");
  EXPECT_EQ(w.poser.animations_checked, checked);  // a finished animation needs no model
  EXPECT_EQ(file.file->size(), std::string("three frames as nii").size());
  EXPECT_THROW(GetAnimation(w.services, "mdl_other", id, ""), NotFound);
  EXPECT_THROW(CreateAnimation(w.services, model, {}, "{}", ""), InputError);
  EXPECT_THROW(CreateAnimation(w.services, model, {{"tibia.flexion", "3"}}, body, ""), InputError);
}

TEST(Products, AnAnimationTakesTheViewThatIsAskedOrRefusesIt) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const auto refusal = [&](Query query, const char* format) {
    query.emplace("format", format);
    return RefusalOf(
        [&] { CreateAnimation(w.services, model, query, R"({"frames":[{"time":0,"joints":{}}]})", ""); });
  };
  EXPECT_EQ(refusal({{"projection", "mean"}, {"slab_mm", "5"}}, "mp4"), "");
  EXPECT_EQ(refusal({{"slab_mm", "5"}}, "mp4"), "") << "of the projection that a video is by itself";
  EXPECT_THAT(refusal({{"axis", "coronal"}, {"slab_mm", "5"}}, "mp4"), testing::HasSubstr("'slab_mm'"));
  for (const char* name : {"slab_mm", "width_mm", "mm"})
    EXPECT_THAT(refusal({{name, "5"}}, "nii"), testing::HasSubstr("volumes show everything")) << name;
  EXPECT_THAT(refusal({{"axis", "axial"}}, "nii.gz"), testing::HasSubstr("volumes show everything"));
}

TEST(Products, AVideoAcrossTheUsualAxisIsNotOneThatNamesNone) {
  EXPECT_TRUE(ViewOf({{"axis", "axial"}}).NamesPlane());
  EXPECT_FALSE(ViewOf({{"slab_mm", "5"}}).NamesPlane());
  Hasher named, usual;
  AddView(named, ViewOf({{"axis", "axial"}}));
  AddView(usual, ViewOf({}));
  EXPECT_EQ(named.Finish(), usual.Finish()) << "of slices they are the same";
}

TEST(Points, CsvKeepsOrderAndFurtherColumns) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const PointsAnswer csv = MapPoints(w.services, model, {{"tibia.flexion", "10"}}, "text/csv", "",
                                     "x,y,z,name,more\r\n1,2,3,\"a, b\",7\r\n-0.5,0,1e3,,\r\n");
  EXPECT_EQ(csv.body, "x,y,z,name,more\n11,2,3,\"a, b\",7\n9.5,0,1000,,\n");
  const PointsAnswer json = MapPoints(w.services, model, {}, "application/json", "",
                                      R"({"points":[[1,2,3]],"pose":{"joints":{"tibia.flexion":35}}})");
  EXPECT_EQ(json.body, R"({"points":[[36.0,2.0,3.0]]})");
  EXPECT_THAT(RefusalOf([] { PointsOfCsv("x,y,z\n1,2,3\n1,,3\n"); }), testing::HasSubstr("line 3"));
  EXPECT_THROW(PointsOfCsv("a,b,c\n"), InputError);
  EXPECT_THROW(PointsOfJson(R"({"points":[[1,2]]})"), InputError);
}

TEST(Points, AreCountedBeforeTheyTakeMemory) {
  std::string empty_ones = R"({"points":[)", keys = R"({"pose":{)", most = R"({"points":[[0,0,0])";
  for (int i = 0; i < 2'010'000; ++i) empty_ones += "[],";
  for (int i = 0; i < 100'001; ++i) keys += "\"\":0,";
  for (int i = 1; i < 2'000'000; ++i) most += ",[0,0,0]";
  EXPECT_THAT(RefusalOf([&] { PointsOfJson(empty_ones); }), testing::HasSubstr("more values"));
  EXPECT_THAT(RefusalOf([&] { PointsOfJson(keys); }), testing::HasSubstr("more values"));
  EXPECT_EQ(PointsOfJson(most + R"(],"pose":{"joints":{"tibia.flexion":35}}})").table.points.size(),
            2'000'000u);
  ServiceWorld w;
  EXPECT_THROW(MapPoints(w.services, "mdl_none", {}, "application/json", "", "no JSON"), NotFound);
}

TEST(Problems, OneTableFromErrorToStatus) {
  const auto status = [](auto error) { return ToProblem(std::make_exception_ptr(error)).status; };
  EXPECT_EQ(status(InputError("x")), 400);
  EXPECT_EQ(status(NotFound("x")), 404);
  EXPECT_EQ(status(Conflict("x")), 409);
  EXPECT_EQ(status(QuotaExceeded("x")), 413);
  EXPECT_EQ(status(UnsupportedMedia("x")), 415);
  EXPECT_EQ(status(Unavailable("x")), 503);
  const Problem ours = ToProblem(std::make_exception_ptr(std::runtime_error("/secret/path")));
  EXPECT_EQ(ours.status, 500);
  EXPECT_EQ(ours.detail.find("secret"), std::string::npos);
}

TEST(Jobs, EventsCarryTheJobAsItWasThen) {
  ServiceWorld w;
  const std::string id = w.jobs.Submit({"build_model", "mdl", "{}"}).id;
  const ClaimedJob job = *w.jobs.Claim("w");
  w.jobs.Report(job, "load", 0.5);
  const EventBatch running = NextEvents(w.services, id, 0);
  EXPECT_FALSE(running.ended);
  EXPECT_THAT(running.text, testing::HasSubstr(R"("stage":"load","progress":0.5)"));
  w.jobs.Succeed(job, R"({"model":"mdl"})");
  const EventBatch last = NextEvents(w.services, id, running.last);
  EXPECT_TRUE(last.ended);
  EXPECT_THAT(last.text, testing::HasSubstr(R"("result":{"model":"mdl"})"));
  EXPECT_TRUE(NextEvents(w.services, id, last.last).ended);
}

// A job that ends between the look at its events and the look at itself has one event more.
TEST(Jobs, TheLastEventIsToldHoweverTheJobEndsMeanwhile) {
  ServiceWorld w;
  for (int round = 0; round < 150; ++round) {
    const std::string id = w.jobs.Submit({"build_model", "mdl_1", "{}"}).id;
    const ClaimedJob claimed = *w.jobs.Claim("a");
    std::string text;
    std::thread worker([&] { w.jobs.Succeed(claimed, "{}"); });
    for (EventBatch batch{"", 0, false}; !batch.ended;) {
      batch = NextEvents(w.services, id, batch.last);
      text += batch.text;
    }
    worker.join();
    ASSERT_THAT(text, testing::HasSubstr(R"("state":"succeeded")")) << "round " << round;
  }
}

}  // namespace
}  // namespace kvx
