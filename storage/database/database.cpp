// Write-ahead log, full synchronisation, immediate transactions: a deferred one that reads and then writes
// can fail at once whatever the busy timeout.
#include "storage/database/database.h"

#include <sqlite3.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "core/errors.h"
#include "storage/database/open_for_reading.h"
#include "storage/database/sqlite.h"

namespace kvx {
namespace {

std::string MigrationName(int version) {
  const std::string digits = std::to_string(version);
  return "migration_" + std::string(3 - std::min<size_t>(3, digits.size()), '0') + digits + ".sql";
}

int UserVersion(SQLite::Database& db) { return db.execAndGet("PRAGMA user_version").getInt(); }

// What is read only is not brought up to date.
void RequireUpToDate(SQLite::Database& db) {
  RequireKnown(db);
  const int found = UserVersion(db);
  if (EmbeddedSql(MigrationName(found + 1)).empty()) return;
  throw Unavailable(
      "the data folder is read-only and of an older version of kinevox; copy it to where it can be written, "
      "and give the copy");
}

// Rolls back unless Commit was said; never throws when it goes.
class Immediate {
 public:
  explicit Immediate(SQLite::Database& db) : db_(db) { db_.exec("BEGIN IMMEDIATE"); }
  ~Immediate() {
    if (!committed_) db_.tryExec("ROLLBACK");
  }
  void Commit() {
    db_.exec("COMMIT");
    committed_ = true;
  }

 private:
  SQLite::Database& db_;
  bool committed_ = false;
};

// References between tables are not watched meanwhile,
// so that a migration may make a table anew; they are checked after.
void Migrate(SQLite::Database& db) {
  RequireKnown(db);
  const int found = UserVersion(db);
  for (int version = found + 1; !EmbeddedSql(MigrationName(version)).empty(); ++version) {
    Immediate transaction(db);
    if (UserVersion(db) >= version) continue;
    db.exec(std::string(EmbeddedSql(MigrationName(version))));
    if (SQLite::Statement(db, "PRAGMA foreign_key_check").executeStep()) {
      throw Unavailable("the service's database is damaged; restore the data folder from a backup");
    }
    db.exec("PRAGMA user_version = " + std::to_string(version));
    transaction.Commit();
  }
}

[[noreturn]] void RethrowForUsers(const SQLite::Exception& error) {
  switch (error.getErrorCode()) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_FULL:
    case SQLITE_IOERR:
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
      throw Unavailable(
          "the service's database cannot be used now; is the disk full or the data folder read-only?");
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      throw Unavailable("the service's database is damaged; restore the data folder from a backup");
    default:
      throw;
  }
}

}  // namespace

void RequireKnown(SQLite::Database& db) {
  const int version = UserVersion(db);
  if (version == 0 || !EmbeddedSql(MigrationName(version)).empty()) return;
  throw Conflict(
      "the data folder was written by a newer version of kinevox; use that version or another folder");
}

int64_t SystemClockMs() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

int64_t SteadyClockMs() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(steady_clock::now().time_since_epoch()).count();
}

struct Database::State {
  std::filesystem::path file;
  ClockMs now, steady;
  std::mutex writing;
  std::atomic<std::thread::id> writer_thread{};
  std::unique_ptr<SQLite::Database> writer;  // none on a read-only disk
  std::mutex pool;
  std::vector<std::unique_ptr<SQLite::Database>> idle_readers;

  bool WritingHere() const { return writer_thread.load() == std::this_thread::get_id(); }
};

Database::Database(const std::filesystem::path& file, ClockMs now, ClockMs steady)
    : state_(std::make_unique<State>()) {
  state_->file = file;
  state_->now = std::move(now);
  state_->steady = std::move(steady);
  try {
    if (OnReadOnlyDisk(file)) {
      RequireUpToDate(*OpenForReading(file));
      return;
    }
    state_->writer = std::make_unique<SQLite::Database>(
        file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kBusyTimeoutMs);
    state_->writer->exec("PRAGMA journal_mode = WAL");
    state_->writer->exec("PRAGMA synchronous = FULL");
    state_->writer->exec("PRAGMA secure_delete = ON");  // names of removed subjects
    state_->writer->exec("PRAGMA foreign_keys = OFF");
    Migrate(*state_->writer);
    state_->writer->exec("PRAGMA foreign_keys = ON");
  } catch (const SQLite::Exception& error) {
    RethrowForUsers(error);
  }
}

Database::~Database() = default;

int64_t Database::NowMs() const { return state_->now(); }
int64_t Database::SteadyMs() const { return state_->steady(); }

void Database::Beat() {
  Write([this](SQLite::Database& db) { sqlite::Execute(db, "beat_pulse", NowMs()); });
}

bool Database::EmptyLog() {
  if (!state_->writer || state_->WritingHere()) return false;
  const std::lock_guard lock(state_->writing);
  try {
    return state_->writer->execAndGet("PRAGMA wal_checkpoint(TRUNCATE)").getInt() == 0;
  } catch (const SQLite::Exception& error) {
    RethrowForUsers(error);
  }
}

void Database::RunWrite(const Step& step) {
  if (state_->WritingHere()) return step(*state_->writer);
  if (!state_->writer) throw Unavailable("the data folder is read-only: nothing can be changed there");
  const std::lock_guard lock(state_->writing);
  struct Mark {
    std::atomic<std::thread::id>& thread;
    explicit Mark(std::atomic<std::thread::id>& t) : thread(t) { thread = std::this_thread::get_id(); }
    ~Mark() { thread = std::thread::id(); }
  } mark(state_->writer_thread);
  try {
    Immediate transaction(*state_->writer);
    step(*state_->writer);
    transaction.Commit();
  } catch (const SQLite::Exception& error) {
    RethrowForUsers(error);
  }
}

void Database::RunRead(const Step& step) {
  if (state_->WritingHere()) return step(*state_->writer);
  std::unique_ptr<SQLite::Database> reader;
  {
    const std::lock_guard lock(state_->pool);
    if (!state_->idle_readers.empty()) {
      reader = std::move(state_->idle_readers.back());
      state_->idle_readers.pop_back();
    }
  }
  try {
    if (!reader) reader = OpenForReading(state_->file);
    step(*reader);
  } catch (const SQLite::Exception& error) {
    RethrowForUsers(error);
  }
  const std::lock_guard lock(state_->pool);
  state_->idle_readers.push_back(std::move(reader));
}

}  // namespace kvx
