// One statement per question; uniqueness is asked for first, so that the answer is a sentence.
#include "storage/catalogue.h"

#include "core/errors.h"
#include "storage/database/sqlite.h"
#include "storage/ids.h"

namespace kvx {
namespace {

using sqlite::Integer;
using sqlite::OptionalText;
using sqlite::Text;

constexpr int kUploadsOfContent = 50;  // at most

SubjectRecord SubjectRow(SQLite::Statement& row) {
  return {Integer(row, 0), Text(row, 1),         OptionalText(row, 2),
          Text(row, 3),    OptionalText(row, 4), Integer(row, 5)};
}

BatchRecord BatchRow(SQLite::Statement& row) {
  return {Integer(row, 0), Text(row, 1), OptionalText(row, 2), Integer(row, 3)};
}

StoredFile FileRow(SQLite::Statement& row, int first) {
  return {Text(row, first), Text(row, first + 1), Text(row, first + 2), Integer(row, first + 3),
          Text(row, first + 4)};
}

// Scans and bones share the order of their columns.
template <class Record>
Record UploadRow(SQLite::Statement& row) {
  return {Integer(row, 0), Text(row, 1), Text(row, 2), Text(row, 3), FileRow(row, 4), Integer(row, 9)};
}

ModelRecord ModelRow(SQLite::Statement& row) {
  ModelRecord model;
  model.seq = Integer(row, 0);
  model.id = Text(row, 1);
  model.subject = Text(row, 2);
  model.template_scan = Text(row, 3);
  model.job = Text(row, 4);
  model.digest = OptionalText(row, 5);
  model.created_ms = Integer(row, 6);
  model.job_state = Text(row, 7);
  return model;
}

template <class T>
T Required(std::optional<T> found, const char* sentence) {
  if (!found) throw NotFound(sentence);
  return *std::move(found);
}

}  // namespace

SubjectRecord Catalogue::AddSubject(const NewSubject& subject) {
  return db_.Write([&](SQLite::Database& db) {
    if (subject.external_id) {
      const auto id = [](SQLite::Statement& row) { return Text(row, 0); };
      const auto there =
          sqlite::One(db, "find_external_id", id, *subject.external_id, ProjectOfNew(project_));
      if (there) throw Conflict("a subject with this external_id exists already: " + *there);
    }
    const std::string id = NewId("sub");
    sqlite::Execute(db, "insert_subject", id, subject.name, subject.region, subject.external_id, db_.NowMs(),
                    ProjectOfNew(project_));
    return *sqlite::One(db, "find_subject", SubjectRow, id, project_);
  });
}

SubjectRecord Catalogue::RequireSubject(const std::string& id) {
  return db_.Read([&](SQLite::Database& db) {
    return Required(sqlite::One(db, "find_subject", SubjectRow, id, project_), "there is no such subject");
  });
}

Page<SubjectRecord> Catalogue::Subjects(const PageRequest& page,
                                        const std::optional<std::string>& external_id) {
  return db_.Read([&](SQLite::Database& db) {
    return MakePage(page, [&](int rows) {
      return external_id ? sqlite::All(db, "list_subjects_called", SubjectRow, page.before, rows, project_,
                                       *external_id)
                         : sqlite::All(db, "list_subjects", SubjectRow, page.before, rows, project_);
    });
  });
}

ScanRecord Catalogue::AddScan(const std::string& subject, const std::string& name, const StoredFile& file) {
  return db_.Write([&](SQLite::Database& db) {
    if (sqlite::One(db, "find_scan_by_name", UploadRow<ScanRecord>, subject, name)) {
      throw Conflict("the subject has a scan of this name already; give the new one another name");
    }
    const std::string id = NewId("scn");
    sqlite::Execute(db, "insert_scan", id, subject, name, file.sha256, file.content, file.suffix, file.bytes,
                    file.facts, db_.NowMs());
    return *sqlite::One(db, "find_scan", UploadRow<ScanRecord>, id, project_);
  });
}

ScanRecord Catalogue::RequireScan(const std::string& id) {
  return db_.Read([&](SQLite::Database& db) {
    return Required(sqlite::One(db, "find_scan", UploadRow<ScanRecord>, id, project_),
                    "there is no such scan");
  });
}

std::optional<ScanRecord> Catalogue::FindScan(const std::string& subject, const std::string& name) {
  return db_.Read([&](SQLite::Database& db) {
    return sqlite::One(db, "find_scan_by_name", UploadRow<ScanRecord>, subject, name);
  });
}

Page<ScanRecord> Catalogue::Scans(const std::string& subject, const PageRequest& page) {
  return db_.Read([&](SQLite::Database& db) {
    return MakePage(page, [&](int rows) {
      return sqlite::All(db, "list_scans", UploadRow<ScanRecord>, subject, page.before, rows);
    });
  });
}

std::vector<ScanRecord> Catalogue::AllScans(const std::string& subject) {
  return db_.Read(
      [&](SQLite::Database& db) { return sqlite::All(db, "all_scans", UploadRow<ScanRecord>, subject); });
}

std::string Catalogue::NewBonesId() { return NewId("bon"); }

BonesRecord Catalogue::AddBones(const std::string& subject, const std::string& template_scan,
                                const StoredFile& file, const std::string& id) {
  return db_.Write([&](SQLite::Database& db) {
    sqlite::Execute(db, "insert_bones", id, subject, template_scan, file.sha256, file.content, file.suffix,
                    file.bytes, file.facts, db_.NowMs());
    return *sqlite::One(db, "find_bones", UploadRow<BonesRecord>, id, project_);
  });
}

BonesRecord Catalogue::RequireBones(const std::string& id) {
  return db_.Read([&](SQLite::Database& db) {
    return Required(
        sqlite::One(db, "find_bones", UploadRow<BonesRecord>, id, project_),
        "there is no such label map of bones; one that a job makes is there when the job has succeeded");
  });
}

Page<BonesRecord> Catalogue::Bones(const std::string& subject, const PageRequest& page) {
  return db_.Read([&](SQLite::Database& db) {
    return MakePage(page, [&](int rows) {
      return sqlite::All(db, "list_bones", UploadRow<BonesRecord>, subject, page.before, rows);
    });
  });
}

std::optional<BonesRecord> Catalogue::LatestBones(const std::string& subject,
                                                  const std::string& template_scan) {
  return db_.Read([&](SQLite::Database& db) {
    return sqlite::One(db, "latest_bones", UploadRow<BonesRecord>, subject, template_scan);
  });
}

std::vector<ScanRecord> Catalogue::ScansOfContent(const std::string& sha256) {
  return db_.Read([&](SQLite::Database& db) {
    return sqlite::All(db, "scans_of_content", UploadRow<ScanRecord>, sha256, kUploadsOfContent, project_);
  });
}

std::vector<BonesRecord> Catalogue::BonesOfContent(const std::string& sha256, const std::string& region) {
  return db_.Read([&](SQLite::Database& db) {
    return sqlite::All(db, "bones_of_content", UploadRow<BonesRecord>, sha256, kUploadsOfContent, project_,
                       region);
  });
}

std::set<std::string> Catalogue::BlobsInUse() {
  const auto names = db_.Read([&](SQLite::Database& db) {
    return sqlite::All(db, "blobs_in_use", [](SQLite::Statement& row) { return Text(row, 0); });
  });
  return {names.begin(), names.end()};
}

void Catalogue::AddModel(const ModelRecord& model) {
  db_.Write([&](SQLite::Database& db) {
    sqlite::Execute(db, "insert_model", model.id, model.subject, model.template_scan, model.request,
                    model.job, db_.NowMs());
  });
}

ModelRecord Catalogue::RequireModel(const std::string& id) {
  return db_.Read([&](SQLite::Database& db) {
    return Required(sqlite::One(db, "find_model", ModelRow, id, project_), "there is no such model");
  });
}

BatchRecord Catalogue::AddBatch(const std::optional<std::string>& name) {
  return db_.Write([&](SQLite::Database& db) {
    const std::string id = NewId("bat");
    sqlite::Execute(db, "insert_batch", id, name, db_.NowMs(), ProjectOfNew(project_));
    return *sqlite::One(db, "find_batch", BatchRow, id, project_);
  });
}

BatchRecord Catalogue::RequireBatch(const std::string& id) {
  return db_.Read([&](SQLite::Database& db) {
    return Required(sqlite::One(db, "find_batch", BatchRow, id, project_), "there is no such batch");
  });
}

Page<BatchRecord> Catalogue::Batches(const PageRequest& page) {
  return db_.Read([&](SQLite::Database& db) {
    return MakePage(page, [&](int rows) {
      return sqlite::All(db, "list_batches", BatchRow, page.before, rows, project_);
    });
  });
}

void Catalogue::SetModelDigest(const std::string& id, const std::string& digest) {
  db_.Write([&](SQLite::Database& db) { sqlite::Execute(db, "set_model_digest", id, digest); });
}

Page<ModelRecord> Catalogue::Models(const PageRequest& page, const std::optional<std::string>& subject) {
  return db_.Read([&](SQLite::Database& db) {
    return MakePage(page, [&](int rows) {
      return subject
                 ? sqlite::All(db, "list_models_of_subject", ModelRow, page.before, rows, project_, *subject)
                 : sqlite::All(db, "list_models", ModelRow, page.before, rows, project_);
    });
  });
}

}  // namespace kvx
