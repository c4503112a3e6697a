// Models asked for: what the job holds, and what is refused before there is one.
#include "api/handlers/models.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/support/handler_requests.h"

namespace kvx {
namespace {

using testing_support::RefusalOf;
using testing_support::SendScan;
using testing_support::ServiceWorld;
using testing_support::SubjectWithScans;

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

TEST(Models, ASeriesMayBeCalledAsTheFileOfAnotherScanIs) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  StoredFile series = w.catalogue.FindScan(subject, "pose01")->file;
  series.suffix.clear();
  w.catalogue.AddScan(subject, "pose01.nii.gz", series);
  const PreparedModel model = PrepareModel(w.services, {{"subject", subject}, {"template", "pose00"}});
  std::set<std::string> names;
  const BuildTask task = TaskOf(w.blobs, model.id, model.stored);
  for (const StudyFile& file : task.files) names.insert(file.name);
  EXPECT_EQ(names.size(), task.files.size()) << "of links in one folder";
}

// All examples side by side, where one has lost a bone: 13 bytes a voxel of the 4 x 5 x 6.
TEST(Models, ManyScansNeedMoreMemoryThanAFew) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const Json request = {{"subject", subject}, {"template", "pose00"}};
  const int64_t few = PrepareModel(w.services, request).need_bytes;
  for (int k = 2; k < 30; ++k) SendScan(w, subject, "pose" + std::to_string(k), "VOXELS" + std::to_string(k));
  EXPECT_EQ(PrepareModel(w.services, request).need_bytes - few, (60 + 13 * 30 - 220) * 4 * 5 * 6);
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

TEST(Models, AScanIsChosenByItsIdAsByItsName) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  for (const std::string& scan : {std::string("pose01"), w.catalogue.FindScan(subject, "pose01")->id}) {
    const Json body{{"subject", subject}, {"template", "pose00"}, {"scans", {scan}}};
    EXPECT_EQ(CreateModel(w.services, Dump(body), scan).status, 202);
    const ClaimedJob job = *w.jobs.Claim("w");
    const Json study = Json::parse(TaskOf(w.blobs, job.model, job.request).study);
    ASSERT_EQ(study["scans"].size(), 2u) << scan;
    EXPECT_EQ(study["scans"][1]["name"], "pose01");
    w.jobs.Fail(job, "{}");
  }
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

}  // namespace
}  // namespace kvx
