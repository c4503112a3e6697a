// One page of a list, and where the next one starts.
#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
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

// Of what rows_of(count) gives: it is asked for a row more than the page holds, which says whether another
// one follows.
template <class RowsOf>
auto MakePage(const PageRequest& request, const RowsOf& rows_of) {
  auto rows = rows_of(request.limit + 1);
  Page<typename decltype(rows)::value_type> page;
  if (int(rows.size()) > request.limit) {
    rows.pop_back();
    page.next_before = rows.back().seq;
  }
  page.items = std::move(rows);
  return page;
}

}  // namespace kvx
