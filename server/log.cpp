// spdlog writes and locks; the fields are put together here so that a value can never break out of its line.
#include "server/log.h"

#include <cxxabi.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <typeinfo>
#include <utility>

#include "core/errors.h"

namespace kvx {
namespace {

spdlog::logger& Log() {
  static const auto logger = [] {
    auto made =
        std::make_shared<spdlog::logger>("kinevox", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    made->set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v})", spdlog::pattern_time_type::utc);
    return made;
  }();
  return *logger;
}

std::string KindOf(const std::exception& error) {
  const std::unique_ptr<char, decltype(&std::free)> name(
      abi::__cxa_demangle(typeid(error).name(), nullptr, nullptr, nullptr), std::free);
  return name ? name.get() : typeid(error).name();
}

std::string Line(const char* event, LogFields fields) {
  nlohmann::ordered_json json;
  json["event"] = event;
  for (const auto& [name, value] : fields) {
    std::visit([&, key = name](const auto& v) { json[key] = v; }, value);
  }
  const std::string text = json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  return text.substr(1, text.size() - 2);  // the pattern has the braces
}

// Telling ends nobody who tells: a thread that lacks memory lacks it here, too.
void Tell(spdlog::level::level_enum level, const char* event, LogFields fields) try {
  Log().log(level, "{}", Line(event, fields));
} catch (...) {
}

std::string Described(std::exception_ptr error) {
  try {
    std::rethrow_exception(error);
  } catch (const std::system_error& e) {
    return e.code().message();
  } catch (const Unavailable& e) {  // tells of machines, never of what somebody sent
    return KindOf(e) + ": " + e.what();
  } catch (const Error& e) {
    return KindOf(e);
  } catch (const std::exception& e) {
    return KindOf(e) + ": " + e.what();
  } catch (...) {
    return "something that is not an exception";
  }
}

}  // namespace

void SetLogLevel(const std::string& level) { Log().set_level(spdlog::level::from_str(level)); }
void LogInfo(const char* event, LogFields fields) { Tell(spdlog::level::info, event, fields); }
void LogError(const char* event, LogFields fields) { Tell(spdlog::level::err, event, fields); }

std::string DescribeForLog(std::exception_ptr error) try { return Described(std::move(error)); } catch (...) {
  return "no memory left";  // as short as strings are that need none
}

}  // namespace kvx
