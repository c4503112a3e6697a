// Crockford's base 32 in lower case: no letters that look like digits.
#include "storage/ids.h"

#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace kvx {
namespace {
constexpr std::string_view kLetters = "0123456789abcdefghjkmnpqrstvwxyz";
constexpr size_t kRandomLetters = 26;  // 5 bits each: at least 128
}  // namespace

std::string NewId(std::string_view prefix) {
  std::array<unsigned char, kRandomLetters> random;
  if (RAND_bytes(random.data(), int(random.size())) != 1)
    throw std::runtime_error("no random numbers from OpenSSL");
  std::string id = std::string(prefix) + "_";
  for (const unsigned char byte : random) id += kLetters[byte & 31];
  return id;
}

bool LooksLikeId(std::string_view text, std::string_view prefix) {
  if (text.size() != prefix.size() + 1 + kRandomLetters || !text.starts_with(prefix)) return false;
  if (text[prefix.size()] != '_') return false;
  text.remove_prefix(prefix.size() + 1);
  return std::ranges::all_of(text, [](char c) { return kLetters.find(c) != std::string_view::npos; });
}

}  // namespace kvx
