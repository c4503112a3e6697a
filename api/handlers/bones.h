// Bones of a template: label maps as uploaded, or made of strokes or a threshold by a job.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

// Where bones come from; what `kind` says in a query.
enum class BonesKind { kLabels, kSeeds, kThreshold };
BonesKind BonesKindOf(const Query& query);  // throws InputError

// The scan that a request names as its template; throws NotFound.
ScanRecord RequireTemplate(Services& services, const std::string& subject, const std::string& name);

struct SegmentationRequest {
  std::string subject, template_scan;
  std::optional<double> level_hu;  // by threshold; none: found in the scan
  std::string previous;            // id of the label map that fewer strokes gave; empty: from scratch
};

// A segmentation that has been checked, not yet submitted.
struct PreparedSegmentation {
  std::string subject, template_scan;
  std::string bones;   // id of the label map to be
  std::string stored;  // what the worker runs
  int64_t need_bytes = 0;
  double work = 0;
};

// Memory that looking for bones takes, at most; a CT's on blocks of voxels takes less. CT that its file does
// not call one (NIfTI has no word for it) counts as MR where strokes are given.
int64_t SegmentationBytes(double voxels, bool ct);

// `strokes`: kept or about to be, at `at`; none: by threshold. Throws InputError for what no label map can be
// made of, NotFound when the subject has no such previous one.
PreparedSegmentation PrepareSegmentation(Services& services, const SegmentationRequest& request,
                                         const StoredFile* strokes, const std::filesystem::path& at);
// Within a transaction. 202 with the id that the label map will have, and the job.
Answer SubmitSegmentation(Services& services, const PreparedSegmentation& segmentation);

// POST /v1/subjects/{s}/bones?template=pose00&kind=threshold&threshold=auto|HU, without a body.
Answer CreateThresholdBones(Services& services, const std::string& subject, const Query& query,
                            const std::string& idempotency_key);

std::string ListBones(Services& services, const std::string& subject, const Query& query);
// Of a template's name the newest.
std::string GetBones(Services& services, const std::string& subject, const std::string& id_or_template);
// The label map itself. Query: format=nii.gz|nii|nrrd|mha.
FileAnswer GetBonesVolume(Services& services, const std::string& subject, const std::string& id_or_template,
                          const Query& query, const Conditions& conditions);

// The worker's side: the job's result, and what writes the record when the job ends.
struct MadeBones {
  std::string result;
  std::function<void()> record;
};
MadeBones MakeBones(Services& services, const std::string& stored_request, const Progress& progress);

}  // namespace kvx
