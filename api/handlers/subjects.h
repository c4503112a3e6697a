// Subjects: the people (or specimens) whose scans make a model.
#pragma once
#include "api/request.h"
#include "api/services.h"

namespace kvx {

Answer CreateSubject(Services& services, const std::string& body, const std::string& idempotency_key);
// Query: cursor, limit; external_id: of this one alone.
std::string ListSubjects(Services& services, const Query& query);
std::string GetSubject(Services& services, const std::string& id);

// Its records, its files and what was computed of them. `who` goes into the audit trail.
void DeleteSubject(Services& services, const std::string& id, const std::string& who,
                   const std::string& project);
void RemoveModelBytes(Services& services, const std::string& model);

}  // namespace kvx
