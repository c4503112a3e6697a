// Many models at once, webhooks as records, and the time that a job will take.
#include "api/handlers/batches.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "api/handlers/jobs.h"
#include "api/handlers/webhooks.h"
#include "api/job_estimate.h"
#include "core/text/base64.h"
#include "tests/support/service_world.h"

namespace kvx {
namespace {

using testing_support::ServiceWorld;

std::string SubjectWithScans(ServiceWorld& w, const char* body = R"({"region":"knee"})") {
  const std::string subject = Json::parse(CreateSubject(w.services, body, "").body)["id"];
  for (const char* name : {"pose00", "pose01"}) {
    Upload upload = Upload::OfScan(w.services, subject, {{"name", name}, {"filename", "a.nii"}}, "");
    upload.Write(std::string("VOXELS") + name);
    upload.Finish();
  }
  Upload bones = Upload::OfBones(w.services, subject, {{"template", "pose00"}}, "");
  bones.Write(std::string("VOXELSb"));
  bones.Finish();
  return subject;
}

Json Models(const std::vector<std::string>& subjects) {
  Json models = Json::array();
  for (const std::string& subject : subjects)
    models.push_back({{"subject", subject}, {"template", "pose00"}});
  return models;
}

TEST(Batches, AreFollowedAndCancelledAsOne) {
  ServiceWorld w;
  const std::string body = Dump(Json{
      {"name", "study"}, {"priority", 7}, {"models", Models({SubjectWithScans(w), SubjectWithScans(w)})}});
  const Answer made = CreateBatch(w.services, body, "k");
  EXPECT_EQ(made.status, 202);
  EXPECT_EQ(CreateBatch(w.services, body, "k").body, made.body);
  const std::string id = Json::parse(made.body)["id"];
  EXPECT_EQ(made.location, "/v1/batches/" + id);
  const ClaimedJob first = *w.jobs.Claim("w");
  EXPECT_EQ(w.jobs.Require(first.id).priority, 7);
  w.jobs.Succeed(first, R"({"digest":"d"})");
  const Json half = Json::parse(GetBatch(w.services, id));
  EXPECT_EQ(half["counts"]["succeeded"], 1);
  EXPECT_EQ(half["counts"]["queued"], 1);
  EXPECT_EQ(half["progress"], 0.5);
  EXPECT_EQ(half["ended"], false);
  EXPECT_EQ(half["models"][0]["result"]["digest"], "d");
  const Json cancelled = Json::parse(CancelBatch(w.services, id));
  EXPECT_EQ(cancelled["ended"], true);
  EXPECT_EQ(cancelled["counts"]["cancelled"], 1);
  EXPECT_THROW(CancelBatch(w.services, id), Conflict);
  EXPECT_THROW(GetBatch(w.services, "bat_none"), NotFound);
  EXPECT_EQ(Json::parse(ListBatches(w.services, {}))["items"][0]["name"], "study");
}

TEST(Batches, AreAcceptedWholeOrNotAtAll) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w);
  const auto refusal = [&](const Json& models) -> std::string {
    try {
      CreateBatch(w.services, Dump(Json{{"models", models}}), "");
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(Models({subject, "sub_none"})), testing::StartsWith("models[1]: "));
  EXPECT_THAT(refusal(Json::array({1})), testing::StartsWith("models[0]: "));
  EXPECT_NE(refusal(Json::array()), "");
  EXPECT_NE(refusal("x"), "");
  EXPECT_FALSE(w.jobs.Claim("w"));
  EXPECT_TRUE(w.catalogue.Batches({}).items.empty());
}

// Of forty jobs nobody knows the ids.
TEST(Batches, TellWhoseEachJobIs) {
  ServiceWorld w;
  const std::string named = SubjectWithScans(w, R"({"region":"knee","name":"knee-a"})"),
                    other = SubjectWithScans(w);
  const Json made =
      Json::parse(CreateBatch(w.services, Dump(Json{{"models", Models({named, other})}}), "").body);
  const Json models = Json::parse(GetBatch(w.services, made["id"]))["models"];
  EXPECT_EQ(models[0]["subject"], named);
  EXPECT_EQ(models[0]["subject_name"], "knee-a");
  EXPECT_EQ(models[1]["subject"], other);
  EXPECT_FALSE(models[1].contains("subject_name"));
  const Json job = Json::parse(GetJob(w.services, models[0]["job"]));
  EXPECT_EQ(job["subject"], named);
  EXPECT_EQ(job["subject_name"], "knee-a");
  EXPECT_EQ(Json::parse(ListJobs(w.services, {}))["items"][1]["subject_name"], "knee-a");
}

// Two studies, then the same two and one more.
TEST(Batches, WhatWasAskedForUnderItsKeyIsNotMadeAgain) {
  ServiceWorld w;
  const Json models = Models({SubjectWithScans(w), SubjectWithScans(w), SubjectWithScans(w)});
  const auto ask = [&](std::vector<size_t> chosen) {
    Json body{{"models", Json::array()}, {"keys", Json::array()}};
    for (const size_t i : chosen) {
      body["models"].push_back(models[i]);
      body["keys"].push_back("k" + std::to_string(i));
    }
    return Json::parse(CreateBatch(w.services, Dump(body), "").body);
  };
  const Json first = ask({0, 1}), second = ask({0, 1, 2});
  for (const size_t i : {0, 1}) {
    EXPECT_EQ(second["models"][i]["job"], first["models"][i]["job"]);
    EXPECT_EQ(second["models"][i]["id"], first["models"][i]["id"]);
    EXPECT_EQ(second["models"][i]["batch"], first["id"]);
    EXPECT_EQ(second["models"][i]["earlier"], true);
    EXPECT_EQ(first["models"][i]["earlier"], false);
  }
  EXPECT_EQ(second["models"][2]["earlier"], false);
  EXPECT_EQ(second["models"][2]["batch"], second["id"]);
  const Json own = Json::parse(GetBatch(w.services, second["id"]))["models"];
  ASSERT_EQ(own.size(), 1u) << "the others stay in the batch of then";
  EXPECT_EQ(own[0]["job"], second["models"][2]["job"]);
  EXPECT_EQ(ask({0, 1})["id"], first["id"]) << "nothing is new: no other batch";
  EXPECT_EQ(w.catalogue.Batches({}).items.size(), 2u);
  EXPECT_EQ(w.jobs.Count("queued"), 3);
  const Answer alone = CreateModel(w.services, Dump(models[2]), "k2");
  EXPECT_EQ(Json::parse(alone.body)["job"], second["models"][2]["job"]) << "as by itself";
}

TEST(Batches, AKeyStandsForOneModel) {
  ServiceWorld w;
  const std::string subject = SubjectWithScans(w), other = SubjectWithScans(w);
  const auto ask = [&](const std::string& of, const Json& keys) {
    return CreateBatch(w.services, Dump(Json{{"models", Models({of})}, {"keys", keys}}), "");
  };
  ask(subject, Json::array({"k"}));
  EXPECT_THROW(ask(other, Json::array({"k"})), Conflict);
  EXPECT_THROW(ask(other, Json::array()), InputError) << "fewer keys than models";
  EXPECT_THROW(ask(other, Json::array({""})), InputError);
  EXPECT_THROW(ask(other, Json::array({1})), InputError);
  EXPECT_EQ(w.jobs.Count("queued"), 1);
}

TEST(Webhooks, ShowTheirSecretOnce) {
  ServiceWorld w;
  const Json made = Json::parse(CreateWebhook(w.services, R"({"url":"https://example.com/hook"})", "").body);
  EXPECT_THAT(made["secret"].get<std::string>(), testing::MatchesRegex("whsec_[A-Za-z0-9+/]{32}"));
  EXPECT_EQ(made["events"].size(), 3u);
  const std::string id = made["id"];
  EXPECT_FALSE(Json::parse(GetWebhook(w.services, id)).contains("secret"));
  EXPECT_FALSE(Json::parse(ListWebhooks(w.services, {}))["items"][0].contains("secret"));
  RemoveWebhook(w.services, id);
  EXPECT_THROW(GetWebhook(w.services, id), NotFound);
  for (const char* body :
       {R"({})", R"({"url":"ftp://example.com"})", R"({"url":"http://u:p@example.com"})",
        R"({"url":"http:///x"})", R"({"url":"http://a b"})", R"({"url":"http://127.0.0.2#.evil.example/p"})",
        R"({"url":"http://a.b/x#y"})", R"({"url":"http://a.b:0"})", R"({"url":"http://a%2eb"})",
        R"({"url":"http://a.b","events":["x"]})", R"({"url":"http://a.b","secret":"short"})",
        R"({"url":"http://a.b","more":1})"}) {
    EXPECT_THROW(CreateWebhook(w.services, body, ""), InputError) << body;
  }
}

TEST(Webhooks, TakeASecretThatMessagesCanBeSignedWith) {
  ServiceWorld w;
  const auto create = [&](const std::string& coded) {
    CreateWebhook(w.services, R"({"url":"https://a.b/","secret":"whsec_)" + coded + R"("})", "");
  };
  for (const size_t bytes : {24, 25, 26, 64}) EXPECT_NO_THROW(create(Base64(std::string(bytes, 'k'))));
  for (const std::string& coded :
       {Base64(std::string(23, 'k')), Base64(std::string(65, 'k')), "AAAA=" + std::string(27, 'A'),
        std::string(29, 'A') + "===", " " + std::string(32, 'A') + "   "}) {
    EXPECT_THROW(create(coded), InputError) << coded;
  }
}

// Two stages: the first half of the progress takes 10 s, the second 30 s.
const std::vector<StageTime> kRun{{"load", 0.0, 10, 100}, {"register", 0.5, 30, 100}};

TEST(JobEstimate, TimePassesAsTheStagesDid) {
  EXPECT_DOUBLE_EQ(ShareOfTime(kRun, 0), 0);
  EXPECT_DOUBLE_EQ(ShareOfTime(kRun, 0.25), 5.0 / 40);
  EXPECT_DOUBLE_EQ(ShareOfTime(kRun, 0.5), 10.0 / 40);
  EXPECT_DOUBLE_EQ(ShareOfTime(kRun, 0.75), 25.0 / 40);
  EXPECT_DOUBLE_EQ(ShareOfTime(kRun, 1), 1);
  EXPECT_DOUBLE_EQ(ShareOfTime({}, 0.3), 0.3);
}

TEST(JobEstimate, GrowsWithTheWorkAndWithTheQueue) {
  ServiceWorld w;
  const auto submit = [&](double work) {
    NewJob job{"build_model", "mdl", "{}"};
    job.work = work;
    return w.jobs.Submit(job).id;
  };
  const auto estimate = [&](const std::string& id) { return EstimateOf(w.jobs, w.jobs.Require(id)); };
  const std::string first = submit(100);
  EXPECT_FALSE(estimate(first).seconds_left) << "nothing is known yet";
  const ClaimedJob job = *w.jobs.Claim("w");
  w.jobs.Succeed(job, "{}", [&] { w.jobs.RecordStages(job, kRun); });
  EXPECT_FALSE(estimate(first).seconds_left) << "it has ended";
  const std::string running = submit(200), next = submit(50), last = submit(100);
  w.jobs.Report(*w.jobs.Claim("w"), "register", 0.5);
  EXPECT_DOUBLE_EQ(*estimate(running).seconds_left, 80 * 0.75);
  EXPECT_EQ(*estimate(next).queue_position, 1);
  EXPECT_DOUBLE_EQ(*estimate(next).seconds_left, 60 + 20);
  EXPECT_EQ(*estimate(last).queue_position, 2);
  EXPECT_DOUBLE_EQ(*estimate(last).seconds_left, 60 + 20 + 40);
  EXPECT_EQ(Json::parse(GetJob(w.services, last))["queue_position"], 2);
}

}  // namespace
}  // namespace kvx
