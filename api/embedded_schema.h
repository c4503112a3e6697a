// The API's document and its schemas, embedded at build time from api/schema.
#pragma once
#include <string_view>

namespace kvx {

std::string_view EmbeddedSchema(std::string_view file_name);

}  // namespace kvx
