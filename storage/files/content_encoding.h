// Content codings of HTTP: which one a client wants, and files in it.
#pragma once
#include <filesystem>
#include <string>

#include "storage/files/result_cache.h"

namespace kvx {

enum class Encoding { kIdentity, kGzip, kZstd };
const char* NameOf(Encoding encoding);  // as in Content-Encoding; "" for identity

// The best of an Accept-Encoding header (RFC 9110, 12.5.3); of equals zstd, then gzip.
// Identity where nothing is said.
Encoding BestEncoding(const std::string& accept_encoding);

// Copies the first `plain_bytes` as they are and the rest in the coding.
// Throws Unavailable when it cannot be written.
void WriteEncoded(const CachedFile& from, size_t plain_bytes, Encoding encoding,
                  const std::filesystem::path& to);

}  // namespace kvx
