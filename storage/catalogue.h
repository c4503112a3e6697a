// Subjects, their scans and bones, and the models made of them: metadata and digests, never voxels.
#pragma once
#include <set>
#include <string>

#include "storage/database/database.h"
#include "storage/page.h"
#include "storage/project.h"

namespace kvx {

struct SubjectRecord {
  int64_t seq = 0;
  std::string id;
  std::optional<std::string> name;
  std::string region;
  std::optional<std::string> external_id;
  int64_t created_ms = 0;
};

// Where uploaded bytes lie (BlobStore) and what was found in them.
struct StoredFile {
  std::string sha256;   // of the bytes as uploaded, hexadecimal
  std::string content;  // blob name
  std::string suffix;   // ".nii.gz", ...; empty for a folder
  int64_t bytes = 0;
  std::string facts;  // JSON
};

struct ScanRecord {
  int64_t seq = 0;
  std::string id, subject, name;
  StoredFile file;
  int64_t created_ms = 0;
};

struct BonesRecord {
  int64_t seq = 0;
  std::string id, subject, template_scan;
  StoredFile file;
  int64_t created_ms = 0;
};

struct ModelRecord {
  int64_t seq = 0;
  std::string id, subject, template_scan;
  std::string request;  // of one that is added; it may be long, and none that is found has it
  std::string job;
  std::optional<std::string> digest;  // ModelManifest::ContentDigest, once built
  int64_t created_ms = 0;
  std::string job_state;
};

struct BatchRecord {
  int64_t seq = 0;
  std::string id;
  std::optional<std::string> name;
  int64_t created_ms = 0;
};

struct NewSubject {
  std::optional<std::string> name;
  std::string region;
  std::optional<std::string> external_id;
};

class Catalogue {
 public:
  explicit Catalogue(Database& db, ProjectFilter project = {}) : db_(db), project_(std::move(project)) {}
  Catalogue ForProject(const std::string& project) const { return Catalogue(db_, project); }

  SubjectRecord AddSubject(const NewSubject& subject);  // throws Conflict for a known external id
  SubjectRecord RequireSubject(const std::string& id);  // every Require throws NotFound
  Page<SubjectRecord> Subjects(const PageRequest& page,
                               const std::optional<std::string>& external_id = {});  // of this one alone

  ScanRecord AddScan(const std::string& subject, const std::string& name,
                     const StoredFile& file);  // Conflict: name taken
  ScanRecord RequireScan(const std::string& id);
  std::optional<ScanRecord> FindScan(const std::string& subject, const std::string& name);
  Page<ScanRecord> Scans(const std::string& subject, const PageRequest& page);
  std::vector<ScanRecord> AllScans(const std::string& subject);  // in the order of upload

  // `id`: of NewBonesId, where it was told before the label map was there.
  BonesRecord AddBones(const std::string& subject, const std::string& template_scan, const StoredFile& file,
                       const std::string& id = NewBonesId());
  static std::string NewBonesId();
  BonesRecord RequireBones(const std::string& id);
  Page<BonesRecord> Bones(const std::string& subject, const PageRequest& page);
  std::optional<BonesRecord> LatestBones(const std::string& subject, const std::string& template_scan);

  // Uploads of the same bytes, newest first: what is known of them needs no second look.
  std::vector<ScanRecord> ScansOfContent(const std::string& sha256);
  // Of bones, of subjects of this region: it shapes what is told of them.
  std::vector<BonesRecord> BonesOfContent(const std::string& sha256, const std::string& region);
  std::set<std::string> BlobsInUse();

  // The job must exist in the same transaction.
  void AddModel(const ModelRecord& model);
  ModelRecord RequireModel(const std::string& id);
  void SetModelDigest(const std::string& id, const std::string& digest);  // built
  Page<ModelRecord> Models(const PageRequest& page, const std::optional<std::string>& subject = {});

  BatchRecord AddBatch(const std::optional<std::string>& name);
  BatchRecord RequireBatch(const std::string& id);
  Page<BatchRecord> Batches(const PageRequest& page);

 private:
  Database& db_;
  ProjectFilter project_;
};

}  // namespace kvx
