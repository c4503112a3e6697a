// What a query says of a slice: its plane, size, slab and window.
#pragma once
#include <initializer_list>
#include <string_view>

#include "api/poser_port.h"
#include "api/request.h"

namespace kvx {

// The query parameters of a slice, those of its pose left out.
extern const std::initializer_list<std::string_view> kSliceParameters;

SliceView ViewOf(const Query& query);  // throws InputError

// A slice has no thickness: throws InputError where one is given and no projection.
void RequireProjectionOfSlab(const SliceView& view);

void AddView(Hasher& hasher, const SliceView& view);

}  // namespace kvx
