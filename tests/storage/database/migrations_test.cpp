// A data folder of the schema before this one, with rows of all that the step changes.
#include <gtest/gtest.h>

#include "core/errors.h"
#include "storage/catalogue.h"
#include "storage/database/sqlite.h"
#include "storage/job_queue.h"
#include "storage/retention.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

constexpr char kBuild[] = R"({"study":{},"files":[{"name":"a","content":"aa"}],"method":"adaptive"})";
constexpr char kMotion[] = R"({"key_frames":"time,tibia.flexion","mode":"evd"})";
constexpr char kStrokes[] = R"({"subject":"sub_1","files":[{"name":"scan","content":"aa"},)"
                            R"({"name":"strokes","content":"bb"}]})";
constexpr char kStray[] = R"({"subject":"sub_gone","files":[{"name":"strokes","content":"cc"}]})";

void MakeSchema4(const std::filesystem::path& file) {
  SQLite::Database old(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  for (const char* step :
       {"migration_001.sql", "migration_002.sql", "migration_003.sql", "migration_004.sql"})
    old.exec(std::string(EmbeddedSql(step)));
  old.exec("PRAGMA user_version = 4");
  old.exec("INSERT INTO subject (id, project, region, created_ms) VALUES ('sub_1', 'default', 'knee', 7)");
  old.exec(
      "INSERT INTO scan (id, subject, name, sha256, content, suffix, bytes, facts, created_ms)"
      " VALUES ('scn_1', 'sub_1', 'pose00', 'aa', 'aa', '.nii', 3, '{}', 8)");
  const auto add_job = [&](const char* id, const char* kind, const char* model, const char* request,
                           const char* state) {
    SQLite::Statement insert(old,
                             "INSERT INTO job (id, kind, model, request, state, priority, max_attempts,"
                             " created_ms, batch) VALUES (?, ?, ?, ?, ?, 0, 5, 9, 'bat_1')");
    int column = 0;
    for (const char* text : {id, kind, model, request, state}) insert.bind(++column, text);
    insert.exec();
  };
  add_job("job_build", "build_model", "mdl_1", kBuild, "succeeded");
  add_job("job_motion", "animation", "mdl_1", kMotion, "queued");
  add_job("job_strokes", "segment_bones", "", kStrokes, "failed");
  add_job("job_stray", "segment_bones", "", kStray, "failed");  // its subject was removed before it began
  add_job("job_other", "build_model", "mdl_none", "{}", "cancelled");
  old.exec(
      "INSERT INTO job_event (job, at_ms, state, stage, progress, attempt) SELECT id, 9, state, '', 0, 0 "
      "FROM "
      "job");
  old.exec(
      "INSERT INTO model (id, subject, template, request, job, created_ms)"
      " VALUES ('mdl_1', 'sub_1', 'pose00', '{}', 'job_build', 9)");
}

std::vector<std::string> Texts(Database& db, const char* sql) {
  return db.Read([&](SQLite::Database& d) {
    std::vector<std::string> texts;
    SQLite::Statement query(d, sql);
    while (query.executeStep()) texts.push_back(sqlite::Text(query, 0));
    return texts;
  });
}

TEST(Migrations, JobsOfSchema4KeepTheirRequestsAndLearnTheirSubject) {
  const testing_support::ScratchFolder scratch;
  const auto file = scratch.path() / "old.db";
  MakeSchema4(file);
  Database db(file);
  JobQueue jobs(db);
  EXPECT_EQ(jobs.RequestOf("job_build"), kBuild);
  EXPECT_EQ(jobs.RequestOf("job_strokes"), kStrokes);
  EXPECT_EQ(jobs.OfBatch("bat_1").size(), 4u);
  EXPECT_EQ(jobs.List({}).items.at(0).id, "job_other") << "lists keep their order";
  EXPECT_EQ(Texts(db, "SELECT id FROM job WHERE subject = 'sub_1' ORDER BY seq"),
            (std::vector<std::string>{"job_build", "job_motion", "job_strokes"}));
  EXPECT_EQ(Catalogue(db).RequireModel("mdl_1").job_state, "succeeded");
  const ClaimedJob claimed = *jobs.Claim("w");
  EXPECT_EQ(claimed.id, "job_motion");
  EXPECT_EQ(claimed.request, kMotion);
}

TEST(Migrations, WhatRemovedSubjectsLeftInSchema4Goes) {
  const testing_support::ScratchFolder scratch;
  const auto file = scratch.path() / "old.db";
  MakeSchema4(file);
  Database db(file);
  JobQueue jobs(db);
  EXPECT_THROW(jobs.Require("job_stray"), NotFound);
  EXPECT_TRUE(jobs.EventsAfter("job_stray", 0).empty());
  EXPECT_EQ(Texts(db, "SELECT name FROM removal WHERE kind = 'blob'"), std::vector<std::string>{"cc"});
  BlobStore blobs(scratch.path());
  AuditTrail audit(db);
  Retention retention(db, blobs, audit, scratch.path() / "uploads");
  EXPECT_THROW(retention.DeleteSubject("sub_1", "key_a", "default"), Conflict) << "its motion waits";
  jobs.Cancel("job_motion");
  retention.DeleteSubject("sub_1", "key_a", "default");
  EXPECT_EQ(Texts(db, "SELECT id FROM job"), std::vector<std::string>{"job_other"});
  EXPECT_EQ(Texts(db, "SELECT job FROM job_request"), std::vector<std::string>{"job_other"});
  EXPECT_EQ(Texts(db, "SELECT DISTINCT job FROM job_event"), std::vector<std::string>{"job_other"});
  EXPECT_EQ(Texts(db, "SELECT name FROM removal WHERE kind = 'blob' ORDER BY name"),
            (std::vector<std::string>{"aa", "bb", "cc"}));
}

}  // namespace
}  // namespace kvx
