// NumPy's .npz: a zip of .npy arrays, for points and fields that Python tools read and write.
#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace kvx {

struct NpyArray {
  std::string dtype;          // NumPy's descr: "<f8", "<f4", "<i4", "<i2", "|u1", "|b1", "<U12", ...
  std::vector<size_t> shape;  // row-major: the last index varies fastest; empty for a scalar
  std::string bytes;          // little-endian

  size_t Count() const;  // product of the shape
};
using NpyArrays = std::map<std::string, NpyArray>;

// T: double, float, int64_t, int32_t, int16_t or uint8_t. The shape's product must be the number of values.
template <class T>
NpyArray MakeNpy(std::vector<size_t> shape, std::span<const T> values);
NpyArray MakeBoolNpy(std::vector<size_t> shape, std::span<const uint8_t> values);  // not 0: true
NpyArray MakeStringNpy(const std::vector<std::string>& values);                    // 1-D, ASCII

// Whatever the number type. Throws InputError for strings.
std::vector<double> AsDoubles(const NpyArray& array);
const NpyArray& ArrayNamed(const NpyArrays& arrays, const std::string& name);  // throws InputError naming it

void WriteNpz(const std::filesystem::path& path, const NpyArrays& arrays);  // deflated; throws Unavailable
NpyArrays ReadNpz(const std::filesystem::path& path);                       // throws InputError

}  // namespace kvx
