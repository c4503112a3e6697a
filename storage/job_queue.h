// The job queue in one table: short leases, fencing tokens,
// attempts counted at claim, cancel as a flag, events for replay.
#pragma once
#include <chrono>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/database/database.h"
#include "storage/page.h"
#include "storage/project.h"

namespace kvx {

// A job is "queued", "running", and in the end "succeeded", "failed" or "cancelled".
inline bool IsEnd(std::string_view job_state) { return job_state != "queued" && job_state != "running"; }

struct JobRecord {
  int64_t seq = 0;
  std::string id, kind, model, state;
  int64_t attempt = 0, max_attempts = 0;
  bool cancel_requested = false;
  std::string stage;
  double progress = 0;
  std::optional<std::string> error, result;  // JSON
  int64_t created_ms = 0;
  std::optional<int64_t> started_ms, finished_ms;
  int64_t priority = 0;
  double work = 0;
  std::optional<std::string> batch, subject, subject_name;

  bool Ended() const { return IsEnd(state); }
};

constexpr int64_t kLongestRetryMs = 600'000;  // from one attempt to the next

struct JobEvent {
  int64_t id = 0;  // grows over all jobs
  int64_t at_ms = 0;
  std::string state, stage;
  double progress = 0;
  int64_t attempt = 0;
  std::string job;

  bool IsLast() const { return IsEnd(state); }
};

struct NewJob {
  std::string kind;
  std::string model;    // that it makes or works on; empty where it is about no model
  std::string request;  // JSON, for the run function of its kind (server/jobs/job_kinds.h)
  int priority = 0;     // higher ones first
  int max_attempts = 5;
  int64_t need_bytes = 0;  // memory that a run takes; it waits until that much is free
  double work = 0;         // size in units of its kind; 0: no time estimate
  std::optional<std::string> batch;
  std::optional<std::string> subject;  // with which it is removed
};

// One stage of a run: the fraction of the whole at which it began, and what it took.
struct StageTime {
  std::string stage;
  double begin = 0, seconds = 0, work = 0;  // work: of the job
};

// What a worker holds. The token fences its writes:
// once another has taken over, none of them changes anything.
struct ClaimedJob {
  std::string id, kind, model, request;
  int64_t attempt = 0;
  std::string lease_token;
  double work = 0;
};

class JobQueue {
 public:
  explicit JobQueue(Database& db, int64_t lease_ms = 15'000);
  ~JobQueue();
  JobQueue ForProject(
      const std::string& project) const;  // sees and submits its jobs alone; rings the same bell

  JobRecord Submit(const NewJob& job);
  JobRecord Require(const std::string& id);      // throws NotFound
  std::string RequestOf(const std::string& id);  // may be long, so no record has it; throws NotFound
  Page<JobRecord> List(const PageRequest& page, const std::optional<std::string>& state = {});
  std::vector<JobEvent> EventsAfter(const std::string& id, int64_t event);
  int64_t LastEvent(const std::string& id);  // 0: none
  // Of every project's jobs: for the service itself.
  std::vector<JobEvent> EventsOfAllAfter(int64_t event, int limit);
  int64_t LastEventOfAll();
  int64_t Count(const std::string& state);
  std::vector<JobRecord> OfBatch(const std::string& batch);      // in the order of submission
  std::vector<JobRecord> BeforeInLine(const JobRecord& queued);  // running, or to be claimed before it
  std::vector<StageTime> StagesOf(const std::string& job);       // of the run that succeeded
  std::vector<std::vector<StageTime>> RecentRuns(const std::string& kind, int limit);  // newest first
  // Throws InputError for a job that could never be admitted.
  void RequireAdmissible(int64_t need_bytes) const;
  // A queued job is cancelled at once, a running one is asked to stop. Throws Conflict when it has ended.
  JobRecord Cancel(const std::string& id);

  // The worker's side. Each write of a worker whose lease was lost throws Conflict and changes nothing.
  std::optional<ClaimedJob> Claim(const std::string& worker);
  bool Renew(const ClaimedJob& job);  // true: somebody asked the job to stop
  void Report(const ClaimedJob& job, const std::string& stage, double progress);
  // `record` writes what the job made, in the same transaction: all of it is there, or nothing.
  void Succeed(const ClaimedJob& job, const std::string& result, const std::function<void()>& record = {});
  void Fail(const ClaimedJob& job, const std::string& error);
  void EndCancelled(const ClaimedJob& job);
  void GiveBack(const ClaimedJob& job);  // the worker stops on request: the attempt does not count
  // This attempt failed for a passing reason. The delay is kLongestRetryMs at most.
  void RetryLater(const ClaimedJob& job, int64_t delay_ms);

  // Within the transaction of Succeed (its `record`): what the stages took.
  void RecordStages(const ClaimedJob& job, const std::vector<StageTime>& stages);

  // Takes jobs back from workers whose lease has run out, and ends those that nobody will claim again:
  // cancelled, out of attempts, or the end of three workers. Claim does it too.
  void Sweep();
  // The leases of processes that are gone. Call only when no other process can hold one (DataFolder::alone).
  void ExpireAllLeases();
  // Running jobs of all processes together may declare this much; a job waits until there is room.
  // The default is no limit.
  void set_memory_budget(int64_t bytes) { memory_budget_ = bytes; }

  int64_t lease_ms() const { return lease_ms_; }
  // Waits until some job has changed after `seen`, or the time is up; returns the new count of changes.
  uint64_t WaitForChange(uint64_t seen, std::chrono::milliseconds at_most);
  void WakeAll();

 private:
  // Runs one fenced statement of a worker and notes the event; Conflict when it changed no row.
  template <class... Args>
  void Fenced(std::string_view statement, const ClaimedJob& job, const Args&... args);
  void Changed();

  Database& db_;
  int64_t lease_ms_;
  int64_t memory_budget_ = std::numeric_limits<int64_t>::max();
  struct Bell;
  std::shared_ptr<Bell> bell_;
  ProjectFilter project_;
};

}  // namespace kvx
