// Records as the JSON that clients see.
#pragma once
#include "api/inspector_port.h"
#include "api/request.h"
#include "storage/audit.h"
#include "storage/catalogue.h"
#include "storage/job_queue.h"
#include "storage/webhook_outbox.h"

namespace kvx {

Json View(const ProposedBone& bone);
Json View(const SubjectRecord& subject);
Json View(const ScanRecord& scan);
Json View(const BonesRecord& bones);
Json View(const ModelRecord& model);  // in lists; one model alone is its InfoJson
Json View(const JobRecord& job);
Json View(const AuditRecord& record);
Json View(const BatchRecord& batch);                     // without its jobs
Json View(const Webhook& webhook);                       // without its secret
Json View(const JobRecord& job, const JobEvent& event);  // the job as it was at the event

Json FactsJson(const ScanFacts& facts);
Json FactsJson(const LabelFacts& facts);
std::string_view NameOf(ScalarType type);

// {"items": [...], "next": "c12" or null}
template <class Record>
Json PageView(const Page<Record>& page);

Grid GridOf(const Json& facts);  // of FactsJson; throws what the JSON library throws for other documents
Grid GridOf(const StoredFile& volume);
double VoxelsOf(const ScanRecord& scan);

}  // namespace kvx
