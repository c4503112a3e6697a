// Who is next among the jobs of several projects, by what the queue says and by whom it lets begin.
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <random>
#include <set>

#include "storage/job_queue.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

struct Line {
  testing_support::ScratchFolder scratch;
  int64_t now_ms = 1000;
  Database database{scratch.path() / "test.db", [this] { return now_ms; }, [this] { return now_ms; }};
  JobQueue jobs{database, 500};
  std::string Submit(int priority = 0, const std::string& project = {}) {
    const NewJob job{"build_model", "mdl", "{}", priority};
    return (project.empty() ? jobs.Submit(job) : jobs.ForProject(project).Submit(job)).id;
  }
  size_t Before(const std::string& id) { return jobs.BeforeInLine(jobs.Require(id)).size(); }
};

TEST(LineOfJobs, KnowsWhatIsBeforeAJob) {
  Line w;
  const std::string running = w.Submit(), first = w.Submit(), second = w.Submit(), urgent = w.Submit(1);
  EXPECT_EQ(w.jobs.Claim("a")->id, urgent);
  EXPECT_EQ(w.jobs.Claim("a")->id, running);
  EXPECT_EQ(w.Before(first), 2u);
  EXPECT_EQ(w.Before(second), 3u);
}

// Forty of one that came first do not make the other wait for all of them, whatever priority they have.
TEST(LineOfJobs, ProjectsTakeTurns) {
  Line w;
  const std::string first = w.Submit(0, "one"), second = w.Submit(0, "one"), urgent = w.Submit(9, "one"),
                    others = w.Submit(0, "other"), others_next = w.Submit(0, "other");
  const std::vector<std::string> line{urgent, others, first, others_next, second};
  for (size_t i = 0; i < line.size(); ++i) EXPECT_EQ(w.Before(line[i]), i);
  for (size_t i = 0; i < line.size(); ++i) {
    EXPECT_EQ(w.jobs.Claim("a")->id, line[i]) << i;
    w.now_ms += 1;
    for (size_t k = i + 1; k < line.size(); ++k) EXPECT_EQ(w.Before(line[k]), k) << "running ones, too";
  }
}

TEST(LineOfJobs, WhoHasBegunNoneYetIsNext) {
  Line w;
  w.Submit(0, "one"), w.Submit(0, "one");
  w.jobs.Claim("a");
  w.now_ms += 1;
  const std::string late = w.Submit(0, "other");
  EXPECT_EQ(w.jobs.Claim("a")->id, late);
}

// Whatever the projects and priorities are, with jobs that come while others are begun.
TEST(LineOfJobs, JobsBeginInTheOrderInWhichTheyAreSaidToStand) {
  Line w;
  std::mt19937 random(4);
  std::set<std::string> waiting;
  size_t running = 0;
  for (int step = 0; step < 80; ++step, w.now_ms += 7) {
    if (step < 20 || (step < 40 && random() % 2)) {
      waiting.insert(w.Submit(int(random() % 3), "project " + std::to_string(random() % 4)));
      continue;
    }
    std::map<size_t, std::string> line;
    for (const std::string& id : waiting) line[w.Before(id) - running] = id;
    ASSERT_EQ(line.size(), waiting.size()) << "no two have one place";
    const std::optional<ClaimedJob> begun = w.jobs.Claim("a");
    ASSERT_EQ(begun.has_value(), !waiting.empty());
    if (!begun) return;
    EXPECT_EQ(line.begin()->first, 0u);
    EXPECT_EQ(line.rbegin()->first, waiting.size() - 1);
    EXPECT_EQ(begun->id, line.begin()->second) << step;
    waiting.erase(begun->id), ++running;
  }
  FAIL() << "jobs are left";
}

// It keeps its place in the line all the same.
TEST(LineOfJobs, WhatWaitsToBeTriedAgainHoldsUpNoOther) {
  Line w;
  const std::string later = w.Submit(), next = w.Submit();
  w.jobs.RetryLater(*w.jobs.Claim("a"), 1000);
  EXPECT_EQ(w.Before(next), 1u) << "it may be due sooner than the other ends";
  EXPECT_EQ(w.jobs.Claim("a")->id, next);
  EXPECT_FALSE(w.jobs.Claim("a"));
  w.now_ms += 1000;
  EXPECT_EQ(w.jobs.Claim("a")->id, later);
}

}  // namespace
}  // namespace kvx
