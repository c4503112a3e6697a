// Which program this is. The newest page of docs/changes gives the second number: tests/deployment_test.py.
#pragma once

namespace kvx {

const char* ProgramVersion();  // "0.102.0"

}  // namespace kvx
