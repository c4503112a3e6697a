// Transactions, migrations and kept answers on real SQLite files.
#include "storage/database/database.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <thread>

#include "core/errors.h"
#include "storage/catalogue.h"
#include "storage/database/open_for_reading.h"
#include "storage/database/sqlite.h"
#include "storage/idempotency.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ScratchFolder;

int64_t CountSubjects(Database& db) {
  return db.Read([](SQLite::Database& d) { return d.execAndGet("SELECT count(*) FROM subject").getInt64(); });
}

// As a connexion has it that copies the log back before it closes as the last one.
TEST(Database, AReadWaitsForWhoeverHasTheFileToItself) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "a.db";
  { Database made(file); }
  auto other = std::make_unique<SQLite::Database>(file.string(), SQLite::OPEN_READWRITE);
  other->exec("PRAGMA locking_mode = EXCLUSIVE");
  other->exec("INSERT INTO batch (id, created_ms, project) VALUES ('bat_1', 1, 'default')");
  std::thread lets_go([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    other.reset();
  });
  EXPECT_NO_THROW(EXPECT_EQ(OpenForReading(file)->execAndGet("SELECT count(*) FROM batch").getInt(), 1));
  lets_go.join();
}

TEST(Database, MigratesAnEmptyFileAndOpensItAgain) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "a.db";
  {
    Database db(file);
    Catalogue(db).AddSubject({std::nullopt, "knee", std::nullopt});
  }
  Database again(file);
  EXPECT_EQ(CountSubjects(again), 1);
  EXPECT_EQ(again.Read([](SQLite::Database& d) { return d.execAndGet("PRAGMA journal_mode").getString(); }),
            "wal");
}

// What has been answered is on disk when the power goes, and what was removed is overwritten.
TEST(Database, IsWrittenThroughAndWipedAndWatched) {
  const ScratchFolder scratch;
  Database db(scratch.path() / "a.db");
  for (const auto& [setting, value] :
       {std::pair{"synchronous", 2}, {"secure_delete", 1}, {"foreign_keys", 1}}) {
    const std::string asked = std::string("PRAGMA ") + setting;
    EXPECT_EQ(db.Write([&](SQLite::Database& d) { return d.execAndGet(asked).getInt(); }), value) << setting;
  }
}

TEST(Database, RefusesTheSchemaOfANewerProgram) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "a.db";
  {
    Database db(file);
    db.Write([](SQLite::Database& d) { d.exec("PRAGMA user_version = 900"); });
  }
  EXPECT_THROW(Database{file}, Conflict);
}

TEST(Database, RefusesAFileThatIsNoDatabase) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "a.db";
  std::ofstream(file) << std::string(5000, 'x');
  EXPECT_THROW(Database{file}, Unavailable);
}

// Neither every row nor a sort: a page costs what it holds.
TEST(Database, ListsThatAreSearchedUseAnIndex) {
  const ScratchFolder scratch;
  Database db(scratch.path() / "a.db");
  for (const auto& [list, index] : {std::pair{"list_subjects_called", "subject_of_external_id"},
                                    {"list_models_of_subject", "model_of_subject"},
                                    {"list_jobs_in_state", "job_of_state"},
                                    {"count_subject_jobs", "job_of_subject"}}) {
    std::string plan;
    db.Read([&](SQLite::Database& d) {
      SQLite::Statement step(d, "EXPLAIN QUERY PLAN " + sqlite::Sql(list));
      while (step.executeStep()) plan += sqlite::Text(step, 3) + "\n";
    });
    EXPECT_NE(plan.find(std::string(" USING INDEX ") + index), plan.npos) << list << ":\n" << plan;
    EXPECT_EQ(plan.find("TEMP B-TREE"), plan.npos) << list << ":\n" << plan;
  }
}

// Of two workers' looks each second, whatever the jobs are that have ended.
TEST(Database, TheNextJobIsFoundWithoutThoseThatHaveEnded) {
  const ScratchFolder scratch;
  Database db(scratch.path() / "a.db");
  for (const char* search : {"claim_next_job", "jobs_before"}) {
    std::string plan;
    db.Read([&](SQLite::Database& d) {
      SQLite::Statement step(d, "EXPLAIN QUERY PLAN " + sqlite::Sql(search));
      while (step.executeStep()) plan += sqlite::Text(step, 3) + "\n";
    });
    EXPECT_NE(plan.find("SEARCH begun USING COVERING INDEX job_begun"), plan.npos) << search << ":\n" << plan;
    EXPECT_EQ(plan.find("SCAN job\n"), plan.npos) << search << ":\n" << plan;
  }
}

TEST(Database, AThrowRollsBackEverythingJoined) {
  const ScratchFolder scratch;
  Database db(scratch.path() / "a.db");
  Catalogue catalogue(db);
  EXPECT_THROW(db.Write([&](SQLite::Database&) {
    catalogue.AddSubject({std::nullopt, "knee", std::nullopt});
    EXPECT_EQ(CountSubjects(db), 1) << "its own writes are seen inside";
    throw InputError("no");
  }),
               InputError);
  EXPECT_EQ(CountSubjects(db), 0);
}

TEST(Database, TablesAreStrict) {
  const ScratchFolder scratch;
  Database db(scratch.path() / "a.db");
  EXPECT_THROW(db.Write([](SQLite::Database& d) {
    d.exec("INSERT INTO subject (id, region, created_ms) VALUES ('x', 'knee', 'yesterday')");
  }),
               SQLite::Exception);
}

TEST(Idempotency, TheSameRequestRunsOnceAndAnotherIsRefused) {
  const ScratchFolder scratch;
  Database db(scratch.path() / "a.db");
  Idempotency kept(db);
  int runs = 0;
  const auto make = [&]() -> KeptAnswer { return {201, "/x", "run " + std::to_string(++runs)}; };
  const RequestKey key{"POST /a", "k1", Sha256("body")};
  EXPECT_EQ(kept.Once(key, make).body, "run 1");
  EXPECT_EQ(kept.Once(key, make).body, "run 1");
  EXPECT_EQ(kept.Once(key, make).location, "/x");
  EXPECT_THROW(kept.Once({"POST /a", "k1", Sha256("other")}, make), Conflict);
  EXPECT_EQ(kept.Once({"POST /b", "k1", Sha256("body")}, make).body, "run 2") << "another address";
  EXPECT_EQ(kept.Once({"POST /a", "", Sha256("body")}, make).body, "run 3") << "no key, nothing kept";
}

TEST(Idempotency, AFailedRequestLeavesNoAnswerAndNoEffect) {
  const ScratchFolder scratch;
  Database db(scratch.path() / "a.db");
  Idempotency kept(db);
  Catalogue catalogue(db);
  const RequestKey key{"POST /a", "k1", Sha256("body")};
  EXPECT_THROW(kept.Once(key,
                         [&]() -> KeptAnswer {
                           catalogue.AddSubject({std::nullopt, "knee", std::nullopt});
                           throw Unavailable("not now");
                         }),
               Unavailable);
  EXPECT_EQ(CountSubjects(db), 0);
  EXPECT_EQ(kept.Once(key, [] { return KeptAnswer{200, "", "now"}; }).body, "now");
}

TEST(Idempotency, OldAnswersAreForgotten) {
  const ScratchFolder scratch;
  int64_t now_ms = 1000;
  Database db(scratch.path() / "a.db", [&] { return now_ms; });
  Idempotency kept(db);
  const RequestKey key{"POST /a", "k1", Sha256("body")};
  kept.Once(key, [] { return KeptAnswer{200, "", "old"}; });
  now_ms += 5000;
  kept.ForgetOlderThan(4000);
  EXPECT_EQ(kept.Once(key, [] { return KeptAnswer{200, "", "new"}; }).body, "new");
}

}  // namespace
}  // namespace kvx
