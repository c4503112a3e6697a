// The service's log: one line of JSON per event on stderr;
// our ids, routes and figures, never names, paths or header text.
#pragma once
#include <exception>
#include <initializer_list>
#include <string>
#include <utility>
#include <variant>

namespace kvx {

using LogValue = std::variant<std::string, int64_t, double>;
using LogFields = std::initializer_list<std::pair<const char*, LogValue>>;

void SetLogLevel(const std::string& level);  // "info", "warn", "error", "off"
// Neither throws; what cannot be told is lost.
void LogInfo(const char* event, LogFields fields);
void LogError(const char* event, LogFields fields);
// What may be logged of a failure: its kind, and its text where that cannot name a scan, a file or a person.
// Not the text of file system errors (paths), nor of what is told to clients (names of scans). Does not
// throw.
std::string DescribeForLog(std::exception_ptr error);

}  // namespace kvx
