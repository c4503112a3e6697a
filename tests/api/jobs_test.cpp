// Events of jobs, and errors as problems.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <system_error>
#include <thread>

#include "api/errors.h"
#include "api/handlers/jobs.h"
#include "storage/resumable_uploads.h"
#include "tests/support/handler_requests.h"

namespace kvx {
namespace {

using testing_support::ServiceWorld;

TEST(Problems, OneTableFromErrorToStatus) {
  const auto status = [](auto error) { return ToProblem(std::make_exception_ptr(error)).status; };
  EXPECT_EQ(status(InputError("x")), 400);
  EXPECT_EQ(status(NotFound("x")), 404);
  EXPECT_EQ(status(Conflict("x")), 409);
  EXPECT_EQ(status(QuotaExceeded("x")), 413);
  EXPECT_EQ(status(UnsupportedMedia("x")), 415);
  EXPECT_EQ(status(Unavailable("x")), 503);
  EXPECT_EQ(status(LengthRequired("x")), 411);
  EXPECT_EQ(status(TusVersionNeeded("x")), 412);
  EXPECT_EQ(status(PreconditionFailed("x")), 412);
  EXPECT_EQ(status(BodyTooLarge("x")), 413);
  EXPECT_EQ(status(ChecksumMismatch("x")), 460);
  EXPECT_EQ(status(Gone("x")), 410);
  EXPECT_EQ(status(Locked("x")), 423);
  EXPECT_EQ(status(DiskNearlyFull("x")), 507);
  EXPECT_EQ(status(Unauthorised("x")), 401);
  EXPECT_EQ(status(Forbidden("x")), 403);
  EXPECT_EQ(status(LimitReached("x")), 429);
  EXPECT_EQ(status(Cancelled()), 409);
  EXPECT_EQ(status(Error("x")), 500) << "no kind of ours";
  const std::filesystem::filesystem_error file("open", "/secret/path",
                                               std::error_code(28, std::generic_category()));
  EXPECT_EQ(status(file), 503);
  EXPECT_EQ(ToProblem(std::make_exception_ptr(file)).detail.find("secret"), std::string::npos);
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
