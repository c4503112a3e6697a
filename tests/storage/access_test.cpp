// API keys, projects, the audit trail, removal of a subject,
// and schemas from the oldest on, in real SQLite files.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "core/errors.h"
#include "storage/api_keys.h"
#include "storage/catalogue.h"
#include "storage/database/sqlite.h"
#include "storage/idempotency.h"
#include "storage/job_queue.h"
#include "storage/retention.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ScratchFolder;

struct World {
  ScratchFolder scratch;
  int64_t now_ms = 1'000'000'000;
  std::filesystem::path file = scratch.path() / "a.db";
  Database db{file, [this] { return now_ms; }};
  ApiKeys keys{db};
  AuditTrail audit{db};
  BlobStore blobs{scratch.path()};
  Retention retention{db, blobs, audit, scratch.path() / "uploads"};

  std::string Blob(const std::string& bytes) {
    IncomingBlob blob = blobs.Receive(".nii", 1 << 20);
    blob.Write(bytes);
    return blobs.Keep(std::move(blob));
  }
  StoredFile Stored(const std::string& bytes) {
    const std::string name = Blob(bytes);
    return {name, name, ".nii", int64_t(bytes.size()), "{}"};
  }
  int64_t Count(const std::string& table) {
    return db.Read(
        [&](SQLite::Database& d) { return d.execAndGet("SELECT count(*) FROM " + table).getInt64(); });
  }
};

TEST(ApiKeys, CountWhileTheyAreGoodAndNoLonger) {
  World w;
  const auto made = w.keys.Add({"ci", "lab", AccessScope::kWrite, {600, std::nullopt}, 5000});
  const auto found = w.keys.Check(made.text);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->project, "lab");
  EXPECT_EQ(found->scope, AccessScope::kWrite);
  EXPECT_EQ(found->quota.requests_per_minute, 600);
  std::string wrong = made.text;
  wrong.back() = wrong.back() == 'a' ? 'b' : 'a';
  for (const std::string& text :
       {wrong, std::string("kvx."), std::string("kvx.key_1.x"), made.record.id, made.text + "x"}) {
    EXPECT_FALSE(w.keys.Check(text)) << text;
  }
  w.now_ms += 5000;
  EXPECT_FALSE(w.keys.Check(made.text)) << "expired";
  const auto other = w.keys.Add({"x", "lab", AccessScope::kRead, {}, std::nullopt});
  EXPECT_TRUE(w.keys.Check(other.text));
  EXPECT_TRUE(w.keys.Revoke(other.record.id).revoked_ms);
  EXPECT_FALSE(w.keys.Check(other.text));
  EXPECT_THROW(w.keys.Revoke("key_none"), NotFound);
}

TEST(ApiKeys, TheSecretIsNowhereInTheFile) {
  World w;
  const std::string text = w.keys.Add({"ci", "lab", AccessScope::kWrite, {}, std::nullopt}).text;
  const std::string secret = text.substr(text.rfind('.') + 1);
  for (const auto& entry : std::filesystem::directory_iterator(w.scratch.path())) {
    if (!entry.is_regular_file()) continue;
    const std::string bytes = testing_support::Content(entry.path());
    EXPECT_EQ(bytes.find(secret), bytes.npos) << entry.path().filename();
  }
}

TEST(ApiKeys, BytesAreCountedByDay) {
  World w;
  EXPECT_TRUE(w.keys.AddBytes("key_a", 10, 20));
  EXPECT_TRUE(w.keys.AddBytes("key_a", 5, 20));
  EXPECT_FALSE(w.keys.AddBytes("key_a", 6, 20));
  EXPECT_EQ(w.keys.BytesToday("key_a"), 15);
  EXPECT_EQ(w.keys.BytesToday("key_b"), 0);
  w.now_ms += 24 * 3600 * 1000;
  EXPECT_EQ(w.keys.BytesToday("key_a"), 0);
}

TEST(ApiKeys, TheBytesOfADayMayBeUsedToTheLast) {
  World w;
  EXPECT_TRUE(w.keys.AddBytes("key_a", 15, 20));
  EXPECT_FALSE(w.keys.AddBytes("key_a", 6, 20));
  EXPECT_TRUE(w.keys.AddBytes("key_a", 5, 20));
  EXPECT_FALSE(w.keys.AddBytes("key_a", 1, 20));
}

TEST(Projects, RecordsOfAnotherAreNotThere) {
  World w;
  Catalogue a(w.db, "a"), b(w.db, "b"), all(w.db);
  const SubjectRecord subject = a.AddSubject({std::nullopt, "knee", "patient-1"});
  const ScanRecord scan = a.AddScan(subject.id, "pose00", w.Stored("x"));
  const BonesRecord bones = a.AddBones(subject.id, "pose00", w.Stored("y"));
  JobQueue jobs(w.db), jobs_a = jobs.ForProject("a"), jobs_b = jobs.ForProject("b");
  const JobRecord job = jobs_a.Submit({"build_model", "mdl_1", "{}"});
  a.AddModel({0, "mdl_1", subject.id, "pose00", "{}", job.id, {}, 0, ""});
  EXPECT_THROW(b.RequireSubject(subject.id), NotFound);
  EXPECT_THROW(b.RequireScan(scan.id), NotFound);
  EXPECT_THROW(b.RequireBones(bones.id), NotFound);
  EXPECT_THROW(b.RequireModel("mdl_1"), NotFound);
  EXPECT_THROW(jobs_b.Require(job.id), NotFound);
  EXPECT_THROW(jobs_b.Cancel(job.id), NotFound);
  EXPECT_TRUE(b.Subjects({}).items.empty());
  EXPECT_TRUE(b.Models({}).items.empty());
  EXPECT_TRUE(jobs_b.List({}).items.empty());
  EXPECT_NO_THROW(b.AddSubject({std::nullopt, "knee", "patient-1"}))
      << "an external id says nothing about other projects";
  EXPECT_THROW(a.AddSubject({std::nullopt, "knee", "patient-1"}), Conflict);
  EXPECT_EQ(all.Subjects({}).items.size(), 2u);
  EXPECT_EQ(jobs.Claim("w")->id, job.id) << "workers work for everybody";
}

TEST(Projects, KeptAnswersAreNotShared) {
  World w;
  const RequestKey key{"POST /a", "k1", Sha256("body")};
  Idempotency(w.db, "a").Once(key, [] { return KeptAnswer{200, "", "of a"}; });
  EXPECT_FALSE(Idempotency(w.db, "b").Find(key));
  EXPECT_EQ(Idempotency(w.db, "a").Find(key)->body, "of a");
}

TEST(AuditTrail, IsAppendOnlyAndShowsWhatWasChanged) {
  World w;
  for (int i = 0; i < 5; ++i)
    w.audit.Append({"key_a", "lab", "POST /v1/models", "mdl_" + std::to_string(i), "202"});
  const AuditCheck good = w.audit.Verify();
  EXPECT_EQ(good.entries, 5);
  EXPECT_FALSE(good.broken_at);
  EXPECT_TRUE(w.audit.Verify(good.head).knows_head);
  EXPECT_FALSE(w.audit.Verify(std::string(64, '0')).knows_head);
  const auto run = [&](const char* sql) { w.db.Write([&](SQLite::Database& d) { d.exec(sql); }); };
  EXPECT_ANY_THROW(run("DELETE FROM audit WHERE seq = 3"));
  EXPECT_ANY_THROW(run("UPDATE audit SET who = 'somebody' WHERE seq = 3"));
  run("DROP TRIGGER audit_is_not_changed");
  run("UPDATE audit SET object = 'mdl_9' WHERE seq = 3");
  EXPECT_EQ(w.audit.Verify().broken_at, 3);
  run("UPDATE audit SET object = 'mdl_2' WHERE seq = 3");
  EXPECT_FALSE(w.audit.Verify().broken_at);
  run("DROP TRIGGER audit_is_not_deleted");
  run("DELETE FROM audit WHERE seq = 2");
  EXPECT_EQ(w.audit.Verify().broken_at, 3) << "the one after what was taken out";
}

// Whoever can change an entry can give it a hash that fits it: then the next one does not follow.
TEST(AuditTrail, AnEntryRewrittenWithAFittingHashBreaksTheNext) {
  World w, other;
  for (int i = 0; i < 5; ++i) {
    const auto append = [i](World& world, const std::string& object) {
      world.audit.Append({"key_a", "lab", "POST /v1/models", object, "202"});
      world.now_ms += i;
    };
    append(w, "mdl_" + std::to_string(i));
    append(other, i == 2 ? "mdl_9" : "mdl_" + std::to_string(i));
  }
  const AuditRecord fitting = other.audit.List({}).items.at(2);  // newest first: the third of five
  ASSERT_EQ(fitting.entry.object, "mdl_9");
  w.db.Write([&](SQLite::Database& d) {
    d.exec("DROP TRIGGER audit_is_not_changed");
    d.exec("UPDATE audit SET object = 'mdl_9', hash = '" + fitting.hash + "' WHERE seq = 3");
  });
  EXPECT_EQ(w.audit.Verify().broken_at, 4);
}

TEST(Retention, ASubjectGoesWithItsBytesAndSharedOnesStay) {
  World w;
  Catalogue catalogue(w.db);
  const std::string mine = catalogue.AddSubject({"Jane Roe", "knee", std::nullopt}).id;
  const std::string other = catalogue.AddSubject({std::nullopt, "knee", std::nullopt}).id;
  const StoredFile own = w.Stored("own"), shared = w.Stored("shared"), needed = w.Stored("needed");
  catalogue.AddScan(mine, "a", own);
  catalogue.AddScan(mine, "b", shared);
  catalogue.AddScan(other, "a", shared);
  catalogue.AddScan(mine, "c", needed);
  JobQueue jobs(w.db);
  jobs.Submit({"make_bones", "", R"({"files":[{"name":"seeds","content":")" + needed.content + R"("}]})"});
  NewJob build{"build_model", "mdl_1", "{}"};
  build.subject = mine;
  const JobRecord job = jobs.Submit(build);
  catalogue.AddModel({0, "mdl_1", mine, "a", "{}", job.id, {}, 0, ""});
  Idempotency(w.db).Once({"POST /v1/subjects", "k", Sha256("")}, [&] {
    return KeptAnswer{201, "/v1/subjects/" + mine, R"({"name":"Jane Roe"})"};
  });
  EXPECT_THROW(w.retention.DeleteSubject(mine, "key_a", "default"), Conflict) << "its job waits";
  jobs.Cancel(job.id);
  w.retention.DeleteSubject(mine, "key_a", "default");
  EXPECT_THROW(catalogue.RequireModel("mdl_1"), NotFound);
  EXPECT_EQ(w.Count("job"), 1) << "another subject's";
  EXPECT_EQ(w.Count("job_request"), 1);
  EXPECT_EQ(w.Count("idempotency"), 0) << "a kept answer repeats the name";
  EXPECT_TRUE(std::filesystem::exists(w.blobs.PathOf(own.content))) << "records first";
  std::vector<std::string> removed;
  EXPECT_ANY_THROW(w.retention.RemoveBytes([](const std::string&) { throw Unavailable("not now"); }));
  w.retention.RemoveBytes([&](const std::string& model) { removed.push_back(model); });
  EXPECT_EQ(removed, std::vector<std::string>{"mdl_1"}) << "asked again after a failure";
  EXPECT_FALSE(std::filesystem::exists(w.blobs.PathOf(own.content)));
  EXPECT_TRUE(std::filesystem::exists(w.blobs.PathOf(shared.content)));
  EXPECT_TRUE(std::filesystem::exists(w.blobs.PathOf(needed.content)))
      << "a job that waits needs the same bytes";
  EXPECT_EQ(w.Count("removal"), 0);
  const AuditRecord entry = w.audit.List({}).items.at(0);
  EXPECT_EQ(entry.entry.action, "subject removed");
  EXPECT_EQ(entry.entry.object, mine);
  EXPECT_EQ(entry.entry.outcome, "3 scans, 0 label maps, 1 models");
  EXPECT_THROW(w.retention.DeleteSubject(mine, "key_a", "default"), NotFound);
}

// In no file of the data folder, the database's log among them.
TEST(Retention, ARemovedNameIsNowhereOnDisk) {
  World w;
  Catalogue catalogue(w.db);
  const std::string name = "Jane Unforgettable Roe";
  std::vector<std::string> subjects;
  for (int i = 0; i < 50; ++i) {
    const std::string id = catalogue.AddSubject({name + std::to_string(i), "knee", std::nullopt}).id;
    Idempotency(w.db).Once({"POST /v1/subjects", "k" + std::to_string(i), Sha256("")}, [&] {
      return KeptAnswer{201, "/v1/subjects/" + id, "{\"name\":\"" + name + "\"}"};
    });
    subjects.push_back(id);
  }
  const auto files_with_name = [&] {
    int found = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(w.scratch.path())) {
      if (!entry.is_regular_file()) continue;
      std::ostringstream text;
      text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      found += text.str().find(name) != std::string::npos;
    }
    return found;
  };
  EXPECT_GT(files_with_name(), 0);
  for (const std::string& id : subjects) w.retention.DeleteSubject(id, "key_a", "default");
  EXPECT_EQ(files_with_name(), 0);
}

TEST(Migrations, TheOldestSchemaKeepsItsRecords) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "old.db";
  {
    SQLite::Database old(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    old.exec("PRAGMA foreign_keys = ON");
    old.exec(std::string(EmbeddedSql("migration_001.sql")));
    old.exec("PRAGMA user_version = 1");
    old.exec(
        "INSERT INTO subject (id, name, region, external_id, created_ms) VALUES ('sub_1', 'n', 'knee', 'e', "
        "7)");
    old.exec(
        "INSERT INTO scan (id, subject, name, sha256, content, suffix, bytes, facts, created_ms)"
        " VALUES ('scn_1', 'sub_1', 'pose00', 'aa', 'aa', '.nii', 3, '{}', 8)");
    old.exec(
        "INSERT INTO job (id, kind, model, request, state, priority, max_attempts, created_ms)"
        " VALUES ('job_1', 'build_model', 'mdl_1', '{}', 'queued', 0, 5, 9)");
    old.exec(
        "INSERT INTO model (id, subject, template, request, job, created_ms)"
        " VALUES ('mdl_1', 'sub_1', 'pose00', '{}', 'job_1', 9)");
    old.exec("INSERT INTO idempotency VALUES ('POST /a', 'k', '" + Sha256("body").Hex() +
             "', 200, '', 'kept', 9)");
  }
  Database db(file);
  Catalogue catalogue(db, kDefaultProject);
  EXPECT_EQ(catalogue.RequireSubject("sub_1").external_id, "e");
  EXPECT_EQ(catalogue.AllScans("sub_1").size(), 1u);
  EXPECT_EQ(catalogue.RequireModel("mdl_1").job_state, "queued");
  EXPECT_EQ(JobQueue(db).ForProject(kDefaultProject).Require("job_1").created_ms, 9);
  EXPECT_EQ(Idempotency(db, kDefaultProject).Find({"POST /a", "k", Sha256("body")})->body, "kept");
  EXPECT_THROW(db.Write([](SQLite::Database& d) { d.exec("DELETE FROM subject WHERE id = 'sub_1'"); }),
               SQLite::Exception)
      << "references are watched again";
  const SubjectRecord next = catalogue.AddSubject({std::nullopt, "hand", std::nullopt});
  EXPECT_GT(next.seq, catalogue.RequireSubject("sub_1").seq) << "lists keep their order";
}

}  // namespace
}  // namespace kvx
