// Every change of a job writes its event in the same transaction.
#include "storage/job_queue.h"

#include <algorithm>
#include <condition_variable>
#include <limits>
#include <mutex>

#include "core/errors.h"
#include "storage/database/sqlite.h"
#include "storage/ids.h"

namespace kvx {
namespace {

using sqlite::Integer;
using sqlite::OptionalInteger;
using sqlite::OptionalText;
using sqlite::Text;

constexpr int kEventsAtOnce = 100;  // at most

// Errors of jobs, as a failed job has them.
constexpr char kOutOfAttempts[] = R"({"type":"urn:kinevox:problem:attempts-exhausted",)"
                                  R"("detail":"the job was interrupted too often; submit it again"})";
constexpr char kLostItsWorkers[] =
    R"({"type":"urn:kinevox:problem:worker-lost",)"
    R"("detail":"the process that ran this job died or fell silent three times; )"
    R"(look at the service's log and memory, then submit it again: finished stages are kept"})";

JobRecord JobRow(SQLite::Statement& row) {
  JobRecord job;
  job.seq = Integer(row, 0);
  job.id = Text(row, 1);
  job.kind = Text(row, 2);
  job.model = Text(row, 3);
  job.state = Text(row, 4);
  job.attempt = Integer(row, 5);
  job.max_attempts = Integer(row, 6);
  job.cancel_requested = Integer(row, 7) != 0;
  job.stage = Text(row, 8);
  job.progress = row.getColumn(9).getDouble();
  job.error = OptionalText(row, 10);
  job.result = OptionalText(row, 11);
  job.created_ms = Integer(row, 12);
  job.started_ms = OptionalInteger(row, 13);
  job.finished_ms = OptionalInteger(row, 14);
  job.priority = Integer(row, 15);
  job.work = row.getColumn(16).getDouble();
  job.batch = OptionalText(row, 17);
  job.subject = OptionalText(row, 18);
  job.subject_name = OptionalText(row, 19);
  return job;
}

JobEvent EventRow(SQLite::Statement& row) {
  return {Integer(row, 0), Integer(row, 1), Text(row, 2), Text(row, 3), row.getColumn(4).getDouble(),
          Integer(row, 5), Text(row, 6)};
}

StageTime StageRow(SQLite::Statement& row) {
  return {Text(row, 0), row.getColumn(1).getDouble(), row.getColumn(2).getDouble(),
          row.getColumn(3).getDouble()};
}

std::string FirstText(SQLite::Statement& row) { return Text(row, 0); }

JobRecord RequireIn(SQLite::Database& db, const std::string& id, const ProjectFilter& project) {
  auto job = sqlite::One(db, "find_job", JobRow, id, project);
  if (!job) throw NotFound("there is no such job");
  return *std::move(job);
}

void Note(SQLite::Database& db, const std::string& job, int64_t now_ms) {
  sqlite::Execute(db, "insert_job_event", job, now_ms);
  sqlite::Execute(db, "enqueue_webhooks", job, now_ms);  // where the job has ended
}

constexpr int64_t kLongestLeaseMs = 3600 * int64_t(1000);

void SweepIn(SQLite::Database& db, int64_t now_ms, int64_t steady_ms) {
  const auto lost = sqlite::All(db, "expire_jobs", FirstText, now_ms, kOutOfAttempts, kLostItsWorkers,
                                steady_ms, steady_ms + kLongestLeaseMs);
  for (const std::string& id : lost) Note(db, id, now_ms);
  const auto ended = sqlite::All(db, "sweep_jobs", FirstText, now_ms, kOutOfAttempts);
  for (const std::string& id : ended) Note(db, id, now_ms);
  sqlite::Execute(db, "pull_in_retries", now_ms + kLongestRetryMs);
}

}  // namespace

struct JobQueue::Bell {
  std::mutex mutex;
  std::condition_variable rung;
  uint64_t changes = 0;
};

JobQueue::JobQueue(Database& db, int64_t lease_ms)
    : db_(db), lease_ms_(lease_ms), bell_(std::make_shared<Bell>()) {}
JobQueue::~JobQueue() = default;

JobQueue JobQueue::ForProject(const std::string& project) const {
  JobQueue scoped = *this;
  scoped.project_ = project;
  return scoped;
}

void JobQueue::Changed() {
  {
    const std::lock_guard lock(bell_->mutex);
    ++bell_->changes;
  }
  bell_->rung.notify_all();
}

void JobQueue::WakeAll() { Changed(); }

uint64_t JobQueue::WaitForChange(uint64_t seen, std::chrono::milliseconds at_most) {
  std::unique_lock lock(bell_->mutex);
  bell_->rung.wait_for(lock, at_most, [&] { return bell_->changes != seen; });
  return bell_->changes;
}

JobRecord JobQueue::Submit(const NewJob& job) {
  const JobRecord submitted = db_.Write([&](SQLite::Database& db) {
    const std::string id = NewId("job");
    sqlite::Execute(db, "insert_job", id, job.kind, job.model, job.priority, job.max_attempts, db_.NowMs(),
                    job.need_bytes, job.work, job.batch, ProjectOfNew(project_), job.subject);
    sqlite::Execute(db, "insert_job_request", id, job.request);
    Note(db, id, db_.NowMs());
    return RequireIn(db, id, project_);
  });
  Changed();
  return submitted;
}

JobRecord JobQueue::Require(const std::string& id) {
  return db_.Read([&](SQLite::Database& db) { return RequireIn(db, id, project_); });
}

std::string JobQueue::RequestOf(const std::string& id) {
  return db_.Read([&](SQLite::Database& db) {
    RequireIn(db, id, project_);
    return *sqlite::One(db, "find_job_request", FirstText, id);
  });
}

Page<JobRecord> JobQueue::List(const PageRequest& page, const std::optional<std::string>& state) {
  return db_.Read([&](SQLite::Database& db) {
    return MakePage(page, [&](int rows) {
      return state ? sqlite::All(db, "list_jobs_in_state", JobRow, page.before, rows, project_, *state)
                   : sqlite::All(db, "list_jobs", JobRow, page.before, rows, project_);
    });
  });
}

std::vector<JobEvent> JobQueue::EventsAfter(const std::string& id, int64_t event) {
  return db_.Read([&](SQLite::Database& db) {
    return sqlite::All(db, "job_events_after", EventRow, id, event, kEventsAtOnce);
  });
}

int64_t JobQueue::LastEvent(const std::string& id) {
  return db_.Read([&](SQLite::Database& db) {
    return *sqlite::One(
        db, "last_job_event", [](SQLite::Statement& row) { return Integer(row, 0); }, id);
  });
}

std::vector<JobEvent> JobQueue::EventsOfAllAfter(int64_t event, int limit) {
  return db_.Read(
      [&](SQLite::Database& db) { return sqlite::All(db, "all_job_events_after", EventRow, event, limit); });
}

int64_t JobQueue::LastEventOfAll() {
  return db_.Read([&](SQLite::Database& db) {
    return *sqlite::One(db, "last_event_of_all", [](SQLite::Statement& row) { return Integer(row, 0); });
  });
}

int64_t JobQueue::Count(const std::string& state) {
  return db_.Read([&](SQLite::Database& db) {
    return *sqlite::One(
        db, "count_jobs", [](SQLite::Statement& row) { return Integer(row, 0); }, state);
  });
}

std::vector<JobRecord> JobQueue::OfBatch(const std::string& batch) {
  return db_.Read([&](SQLite::Database& db) { return sqlite::All(db, "jobs_of_batch", JobRow, batch); });
}

std::vector<JobRecord> JobQueue::BeforeInLine(const JobRecord& queued) {
  constexpr int64_t kEver = std::numeric_limits<int64_t>::max();  // those that wait to be tried again, too
  return db_.Read(
      [&](SQLite::Database& db) { return sqlite::All(db, "jobs_before", JobRow, kEver, queued.seq); });
}

std::vector<StageTime> JobQueue::StagesOf(const std::string& job) {
  return db_.Read([&](SQLite::Database& db) { return sqlite::All(db, "stages_of_job", StageRow, job); });
}

std::vector<std::vector<StageTime>> JobQueue::RecentRuns(const std::string& kind, int limit) {
  return db_.Read([&](SQLite::Database& db) {
    std::vector<std::vector<StageTime>> runs;
    for (const std::string& job : sqlite::All(db, "recent_runs", FirstText, kind, limit)) {
      runs.push_back(sqlite::All(db, "stages_of_job", StageRow, job));
    }
    return runs;
  });
}

void JobQueue::RequireAdmissible(int64_t need_bytes) const {
  if (need_bytes <= memory_budget_) return;
  const auto gib = [](int64_t bytes) { return std::to_string((bytes + (1 << 29)) >> 30); };
  throw InputError("this needs about " + gib(need_bytes) + " GiB of memory and the service may use " +
                   gib(memory_budget_) + " GiB; send scans cut to the region or of coarser resolution");
}

void JobQueue::RecordStages(const ClaimedJob& job, const std::vector<StageTime>& stages) {
  db_.Write([&](SQLite::Database& db) {
    for (size_t i = 0; i < stages.size(); ++i) {
      sqlite::Execute(db, "insert_stage_time", job.id, job.kind, stages[i].stage, int64_t(i), stages[i].begin,
                      stages[i].seconds, job.work);
    }
    sqlite::Execute(db, "forget_stage_times", job.kind);
  });
}

JobRecord JobQueue::Cancel(const std::string& id) {
  const JobRecord job = db_.Write([&](SQLite::Database& db) {
    if (RequireIn(db, id, project_).Ended()) throw Conflict("the job has ended already");
    if (sqlite::Execute(db, "cancel_queued_job", id, db_.NowMs()) == 0)
      sqlite::Execute(db, "cancel_running_job", id);
    Note(db, id, db_.NowMs());
    return RequireIn(db, id, project_);
  });
  Changed();
  return job;
}

std::optional<ClaimedJob> JobQueue::Claim(const std::string& worker) {
  auto claimed = db_.Write([&](SQLite::Database& db) {
    const int64_t now = db_.NowMs();
    const std::string token = NewId("lse");
    SweepIn(db, now, db_.SteadyMs());
    const auto row = [&](SQLite::Statement& r) {
      return ClaimedJob{
          Text(r, 0), Text(r, 1), Text(r, 2), Text(r, 3), Integer(r, 4), token, r.getColumn(5).getDouble()};
    };
    auto job = sqlite::One(db, "claim_next_job", row, now, worker, token, db_.SteadyMs() + lease_ms_,
                           memory_budget_);
    if (job) Note(db, job->id, now);
    return job;
  });
  if (claimed) Changed();
  return claimed;
}

void JobQueue::Sweep() {
  db_.Write([&](SQLite::Database& db) { SweepIn(db, db_.NowMs(), db_.SteadyMs()); });
  Changed();
}

void JobQueue::ExpireAllLeases() {
  db_.Write([&](SQLite::Database& db) { sqlite::Execute(db, "expire_leases"); });
}

bool JobQueue::Renew(const ClaimedJob& job) {
  const auto cancel = db_.Write([&](SQLite::Database& db) {
    return sqlite::One(
        db, "renew_lease", [](SQLite::Statement& row) { return Integer(row, 0); }, job.id, job.lease_token,
        db_.SteadyMs() + lease_ms_);
  });
  if (!cancel) throw Conflict("another worker has taken over this job");
  return *cancel != 0;
}

template <class... Args>
void JobQueue::Fenced(std::string_view statement, const ClaimedJob& job, const Args&... args) {
  db_.Write([&](SQLite::Database& db) {
    if (sqlite::Execute(db, statement, job.id, job.lease_token, args...) == 0) {
      throw Conflict("another worker has taken over this job");
    }
    Note(db, job.id, db_.NowMs());
  });
  Changed();
}

void JobQueue::Report(const ClaimedJob& job, const std::string& stage, double progress) {
  Fenced("report_progress", job, stage, progress);
}

void JobQueue::Succeed(const ClaimedJob& job, const std::string& result,
                       const std::function<void()>& record) {
  db_.Write([&](SQLite::Database&) {
    Fenced("end_job", job, "succeeded", std::optional(result), std::optional<std::string>(), db_.NowMs());
    if (record) record();
  });
  Changed();  // again, now that it is committed
}

void JobQueue::Fail(const ClaimedJob& job, const std::string& error) {
  Fenced("end_job", job, "failed", std::optional<std::string>(), std::optional(error), db_.NowMs());
}

void JobQueue::EndCancelled(const ClaimedJob& job) {
  const std::optional<std::string> none;
  Fenced("end_job", job, "cancelled", none, none, db_.NowMs());
}

void JobQueue::GiveBack(const ClaimedJob& job) { Fenced("requeue_job", job, int64_t(1), int64_t(0)); }

void JobQueue::RetryLater(const ClaimedJob& job, int64_t delay_ms) {
  Fenced("requeue_job", job, int64_t(0), db_.NowMs() + std::min(delay_ms, kLongestRetryMs));
}

}  // namespace kvx
