// What a query says of a slice: its plane, size, slab and window.
#pragma once
#include <initializer_list>
#include <string_view>

#include "api/poser_port.h"
#include "api/request.h"

namespace kvx {

// The query parameters of a slice, those of its pose left out.
extern const std::initializer_list<std::string_view> kSliceParameters;

SliceRequest ViewOf(const Query& query);  // throws InputError; whether it goes together is not looked at

// All but the level, which a posed thing's digest holds.
void AddView(Hasher& hasher, const SliceRequest& view);

}  // namespace kvx
