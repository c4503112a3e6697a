// Every answer that a client with this logger sees must be as the service's own document describes it.
#pragma once
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "api/embedded_schema.h"
#include "server/http_library.h"
#include "tests/support/api_contract.h"

namespace kvx::testing_support {

inline void CheckContract(const httplib::Request& request, const httplib::Response& response) {
  static const ApiContract contract(EmbeddedSchema("openapi.json"));
  const std::string path = request.path.substr(0, request.path.find('?'));
  std::vector<std::string> headers;
  for (const auto& [name, value] : response.headers) headers.push_back(name);
  EXPECT_EQ(contract.Violation({request.method, path, response.status,
                                response.get_header_value("Content-Type"), response.body, headers}),
            "");
}

}  // namespace kvx::testing_support
