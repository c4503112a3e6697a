// The zip by libarchive, the .npy inside by hand (format version 1.0; 2.0 and 3.0 are read too).
#include "pipeline/io/npz_file.h"

#include <archive.h>
#include <archive_entry.h>

#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <memory>

#include "core/errors.h"
#include "pipeline/io/zip_file.h"

namespace kvx {
namespace {

static_assert(std::endian::native == std::endian::little, "array bytes are written as they lie in memory");

const char kUnreadable[] =
    "the .npz file is damaged or holds arrays of a kind that is not supported (numbers, booleans and text "
    "are)";
const std::string kMagic("\x93NUMPY", 6);
constexpr size_t kMostBytes = size_t(1) << 34;  // of one array; more is a damaged or hostile header

template <class T>
constexpr const char* kDtype = nullptr;
template <>
constexpr const char* kDtype<double> = "<f8";
template <>
constexpr const char* kDtype<float> = "<f4";
template <>
constexpr const char* kDtype<int64_t> = "<i8";
template <>
constexpr const char* kDtype<int32_t> = "<i4";
template <>
constexpr const char* kDtype<int16_t> = "<i2";
template <>
constexpr const char* kDtype<uint8_t> = "|u1";

size_t ItemBytes(const std::string& dtype) {
  size_t width = 0;
  if (dtype.size() < 3 || (dtype[0] != '<' && dtype[0] != '|')) throw InputError(kUnreadable);
  const auto [end, error] = std::from_chars(dtype.data() + 2, dtype.data() + dtype.size(), width);
  if (error != std::errc() || end != dtype.data() + dtype.size() || width > 65536)
    throw InputError(kUnreadable);
  return dtype[1] == 'U' ? 4 * width : width;
}

std::string ShapeText(const std::vector<size_t>& shape) {
  std::string text = "(";
  for (const size_t n : shape) text += std::to_string(n) + ", ";
  if (shape.size() > 1) text.resize(text.size() - 2);
  return text + ")";
}

std::string NpyBytes(const NpyArray& array) {
  std::string header =
      "{'descr': '" + array.dtype + "', 'fortran_order': False, 'shape': " + ShapeText(array.shape) + ", }";
  header.append(63 - (kMagic.size() + 4 + header.size()) % 64, ' ');  // the data begin at a multiple of 64
  header += '\n';
  std::string bytes = kMagic + std::string("\x01\x00", 2);
  bytes += char(header.size() & 255);
  bytes += char(header.size() >> 8);
  return bytes + header + array.bytes;
}

// The text after "'key':" in the header's dictionary, up to `end`.
std::string_view ValueOf(std::string_view header, std::string_view key, char end) {
  const size_t at = header.find(key);
  if (at == std::string_view::npos) throw InputError(kUnreadable);
  const size_t begin = header.find_first_not_of(": ", at + key.size());
  const size_t stop = header.find(end, begin == std::string_view::npos ? at : begin + 1);
  if (begin == std::string_view::npos || stop == std::string_view::npos) throw InputError(kUnreadable);
  return header.substr(begin, stop - begin);
}

std::vector<size_t> ParseShape(std::string_view text) {
  std::vector<size_t> shape;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (at < end) {
    if (*at < '0' || *at > '9') {
      ++at;
      continue;
    }
    size_t n = 0;
    const auto parsed = std::from_chars(at, end, n);
    if (parsed.ec != std::errc()) throw InputError(kUnreadable);
    shape.push_back(n);
    at = parsed.ptr;
  }
  return shape;
}

NpyArray ParseNpy(const std::string& bytes) {
  if (bytes.size() < 12 || bytes.compare(0, kMagic.size(), kMagic) != 0) throw InputError(kUnreadable);
  const auto byte = [&](size_t i) { return size_t(uint8_t(bytes[i])); };
  const bool longer = byte(6) >= 2;
  const size_t length = byte(8) | byte(9) << 8 | (longer ? byte(10) << 16 | byte(11) << 24 : 0);
  const size_t begin = longer ? 12 : 10;
  if (begin + length > bytes.size()) throw InputError(kUnreadable);
  const std::string_view header(bytes.data() + begin, length);
  NpyArray array;
  array.dtype = ValueOf(header, "'descr'", ',');
  if (array.dtype.size() < 5 || array.dtype.front() != '\'') throw InputError(kUnreadable);
  array.dtype = array.dtype.substr(1, array.dtype.size() - 2);
  array.shape = ParseShape(ValueOf(header, "'shape'", ')'));
  if (array.shape.size() > 1 && ValueOf(header, "'fortran_order'", ',') != "False")
    throw InputError(kUnreadable);
  array.bytes = bytes.substr(begin + length);
  if (double(array.Count()) * double(ItemBytes(array.dtype)) != double(array.bytes.size()))
    throw InputError(kUnreadable);
  return array;
}

struct ReaderFree {
  void operator()(archive* a) const { archive_read_free(a); }
};

std::string MemberBytes(archive* zip) {
  std::string bytes;
  char chunk[1 << 16];
  while (true) {
    const la_ssize_t got = archive_read_data(zip, chunk, sizeof chunk);
    if (got < 0 || bytes.size() > kMostBytes) throw InputError(kUnreadable);
    if (got == 0) return bytes;
    bytes.append(chunk, size_t(got));
  }
}

template <class T>
std::vector<double> Widened(const std::string& bytes) {
  std::vector<double> values(bytes.size() / sizeof(T));
  for (size_t v = 0; v < values.size(); ++v) {
    T value;
    std::memcpy(&value, bytes.data() + v * sizeof(T), sizeof(T));
    values[v] = double(value);
  }
  return values;
}

}  // namespace

size_t NpyArray::Count() const {
  size_t count = 1;
  for (const size_t n : shape) {
    if (n != 0 && count > kMostBytes / n) throw InputError(kUnreadable);
    count *= n;
  }
  return count;
}

template <class T>
NpyArray MakeNpy(std::vector<size_t> shape, std::span<const T> values) {
  NpyArray array{kDtype<T>, std::move(shape),
                 std::string(reinterpret_cast<const char*>(values.data()), values.size_bytes())};
  if (array.Count() != values.size()) throw std::logic_error("an array's shape does not fit its values");
  return array;
}
template NpyArray MakeNpy(std::vector<size_t>, std::span<const double>);
template NpyArray MakeNpy(std::vector<size_t>, std::span<const float>);
template NpyArray MakeNpy(std::vector<size_t>, std::span<const int64_t>);
template NpyArray MakeNpy(std::vector<size_t>, std::span<const int32_t>);
template NpyArray MakeNpy(std::vector<size_t>, std::span<const int16_t>);
template NpyArray MakeNpy(std::vector<size_t>, std::span<const uint8_t>);

NpyArray MakeBoolNpy(std::vector<size_t> shape, std::span<const uint8_t> values) {
  NpyArray array = MakeNpy<uint8_t>(std::move(shape), values);
  for (char& value : array.bytes) value = value != 0;
  array.dtype = "|b1";
  return array;
}

NpyArray MakeStringNpy(const std::vector<std::string>& values) {
  size_t width = 1;
  for (const std::string& value : values) width = std::max(width, value.size());
  NpyArray array{"<U" + std::to_string(width), {values.size()}, std::string(values.size() * width * 4, '\0')};
  for (size_t v = 0; v < values.size(); ++v) {
    for (size_t c = 0; c < values[v].size(); ++c) array.bytes[(v * width + c) * 4] = values[v][c];  // UTF-32
  }
  return array;
}

std::vector<double> AsDoubles(const NpyArray& array) {
  const std::string kind = array.dtype.substr(1);
  if (kind == "f8") return Widened<double>(array.bytes);
  if (kind == "f4") return Widened<float>(array.bytes);
  if (kind == "i8") return Widened<int64_t>(array.bytes);
  if (kind == "i4") return Widened<int32_t>(array.bytes);
  if (kind == "i2") return Widened<int16_t>(array.bytes);
  if (kind == "i1") return Widened<int8_t>(array.bytes);
  if (kind == "u8") return Widened<uint64_t>(array.bytes);
  if (kind == "u4") return Widened<uint32_t>(array.bytes);
  if (kind == "u2") return Widened<uint16_t>(array.bytes);
  if (kind == "u1" || kind == "b1") return Widened<uint8_t>(array.bytes);
  throw InputError("an array of the .npz file does not hold numbers");
}

const NpyArray& ArrayNamed(const NpyArrays& arrays, const std::string& name) {
  const auto found = arrays.find(name);
  if (found == arrays.end()) throw InputError("the .npz file has no array called '" + name + "'");
  return found->second;
}

void WriteNpz(const std::filesystem::path& path, const NpyArrays& arrays) {
  ZipFile zip(path);
  for (const auto& [name, array] : arrays) zip.Add(name + ".npy", NpyBytes(array));
  zip.Commit();
}

NpyArrays ReadNpz(const std::filesystem::path& path) {
  const std::unique_ptr<archive, ReaderFree> zip(archive_read_new());
  archive_read_support_format_zip(zip.get());
  if (archive_read_open_filename(zip.get(), path.c_str(), 1 << 16) != ARCHIVE_OK) {
    throw InputError("the .npz file cannot be opened; check that it exists and may be read");
  }
  NpyArrays arrays;
  archive_entry* entry = nullptr;
  int status = 0;
  while ((status = archive_read_next_header(zip.get(), &entry)) == ARCHIVE_OK) {
    const std::filesystem::path name = archive_entry_pathname(entry);
    if (name.extension() == ".npy") arrays[name.stem().string()] = ParseNpy(MemberBytes(zip.get()));
  }
  if (status != ARCHIVE_EOF) throw InputError(kUnreadable);
  return arrays;
}

}  // namespace kvx
