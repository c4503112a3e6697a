// Identifiers that nobody can guess and every URL can carry: prefix, underscore, 128 random bits.
#pragma once
#include <string>
#include <string_view>

namespace kvx {

// Of records "sub", "scn", "bon", "mdl", "job", "bat", "upl", "whk"; others name keys, leases and files.
std::string NewId(std::string_view prefix);
bool LooksLikeId(std::string_view text, std::string_view prefix);

}  // namespace kvx
