// The table.
#include "api/errors.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "storage/files/blob_store.h"
#include "storage/resumable_uploads.h"

namespace kvx {

namespace {

struct Row {
  bool (*is)(const std::exception&);
  int status;
  const char *type, *title;
};

template <class Kind>
constexpr Row Of(int status, const char* type, const char* title) {
  return {[](const std::exception& e) { return dynamic_cast<const Kind*>(&e) != nullptr; }, status, type,
          title};
}

// The first that fits counts: special kinds before those that they are of.
const Row kTable[] = {
    Of<QuotaExceeded>(413, "too-large", "Too large"),
    Of<BodyTooLarge>(413, "too-large", "Too large"),
    Of<UnsupportedMedia>(415, "unsupported-media", "Unsupported media type"),
    Of<LengthRequired>(411, "length-required", "Length required"),
    Of<Unauthorised>(401, "unauthorised", "Who are you?"),
    Of<Forbidden>(403, "forbidden", "Forbidden"),
    Of<LimitReached>(429, "limit-reached", "Too much for now"),
    Of<TusVersionNeeded>(412, "tus-version", "Another version of tus"),
    Of<PreconditionFailed>(412, "precondition-failed", "Precondition failed"),
    Of<ChecksumMismatch>(460, "checksum-mismatch", "Checksum mismatch"),
    Of<InputError>(400, "invalid-request", "The request is wrong"),
    Of<Gone>(410, "gone", "Gone"),
    Of<NotFound>(404, "not-found", "Not found"),
    Of<Locked>(423, "locked", "Locked"),
    Of<Conflict>(409, "conflict", "In conflict with what is there"),
    Of<DiskNearlyFull>(507, "disk-nearly-full", "No room"),
    Of<Unavailable>(503, "unavailable", "Not available now"),
    Of<Cancelled>(409, "cancelled", "Cancelled"),
};

}  // namespace

Problem ToProblem(std::exception_ptr error) {
  try {
    std::rethrow_exception(error);
  } catch (const std::filesystem::filesystem_error&) {  // its own words name paths
    return {503, "unavailable", "Not available now",
            "a file of the data folder cannot be read or written; is the disk full?"};
  } catch (const Error& e) {
    for (const Row& row : kTable)
      if (row.is(e)) return {row.status, row.type, row.title, e.what()};
  } catch (...) {
  }
  return {500, "internal", "Internal error", "the service failed; the log has more under this request's id"};
}

Problem ProblemOfStatus(int status) {
  switch (status) {
    case 404:
      return {404, "not-found", "Not found", "there is nothing at this address; /openapi.json lists what is"};
    case 413:
      return {413, "too-large", "Too large", "the request body is larger than the service accepts"};
    case 414:
      return {414, "uri-too-long", "Address too long", "send long poses as a POST body"};
    case 416:
      return {416, "range", "Range not satisfiable", "the range lies outside the content"};
    case 503:
      return {503, "unavailable", "Not available now", "the service is busy; try again shortly"};
    default:
      return {status, "http", "The request is wrong", "the request cannot be understood"};
  }
}

std::string ProblemJson(const Problem& problem, const std::string& request_id) {
  nlohmann::ordered_json json;
  json["type"] = "urn:kinevox:problem:" + problem.type;
  json["title"] = problem.title;
  json["status"] = problem.status;
  json["detail"] = problem.detail;
  json["instance"] = "urn:kinevox:request:" + request_id;
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string JobErrorJson(const Problem& problem) {
  nlohmann::ordered_json json;
  json["type"] = "urn:kinevox:problem:" + problem.type;
  json["detail"] = problem.detail;
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace kvx
