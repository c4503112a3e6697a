// The service's SQLite database: one writer, readers beside it, forward-only migrations.
// SQL lies in storage/sql.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <type_traits>

namespace SQLite {
class Database;
}

namespace kvx {

constexpr int64_t kDayMs = 24 * 3600 * int64_t(1000);

using ClockMs = std::function<int64_t()>;
int64_t SystemClockMs();  // UTC milliseconds since 1970
int64_t SteadyClockMs();  // milliseconds since the machine started, without those that it was asleep

void RequireKnown(SQLite::Database& db);  // throws Conflict when a newer program made its schema

class Database {
 public:
  // Opens or creates the file and brings its schema up to date. Throws Conflict when a newer program made it.
  // On a read-only disk it is there to be read alone, and must be up to date.
  explicit Database(const std::filesystem::path& file, ClockMs now = SystemClockMs,
                    ClockMs steady = SteadyClockMs);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  // Runs `work(SQLite::Database&)` in one BEGIN IMMEDIATE transaction: committed when it returns, rolled back
  // when it throws. Inside another Write of the same thread it joins that transaction.
  template <class Work>
  auto Write(Work&& work) {
    return Returning(work, [this](const Step& step) { RunWrite(step); });
  }
  // A consistent snapshot; inside a Write of the same thread, that transaction's own view.
  template <class Work>
  auto Read(Work&& work) {
    return Returning(work, [this](const Step& step) { RunRead(step); });
  }

  int64_t NowMs() const;
  // For what must not depend on the clock being set: the same in all processes, nothing after the machine has
  // started anew.
  int64_t SteadyMs() const;
  // What was deleted is gone from the write-ahead log, too. False: somebody reads what is in it; try again.
  bool EmptyLog();
  void Beat();  // a write for its own sake: throws Unavailable when the database cannot be written

 private:
  using Step = std::function<void(SQLite::Database&)>;
  template <class Work, class Run>
  static auto Returning(Work& work, const Run& run) {
    using Result = std::invoke_result_t<Work&, SQLite::Database&>;
    if constexpr (std::is_void_v<Result>) {
      run([&](SQLite::Database& db) { work(db); });
    } else {
      std::unique_ptr<Result> result;
      run([&](SQLite::Database& db) { result = std::make_unique<Result>(work(db)); });
      return std::move(*result);
    }
  }
  void RunWrite(const Step& step);
  void RunRead(const Step& step);

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
