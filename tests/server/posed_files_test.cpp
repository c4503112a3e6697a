// Posed files over HTTP: validators, ranges, codings, and what their headers tell.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::ExpectProblem;
using testing_support::FakePoser;
using testing_support::RunningServer;

TEST(HttpServer, PosedVolumesAreCachedConditionalAndRanged) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/volume?tibia.flexion=35&format=nrrd";
  const auto whole = s.http.Get(path);
  ASSERT_EQ(whole->status, 200);
  EXPECT_EQ(whole->body, FakePoser::Content(35));
  const std::string etag = whole->get_header_value("ETag");
  EXPECT_TRUE(etag.starts_with('"'));
  EXPECT_EQ(whole->get_header_value("Cache-Control"), "private, no-cache")
      << "an upgrade may pose differently";
  const auto fresh = s.http.Get(path, httplib::Headers{{"If-None-Match", etag}});
  EXPECT_EQ(fresh->status, 304);
  EXPECT_TRUE(fresh->body.empty());
  EXPECT_EQ(fresh->get_header_value("ETag"), etag);
  const auto range = s.http.Get(path, httplib::Headers{{"Range", "bytes=100000-250009"}});
  EXPECT_EQ(range->status, 206);
  EXPECT_EQ(range->body, whole->body.substr(100000, 150010));
  EXPECT_EQ(range->get_header_value("Content-Range"),
            "bytes 100000-250009/" + std::to_string(whole->body.size()));
  const auto stale = s.http.Get(path, httplib::Headers{{"Range", "bytes=0-9"}, {"If-Range", "\"old\""}});
  EXPECT_EQ(stale->status, 200);
  EXPECT_EQ(stale->body.size(), whole->body.size());
  const auto head = s.http.Head(path);
  EXPECT_EQ(head->status, 200);
  EXPECT_EQ(head->get_header_value("Content-Length"), std::to_string(whole->body.size()));
  const auto beyond = s.http.Get(path, httplib::Headers{{"Range", "bytes=99999999-"}});
  ExpectProblem(beyond, 416);
  EXPECT_EQ(beyond->get_header_value("Content-Range"), "bytes */" + std::to_string(whole->body.size()));
  for (const char* name : {"ETag", "Content-Disposition", "Cache-Control"})
    EXPECT_FALSE(beyond->has_header(name)) << name << " is the file's, not the problem's";
  ExpectProblem(s.http.Get(path, httplib::Headers{{"If-Match", "\"old\""}}), 412);
  EXPECT_EQ(s.http.Get(path, httplib::Headers{{"If-Match", "\"old\", " + etag}})->status, 200);
  EXPECT_EQ(s.world.poser.volumes, 1);
  const auto posted = s.http.Post(path.substr(0, path.find('?')) + "?format=nrrd",
                                  R"({"joints":{"tibia.flexion":35}})", "application/json");
  EXPECT_EQ(posted->get_header_value("ETag"), etag);
}

TEST(HttpServer, CodingsAreNegotiatedAndNeverMixedWithRanges) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/volume?format=nii";
  const auto plain = s.http.Get(path, httplib::Headers{{"Accept-Encoding", "identity"}});
  EXPECT_FALSE(plain->has_header("Content-Encoding"));
  EXPECT_EQ(plain->get_header_value("Vary"), "Accept-Encoding");
  s.http.set_decompress(false);
  const auto packed = s.http.Get(path, httplib::Headers{{"Accept-Encoding", "gzip"}});
  EXPECT_EQ(packed->get_header_value("Content-Encoding"), "gzip");
  EXPECT_EQ(packed->body.substr(0, 2), "\x1f\x8b");
  EXPECT_LT(packed->body.size(), plain->body.size() / 2);
  EXPECT_NE(packed->get_header_value("ETag"), plain->get_header_value("ETag"));
  const auto range =
      s.http.Get(path, httplib::Headers{{"Accept-Encoding", "gzip"}, {"Range", "bytes=10-19"}});
  EXPECT_EQ(range->status, 206);
  EXPECT_EQ(range->body, plain->body.substr(10, 10));
  const auto whole =
      s.http.Get(path.substr(0, path.size() - 3) + "nii.gz", httplib::Headers{{"Accept-Encoding", "gzip"}});
  EXPECT_FALSE(whole->has_header("Content-Encoding")) << "what is packed already is not packed again";
  EXPECT_EQ(s.http.Get(path + "&level=5")->status, 200);
  ExpectProblem(s.http.Get(path + "&level=6"), 400);
}

TEST(HttpServer, SlicesAndSurfacesAreServedAsVolumesAre) {
  RunningServer s;
  const std::string model = "/v1/models/" + s.BuiltModel();
  const auto slice = s.http.Get(model + "/slice?axis=sagittal&mm=3&tibia.flexion=20");
  EXPECT_EQ(slice->get_header_value("Content-Type"), "image/png");
  EXPECT_EQ(slice->body, "slice sagittal 3 20");
  EXPECT_EQ(s.http
                .Get(model + "/slice?axis=sagittal&mm=3&tibia.flexion=20",
                     httplib::Headers{{"If-None-Match", slice->get_header_value("ETag")}})
                ->status,
            304);
  EXPECT_EQ(s.http.Head(model + "/surface?bone=tibia")->get_header_value("Content-Type"),
            "model/gltf-binary");
  const auto stl =
      s.http.Post(model + "/surface?format=stl", R"({"joints":{"tibia.flexion":35}})", "application/json");
  EXPECT_EQ(stl->body.substr(0, 4), "STL ");
  ExpectProblem(s.http.Get(model + "/surface?bone=tail"), 404);
  ExpectProblem(s.http.Get(model + "/surface?bone=,"), 400);
  ExpectProblem(s.http.Get(model + "/slice?format=jpg"), 400);
}

TEST(HttpServer, AnimationsAreJobsWithAFile) {
  RunningServer s;
  const std::string model = s.BuiltModel();
  const Json made =
      s.Post("/v1/models/" + model + "/animations?format=nii", {{"frames", Json::array({{{"time", 0}}})}});
  const Json job = s.WaitFor(made["job"]);
  ASSERT_EQ(job["state"], "succeeded") << job.dump();
  EXPECT_EQ(job["kind"], "animation");
  EXPECT_EQ(job["result"]["frames"], 3);
  const auto file = s.http.Get(job["result"]["content"].get<std::string>());
  EXPECT_EQ(file->body, "three frames as nii");
  EXPECT_TRUE(file->has_header("ETag"));
  ExpectProblem(s.http.Get("/v1/models/" + model + "/animations/job_none"), 404);
}

TEST(HttpServer, LabelMapsAreConvertedOneAtATime) {
  RunningServer s({}, false);
  const std::string path = "/v1/subjects/" + s.Subject() + "/bones/pose00/volume?format=nrrd";
  std::vector<std::thread> clients;
  std::atomic<int> served{0};
  for (int c = 0; c < 8; ++c) {
    clients.emplace_back([&] {
      httplib::Client http("127.0.0.1", s.server.port());
      const auto got = http.Get(path);
      served += got && got->status == 200;
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(served, 8);
  EXPECT_EQ(s.world.builder.most_converting, 1);
}

TEST(HttpServer, RawVolumesSayTheirGeometry) {
  RunningServer s;
  const auto raw = s.http.Get("/v1/models/" + s.BuiltModel() + "/volume?format=raw");
  EXPECT_EQ(raw->body, "ab");
  EXPECT_EQ(raw->get_header_value("X-Kinevox-Size"), "2,1,1");
  EXPECT_EQ(raw->get_header_value("X-Kinevox-Type"), "uint8");
}

TEST(HttpServer, APoseOutsideTheExamplesIsTold) {
  RunningServer s;
  const std::string model = "/v1/models/" + s.BuiltModel();
  for (const std::string product : {"/volume?", "/field?", "/slice?", "/surface?"}) {
    const auto said = [&](const char* pose) {
      return s.http.Get(model + product + pose)->get_header_value("X-Kinevox-Extrapolation");
    };
    EXPECT_EQ(said("tibia.flexion=35"), "0.00") << product;
    EXPECT_EQ(said("tibia.flexion=100"), "1.00") << product;
  }
}

TEST(HttpServer, WhatIsPosedAsInAScanSaysWhetherThatBelongsToItsStudy) {
  RunningServer s;
  const std::string model = "/v1/models/" + s.BuiltModel();
  for (const std::string product : {"/volume?", "/field?", "/slice?", "/surface?", "/registration?"}) {
    const auto as_in = s.http.Get(model + product + "scan=pose01");
    EXPECT_EQ(as_in->get_header_value("X-Kinevox-Scan-Verdict"), "lost") << product;
    const httplib::Headers known{{"If-None-Match", as_in->get_header_value("ETag")}};
    EXPECT_EQ(s.http.Get(model + product + "scan=pose01", known)->get_header_value("X-Kinevox-Scan-Verdict"),
              "lost")
        << product;
  }
  EXPECT_FALSE(s.http.Get(model + "/volume?tibia.flexion=35")->has_header("X-Kinevox-Scan-Verdict"));
}

TEST(HttpServer, AFieldSaysItsGeometryAndItsErrors) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/field?tibia.flexion=30";
  const auto field = s.http.Get(path);
  ASSERT_EQ(field->status, 200);
  EXPECT_EQ(field->body, std::string(24, '2'));  // level 2 when left out
  EXPECT_EQ(field->get_header_value("X-Kinevox-Size"), "2,1,1");
  EXPECT_EQ(field->get_header_value("X-Kinevox-Components"), "3");
  EXPECT_EQ(field->get_header_value("X-Kinevox-Type"), "float32");
  EXPECT_EQ(field->get_header_value("X-Kinevox-Largest-Error-Mm"), "2.5");
  EXPECT_EQ(s.http.Get(path, {{"If-None-Match", field->get_header_value("ETag")}})->status, 304);
  EXPECT_NE(s.http.Get(path + "&level=1")->get_header_value("ETag"), field->get_header_value("ETag"));
  EXPECT_EQ(s.http.Get(path + "&level=9")->status, 400);
}

TEST(HttpServer, ARegistrationIsOneFileForEachMapScanAndFormat) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/registration?scan=pose01";
  const auto forward = s.http.Get(path);
  ASSERT_EQ(forward->status, 200);
  EXPECT_EQ(forward->body, "map 0 of pose01");
  EXPECT_EQ(forward->get_header_value("Content-Type"), "application/gzip");
  EXPECT_EQ(s.http.Get(path + "&map=template_from_scan&format=nrrd")->body, "map 1 of pose01");
  EXPECT_EQ(s.http.Get(path + "&map=confidence&format=mha")->body, "map 2 of pose01");
  EXPECT_EQ(s.http.Get(path + "&map=error&format=mha")->body, "map 3 of pose01");
  std::set<std::string> names;  // that a browser saves them under
  for (const char* map : {"", "&map=template_from_scan", "&map=confidence", "&map=error"})
    names.insert(s.http.Get(path + map)->get_header_value("Content-Disposition"));
  EXPECT_EQ(names.size(), 4u);
  for (const std::string& name : names)
    EXPECT_EQ(name.find("pose01"), name.npos) << name << ": a user's name";
  EXPECT_EQ(s.http.Get(path, {{"If-None-Match", forward->get_header_value("ETag")}})->status, 304);
  EXPECT_EQ(s.http.Get(path + "&map=certainty")->status, 400);
  EXPECT_EQ(s.http.Get(path + "&format=png")->status, 400);
  EXPECT_EQ(s.http.Get(path + "&level=1")->status, 400);
  EXPECT_EQ(s.http.Get("/v1/models/" + s.BuiltModel() + "/registration")->status, 400);
  EXPECT_EQ(s.http.Get("/v1/models/" + s.BuiltModel() + "/registration?scan=pose07")->status, 404);
}

TEST(Origins, APageMayReadEveryHeaderOfOurs) {
  HttpOptions options;
  options.cors_origins = {"https://viewer.example"};
  RunningServer s(options);
  const std::string model = "/v1/models/" + s.BuiltModel();
  for (const char* path : {"/volume?format=raw", "/field?tibia.flexion=30"}) {
    const auto answer = s.http.Get(model + path, {{"Origin", "https://viewer.example"}});
    ASSERT_EQ(answer->status, 200) << path;
    const std::string exposed = answer->get_header_value("Access-Control-Expose-Headers");
    EXPECT_TRUE(answer->has_header("X-Kinevox-Size")) << path;
    for (const auto& [name, value] : answer->headers) {
      if (!name.starts_with("X-Kinevox-")) continue;
      EXPECT_THAT(exposed, testing::HasSubstr(name)) << path;
    }
  }
}

TEST(Origins, APageMayReadEveryHeaderOfAnUpload) {
  HttpOptions options;
  options.cors_origins = {"https://viewer.example"};
  RunningServer s(options);
  const std::string upload = s.IdsAround(s.BuiltModel())["upload"];
  const auto told = s.http.Head("/v1/uploads/" + upload,
                                {{"Origin", "https://viewer.example"}, {"Tus-Resumable", "1.0.0"}});
  ASSERT_EQ(told->status, 200);
  EXPECT_TRUE(told->has_header("Upload-Metadata"));
  const std::string exposed = told->get_header_value("Access-Control-Expose-Headers");
  for (const auto& [name, value] : told->headers) {
    const bool ours = name.starts_with("Upload-") || name.starts_with("Tus-");
    EXPECT_TRUE(!ours || exposed.find(name) != exposed.npos) << name;
  }
}

}  // namespace
}  // namespace kvx
