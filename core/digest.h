// SHA-256 digests and the tagged hashing from which artefact keys are made.
#pragma once
#include <array>
#include <compare>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace kvx {

struct Digest {
  std::array<uint8_t, 32> bytes{};
  auto operator<=>(const Digest&) const = default;
  std::string Hex() const;                      // 64 lower-case digits
  static Digest FromHex(std::string_view hex);  // throws InputError
};

// Incremental SHA-256. Every part carries its length, so no two sequences of parts run together.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  Hasher& Raw(std::span<const std::byte> bytes);  // no length: for streaming one long part
  Hasher& Add(std::string_view part);
  Hasher& Add(const Digest& part);
  Hasher& Add(int64_t value);
  Hasher& Add(double value);
  Digest Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Digest Sha256(std::string_view bytes);
Digest Sha256(std::istream& bytes);  // to their end; the caller looks whether the stream went bad

}  // namespace kvx
