// Stored scans and label maps as files of a format that is asked for.
#pragma once
#include "api/handlers/pose_query.h"

namespace kvx {

// What is asked for, and what the file is called: our id.
struct StoredForm {
  std::string id;
  std::string format;  // the end of the file's name
};
using Convert = std::function<void(const StudyFile& stored, const std::filesystem::path& out)>;

// As it was uploaded where that is the format; else converted, in its turn, each time anew: a kept copy would
// outlive its subject.
FileAnswer AnswerWithStored(Services& services, const StoredFile& file, const StoredForm& form,
                            const Conditions& conditions, const Convert& convert);

}  // namespace kvx
