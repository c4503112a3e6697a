// Which methods the API's document has at an address.
#pragma once
#include <string>
#include <string_view>

namespace kvx {

// "DELETE, GET, HEAD", as an Allow header says it; empty where there is nothing at the path.
std::string MethodsAt(std::string_view path);

}  // namespace kvx
