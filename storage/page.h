// One page of a list, and where the next one starts.
#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace kvx {

// Lists are newest first: a page holds what lies below `before`,
// so new items never shift a page that was handed out.
struct PageRequest {
  int64_t before = std::numeric_limits<int64_t>::max();
  int limit = 50;
};

template <class T>
struct Page {
  std::vector<T> items;
  std::optional<int64_t> next_before;  // absent on the last page
};

// `rows` was asked for with one row more than the page holds.
template <class T>
Page<T> MakePage(std::vector<T> rows, int limit) {
  Page<T> page;
  if (int(rows.size()) > limit) {
    rows.resize(size_t(limit));
    page.next_before = rows.back().seq;
  }
  page.items = std::move(rows);
  return page;
}

}  // namespace kvx
