// Fields as bytes: counted, written, read and hashed.
#pragma once
#include "core/digest.h"
#include "core/errors.h"
#include "core/host/parallel.h"
#include "pipeline/artifacts/field_walker.h"
#include "pipeline/artifacts/raw_bytes.h"

namespace kvx {

class ByteCounter : public FieldWalker<ByteCounter> {
 public:
  static constexpr bool kReads = false;
  size_t count = 0;
  void Bytes(void*, size_t more) { count += more; }
  size_t Length(size_t n) {
    count += sizeof(uint64_t);
    return n;
  }
};

// Into memory of just the right size: what ByteCounter counted.
class ByteWriter : public FieldWalker<ByteWriter> {
 public:
  static constexpr bool kReads = false;
  explicit ByteWriter(size_t count) : written_(count) {}
  void Bytes(void* data, size_t count) {
    ParallelCopy(written_.data.get() + at_, data, count);
    at_ += count;
  }
  size_t Length(size_t n) {
    uint64_t stored = n;
    Bytes(&stored, sizeof stored);
    return n;
  }
  RawBytes Written() && { return std::move(written_); }

 private:
  RawBytes written_;
  size_t at_ = 0;
};

template <class T>
RawBytes BytesOf(T& value) {
  ByteCounter counter;
  counter(value);
  ByteWriter writer(counter.count);
  writer(value);
  return std::move(writer).Written();
}

// Throws Unavailable when the bytes end early: a damaged artefact, which the cache then recomputes.
class ByteReader : public FieldWalker<ByteReader> {
 public:
  static constexpr bool kReads = true;
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}
  void Bytes(void* data, size_t count) {
    if (count > rest_.size()) throw Unavailable("a stored artefact is damaged");
    ParallelCopy(data, rest_.data(), count);
    rest_.remove_prefix(count);
  }
  bool AtEnd() const { return rest_.empty(); }
  size_t Length(size_t) {
    uint64_t stored = 0;
    Bytes(&stored, sizeof stored);
    if (stored > rest_.size() * 8 + 64) throw Unavailable("a stored artefact is damaged");
    return size_t(stored);
  }

 private:
  std::string_view rest_;
};

class FieldHasher : public FieldWalker<FieldHasher> {
 public:
  static constexpr bool kReads = false;
  explicit FieldHasher(Hasher& hasher) : hasher_(hasher) {}
  void Bytes(void* data, size_t count) { hasher_.Raw({static_cast<const std::byte*>(data), count}); }
  size_t Length(size_t n) {
    hasher_.Add(int64_t(n));
    return n;
  }

 private:
  Hasher& hasher_;
};

}  // namespace kvx
