// The table.
#include "api/errors.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "storage/blob_store.h"
#include "storage/resumable_uploads.h"

namespace kvx {

Problem ToProblem(std::exception_ptr error) {
  try {
    std::rethrow_exception(error);
  } catch (const QuotaExceeded& e) {
    return {413, "too-large", "Too large", e.what()};
  } catch (const BodyTooLarge& e) {
    return {413, "too-large", "Too large", e.what()};
  } catch (const UnsupportedMedia& e) {
    return {415, "unsupported-media", "Unsupported media type", e.what()};
  } catch (const LengthRequired& e) {
    return {411, "length-required", "Length required", e.what()};
  } catch (const Unauthorised& e) {
    return {401, "unauthorised", "Who are you?", e.what()};
  } catch (const Forbidden& e) {
    return {403, "forbidden", "Forbidden", e.what()};
  } catch (const LimitReached& e) {
    return {429, "limit-reached", "Too much for now", e.what()};
  } catch (const TusVersionNeeded& e) {
    return {412, "tus-version", "Another version of tus", e.what()};
  } catch (const PreconditionFailed& e) {
    return {412, "precondition-failed", "Precondition failed", e.what()};
  } catch (const ChecksumMismatch& e) {
    return {460, "checksum-mismatch", "Checksum mismatch", e.what()};
  } catch (const InputError& e) {
    return {400, "invalid-request", "The request is wrong", e.what()};
  } catch (const Gone& e) {
    return {410, "gone", "Gone", e.what()};
  } catch (const NotFound& e) {
    return {404, "not-found", "Not found", e.what()};
  } catch (const Locked& e) {
    return {423, "locked", "Locked", e.what()};
  } catch (const Conflict& e) {
    return {409, "conflict", "In conflict with what is there", e.what()};
  } catch (const DiskNearlyFull& e) {
    return {507, "disk-nearly-full", "No room", e.what()};
  } catch (const Unavailable& e) {
    return {503, "unavailable", "Not available now", e.what()};
  } catch (const Cancelled& e) {
    return {409, "cancelled", "Cancelled", e.what()};
  } catch (const std::filesystem::filesystem_error&) {  // its own words name paths
    return {503, "unavailable", "Not available now",
            "a file of the data folder cannot be read or written; is the disk full?"};
  } catch (...) {
    return {500, "internal", "Internal error",
            "the service failed; the log has more under this request's id"};
  }
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
