// Failures as problem documents (RFC 9457): one table from the kind of error to status and type.
#pragma once
#include <exception>
#include <string>

#include "core/errors.h"

namespace kvx {

// What HTTP alone can get wrong.
class UnsupportedMedia : public InputError {
  using InputError::InputError;
};  // 415
class BodyTooLarge : public InputError {
  using InputError::InputError;
};  // 413
class LengthRequired : public InputError {
  using InputError::InputError;
};  // 411
class Unauthorised : public Error {
  using Error::Error;
};  // 401
class Forbidden : public Error {
  using Error::Error;
};  // 403
class LimitReached : public Error {
  using Error::Error;
};  // 429
class DiskNearlyFull : public Unavailable {
  using Unavailable::Unavailable;
};  // 507
class TusVersionNeeded : public InputError {
  using InputError::InputError;
};  // 412
class PreconditionFailed : public InputError {
  using InputError::InputError;
};  // 412
class ChecksumMismatch : public InputError {
  using InputError::InputError;
};  // 460, of tus

struct Problem {
  int status = 500;
  std::string type;  // last part of the URN: "not-found"
  std::string title;
  std::string detail;
};

Problem ToProblem(std::exception_ptr error);  // never repeats the text of what is not one of our kinds
Problem ProblemOfStatus(int status);          // for answers that the HTTP library makes by itself
std::string ProblemJson(const Problem& problem, const std::string& request_id);
// {"type", "detail"} as stored with a failed job.
std::string JobErrorJson(const Problem& problem);

}  // namespace kvx
