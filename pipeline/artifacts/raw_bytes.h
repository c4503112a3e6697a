// Memory that nobody fills before it is written to.
#pragma once
#include <memory>
#include <string_view>

namespace kvx {

struct RawBytes {
  explicit RawBytes(size_t count) : data(std::make_unique_for_overwrite<char[]>(count)), size(count) {}
  std::string_view view() const { return {data.get(), size}; }
  std::unique_ptr<char[]> data;
  size_t size = 0;
};

}  // namespace kvx
