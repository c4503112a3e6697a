// Which methods the API's document has at an address, and what they take there.
#pragma once
#include <string>
#include <string_view>

namespace kvx {

// "DELETE, GET, HEAD", as an Allow header says it; empty where there is nothing at the path.
std::string MethodsAt(std::string_view path);

// Whether the document has no query parameter of this method there. False where it has no such method.
bool TakesNoParameters(std::string_view method, std::string_view path);

}  // namespace kvx
