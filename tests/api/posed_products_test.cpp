// What a built model is posed to: volumes, slices, surfaces, animations, points.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/handlers/animations.h"
#include "api/handlers/posed_points.h"
#include "api/handlers/posed_volumes.h"
#include "api/handlers/registration.h"
#include "api/handlers/slice_query.h"
#include "api/handlers/slices.h"
#include "api/handlers/surfaces.h"
#include "api/point_list.h"
#include "tests/support/handler_requests.h"

namespace kvx {
namespace {

using testing_support::BuiltModel;
using testing_support::Field;
using testing_support::RefusalOf;
using testing_support::ServiceWorld;
using testing_support::SubjectWithScans;

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
        Query{{"tibia.flexion", "35"}, {"format", "nrrd"}, {"mode", "vbd"}},
        Query{{"tibia.flexion", "35"}, {"format", "nrrd"}, {"mode", "elastic"}}}) {
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
  w.services.abandoned = [] { return true; };
  EXPECT_THROW(GetField(w.services, model, {}, "", {}), Cancelled);
  EXPECT_THROW(GetRegistration(w.services, model, {{"scan", "pose01"}}, {}), Cancelled);
  AskedPoints points = ReadPoints(w.services, model, {}, "text/csv", "x,y,z\n1,2,3\n");
  EXPECT_THROW(PosePoints(w.services, points), Cancelled);
}

TEST(Posing, APoseIsAskedForInTheNameOfItsProject) {
  ServiceWorld w;
  w.services.project = "lab";
  EXPECT_EQ(PosedQueryOf(w.services, "mdl_x", {}, {}, "").asker.project, "lab");
}

TEST(Posing, FilesOfDifferentPosesHaveDifferentNames) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const auto name = [&](const Query& query, const Conditions& conditions) {
    return GetVolume(w.services, model, query, "", conditions).filename;
  };
  const std::string one = name({{"tibia.flexion", "35"}}, {}), other = name({{"tibia.flexion", "36"}}, {});
  EXPECT_THAT(one, testing::MatchesRegex(model + "\\.[0-9a-f]+\\.nii\\.gz"));
  EXPECT_NE(one, other);
  EXPECT_EQ(one, name({{"tibia.flexion", "35"}}, {}));
  Conditions coded;
  coded.accept_encoding = "gzip";
  const Query raw{{"tibia.flexion", "35"}, {"format", "raw"}};
  EXPECT_EQ(name(raw, coded), name(raw, {})) << "the same voxels";
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
  EXPECT_THAT(mr.filename, testing::MatchesRegex(model + "\\.[0-9a-f]+\\.zip"));
  std::string text(size_t(mr.file->size()), ' ');
  mr.file->ReadAt(0, text.data(), text.size());
  EXPECT_THAT(text,
              testing::HasSubstr("series of " + w.services.catalogue.RequireModel(model).subject + " as MR"));
  EXPECT_NE(series({}).etag, mr.etag);
  EXPECT_NE(series({{"modality", "CT"}}).etag, mr.etag);
  EXPECT_NE(series({{"scan", "pose01"}}).etag, series({}).etag) << "the same voxels in another frame";
  EXPECT_EQ(GetVolume(w.services, model, {{"scan", "pose01"}, {"format", "nrrd"}}, "", "").etag,
            GetVolume(w.services, model, {{"format", "nrrd"}}, "", "").etag);
  EXPECT_THAT(RefusalOf([&] { series({{"modality", "US"}}); }), testing::HasSubstr("MR or CT"));
  const FileAnswer bones = series({{"label", "true"}});
  EXPECT_EQ(bones.content_type, "application/dicom");
  EXPECT_THAT(bones.filename, testing::MatchesRegex(model + "\\.[0-9a-f]+\\.dcm"));
  EXPECT_NE(bones.etag, series({}).etag);
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
  std::string text(slice.file->size() - slice.offset, ' ');
  slice.file->ReadAt(slice.offset, text.data(), text.size());
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

// A worker has no results of its own in which it would find what it, or another worker, has put there.
TEST(Products, WorkersMakeEqualAnimationsOnce) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  w.data.LetWorkersIn();
  Stores stores(w.scratch.path(), {.use = DataFolder::Use::kWorker});
  Services worker = ServicesOver(stores, w.inspector, w.builder, w.poser);
  for (int time = 0; time < 2; ++time) {
    CreateAnimation(w.services, model, {{"format", "nii"}}, R"({"frames":[{"time":0,"joints":{}}]})", "");
    const ClaimedJob job = *worker.jobs.Claim("w");
    worker.jobs.Succeed(job, MakeAnimation(worker, job, {}));
    EXPECT_EQ(GetAnimation(w.services, model, job.id, "").file->size(),
              std::string("three frames as nii").size());
  }
  EXPECT_EQ(w.poser.animations, 1);
}

TEST(Products, OfAMotionThatIsIndentedNoBlanksAreKept) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const auto kept = [&](const std::string& body) {
    const std::string job = Field(CreateAnimation(w.services, model, {}, body, "").body, "job");
    return Field(w.jobs.RequestOf(job), "key_frames");
  };
  const std::string dense = R"({"frames":[{"joints":{},"time":0}]})";
  EXPECT_EQ(kept(Json::parse(dense).dump(40)), dense);
  EXPECT_EQ(kept("time, frames\n 0, 1\n"), "time, frames\n 0, 1\n") << "a table";
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

// Of a service before, whose kept slices go on being found.
TEST(Products, AViewKeepsTheDigestThatKeptSlicesAreNamedBy) {
  const auto digest = [](const Query& query) {
    Hasher hasher;
    AddView(hasher, ViewOf(query));
    return hasher.Finish().Hex().substr(0, 16);
  };
  EXPECT_EQ(digest({}), "f1316936d8e07b65");
  EXPECT_EQ(digest({{"axis", "coronal"}, {"mm", "2.5"}, {"window", "-50,150"}, {"level", "2"}}),
            "e633f6960d962a90");
  EXPECT_EQ(digest({{"centre", "1,2,3"},
                    {"right", "0,1,0"},
                    {"down", "0,0,-1"},
                    {"projection", "mean"},
                    {"slab_mm", "5"},
                    {"width_mm", "30"},
                    {"pixel_mm", "0.5"}}),
            "dd96faad05ce1a8d");
}

TEST(Products, AVideoAcrossTheUsualAxisIsNotOneThatNamesNone) {
  EXPECT_TRUE(ViewOf({{"axis", "axial"}}).NamesPlane());
  EXPECT_FALSE(ViewOf({{"slab_mm", "5"}}).NamesPlane());
  Hasher named, usual;
  AddView(named, ViewOf({{"axis", "axial"}}));
  AddView(usual, ViewOf({}));
  EXPECT_EQ(named.Finish(), usual.Finish()) << "of slices they are the same";
}

PointsAnswer MapPoints(ServiceWorld& w, const std::string& model, const Query& query, const std::string& type,
                       const std::string& accept, const std::string& body) {
  AskedPoints points = ReadPoints(w.services, model, query, type, body);
  PosePoints(w.services, points);
  return WritePoints(points, accept);
}

TEST(Points, CsvKeepsOrderAndFurtherColumns) {
  ServiceWorld w;
  const std::string model = BuiltModel(w);
  const PointsAnswer csv = MapPoints(w, model, {{"tibia.flexion", "10"}}, "text/csv", "",
                                     "x,y,z,name,more\r\n1,2,3,\"a, b\",7\r\n-0.5,0,1e3,,\r\n");
  EXPECT_EQ(csv.body, "x,y,z,name,more\n11,2,3,\"a, b\",7\n9.5,0,1000,,\n");
  const PointsAnswer json = MapPoints(w, model, {}, "application/json", "",
                                      R"({"points":[[1,2,3]],"pose":{"joints":{"tibia.flexion":35}}})");
  EXPECT_EQ(json.body, R"({"points":[[36.0,2.0,3.0]]})");
  const std::string nowhere = R"({"points":[[null,null,null]]})";
  EXPECT_EQ(MapPoints(w, model, {}, "text/csv", "application/json", "x,y,z\nnan,nan,nan\n").body, nowhere);
  EXPECT_EQ(MapPoints(w, model, {}, "application/json", "", nowhere).body, nowhere);
  EXPECT_THAT(RefusalOf([] { PointsOfCsv("x,y,z\n1,2,3\n1,,3\n"); }), testing::HasSubstr("line 3"));
  EXPECT_THROW(PointsOfCsv("a,b,c\n"), InputError);
  EXPECT_THAT(RefusalOf([] { PointsOfCsv(" {\"points\":[]}"); }), testing::HasSubstr("application/json"));
  EXPECT_THROW(PointsOfJson(R"({"points":[[1,2]]})"), InputError);
  EXPECT_THROW(PointsOfJson(R"({"points":[[1,null,3]]})"), InputError);
  EXPECT_THAT(RefusalOf([] { PointsOfJson(R"({"points":[[0,0,0],[1.7e308,-1.7e308,0]]})"); }),
              testing::HasSubstr("kilometre"));
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
  EXPECT_THROW(MapPoints(w, "mdl_none", {}, "application/json", "", "no JSON"), NotFound);
}

}  // namespace
}  // namespace kvx
