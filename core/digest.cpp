// SHA-256 by OpenSSL.
#include "core/digest.h"

#include <openssl/evp.h>

#include <bit>
#include <istream>
#include <stdexcept>
#include <vector>

#include "core/errors.h"

namespace kvx {

struct Hasher::State {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  ~State() { EVP_MD_CTX_free(context); }
};

Hasher::Hasher() : state_(std::make_unique<State>()) {
  if (!state_->context || EVP_DigestInit_ex(state_->context, EVP_sha256(), nullptr) != 1) {
    throw std::runtime_error("SHA-256 is not available from OpenSSL");
  }
}
Hasher::~Hasher() = default;

Hasher& Hasher::Raw(std::span<const std::byte> bytes) {
  EVP_DigestUpdate(state_->context, bytes.data(), bytes.size());
  return *this;
}

Hasher& Hasher::Add(int64_t value) { return Raw(std::as_bytes(std::span(&value, 1))); }
Hasher& Hasher::Add(double value) { return Add(std::bit_cast<int64_t>(value)); }
Hasher& Hasher::Add(std::string_view part) {
  Add(int64_t(part.size()));
  return Raw(std::as_bytes(std::span(part)));
}
Hasher& Hasher::Add(const Digest& part) { return Raw(std::as_bytes(std::span(part.bytes))); }

Digest Hasher::Finish() {
  Digest out;
  EVP_DigestFinal_ex(state_->context, out.bytes.data(), nullptr);
  return out;
}

std::string Digest::Hex() const {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (const uint8_t byte : bytes) {
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

Digest Digest::FromHex(std::string_view hex) {
  const auto value = [](char c) -> int {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    throw InputError("a digest is 64 lower-case hexadecimal digits");
  };
  if (hex.size() != 64) throw InputError("a digest is 64 lower-case hexadecimal digits");
  Digest out;
  for (size_t i = 0; i < 32; ++i) out.bytes[i] = uint8_t(value(hex[2 * i]) * 16 + value(hex[2 * i + 1]));
  return out;
}

Digest Sha256(std::string_view bytes) { return Hasher().Raw(std::as_bytes(std::span(bytes))).Finish(); }

Digest Sha256(std::istream& bytes) {
  Hasher hasher;
  std::vector<char> chunk(size_t(1) << 20);
  while (bytes.read(chunk.data(), std::streamsize(chunk.size())) || bytes.gcount() > 0)
    hasher.Raw(std::as_bytes(std::span(chunk.data(), size_t(bytes.gcount()))));
  return hasher.Finish();
}

}  // namespace kvx
