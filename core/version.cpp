// The build gives it to this source alone: a new version compiles nothing else anew.
#include "core/version.h"

namespace kvx {

const char* ProgramVersion() { return KVX_VERSION; }

}  // namespace kvx
