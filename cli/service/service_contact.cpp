// Problem documents become our errors; a detail ends at its first semicolon where it is a reason to wait.
#include "cli/service/service_contact.h"

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "server/address.h"

namespace kvx {
namespace {

constexpr char kNoAnswer[] = "no kinevox service answers at this address; is 'kinevox serve' running there?";

constexpr char kNotOurs[] = "what answers at this address is not a kinevox service";

// What a problem document says; empty: it is none.
std::string DetailIn(const std::string& body) {
  const ServiceJson problem = ServiceJson::parse(body, nullptr, false);
  if (!problem.is_object() || !problem.contains("detail") || !problem["detail"].is_string()) return "";
  return problem["detail"].get<std::string>();
}

std::string StatusOnly(int status) { return "the service answered with status " + std::to_string(status); }

// Only who answers where: the rest of a location may name anything.
std::string MovedTo(const httplib::Response& response) {
  const std::string location = response.get_header_value("Location");
  if (!location.starts_with("http://") && !location.starts_with("https://")) return kNotOurs;
  try {
    return "the service is at " + SplitUrl(location).origin + "; give that with --server";
  } catch (const InputError&) {
    return kNotOurs;
  }
}

// "45 s", "90 min", "20 h"; never too early.
std::string InWords(uint64_t seconds) {
  if (seconds <= 120) return std::to_string(seconds) + " s";
  const uint64_t minutes = (seconds + 59) / 60;
  return minutes <= 120 ? std::to_string(minutes) + " min" : std::to_string((minutes + 59) / 60) + " h";
}

bool MayAnswerYet(httplib::Error error, bool answered_before) {
  if (error == httplib::Error::Connection) return answered_before;
  return error != httplib::Error::SSLServerVerification &&
         error != httplib::Error::SSLServerHostnameVerification && error != httplib::Error::SSLConnection &&
         error != httplib::Error::SSLLoadingCerts;
}

}  // namespace

std::string ReasonToWait(const httplib::Result& result) {
  if (!result) return "no kinevox service answers";
  const std::string detail = DetailIn(result->body);
  return detail.empty() ? StatusOnly(result->status) : detail.substr(0, detail.find(';'));
}

void ThrowNoAnswer(httplib::Error error) {
  switch (error) {
    case httplib::Error::SSLServerVerification:
    case httplib::Error::SSLServerHostnameVerification:
    case httplib::Error::SSLLoadingCerts:
      throw Unavailable(
          "the certificate of the service is not trusted, or is for another name; KINEVOX_CA names the PEM "
          "file of the authority that signed it");
    case httplib::Error::SSLConnection:
      throw Unavailable("no TLS is spoken at this address; is it an http:// address?");
    default:
      throw NoAnswer(kNoAnswer);
  }
}

void ThrowProblem(const httplib::Response& response) {
  const int status = response.status;
  if (status >= 300 && status < 400) throw Unavailable(MovedTo(response));
  const uint64_t retry_after = response.get_header_value_u64("Retry-After");
  const std::string told = DetailIn(response.body);
  std::string detail = told.empty() ? StatusOnly(status) : "the service says: " + told;
  if (status == 429 && retry_after > 0) detail += ": in " + InWords(retry_after);
  if (status == 401) detail += " (kinevox takes it from the variable KINEVOX_TOKEN)";
  if (status == 404) throw NotFound(detail);
  if (status == 413) throw TooLarge(detail);
  if (status == 401 || status == 403 || status == 429) throw Refused(detail);
  if (status == 409) throw Conflict(detail);
  if (status >= 400 && status < 500) throw InputError(detail);
  throw Unavailable(detail);
}

void ThrowGivenUp(const httplib::Result& result) {
  if (!result) ThrowNoAnswer(result.error());
  ThrowProblem(*result);
}

ServiceJson Checked(const httplib::Result& result) {
  if (!result && InterruptRequested()) throw Cancelled();
  if (!result || result->status >= 300) ThrowGivenUp(result);
  ServiceJson json = ServiceJson::parse(result->body, nullptr, false);
  if (json.is_discarded()) throw Unavailable(kNotOurs);
  return json;
}

std::optional<std::chrono::seconds> BusyFor(const httplib::Response& response) {
  constexpr uint64_t kLongest = 60;
  const int status = response.status;
  if (status != 429 && status != 502 && status != 503 && status != 504) return std::nullopt;
  const uint64_t wanted = response.get_header_value_u64("Retry-After");
  if (status == 429 && wanted > kLongest) return std::nullopt;
  return std::chrono::seconds(std::min(wanted, kLongest));
}

bool Contact::WorthAnotherTry(const httplib::Result& result) {
  answered_before |= bool(result);
  return result ? BusyFor(*result).has_value() : MayAnswerYet(result.error(), answered_before);
}

bool Contact::Wait(Patience& patience, const httplib::Result& result) const {
  const auto busy = result ? BusyFor(*result) : std::nullopt;
  const auto at_least = busy.value_or(std::chrono::seconds(0));
  if (on_wait && patience.Next(at_least) >= std::chrono::seconds(1)) on_wait(ReasonToWait(result));
  return patience.Pause(at_least);
}

}  // namespace kvx
