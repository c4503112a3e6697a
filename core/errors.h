// The kinds of failure that a caller can act on. Anything else that is thrown is our own bug.
// Messages are sentences for users; they hold our ids, never patient names, paths or DICOM text.
#pragma once
#include <stdexcept>
#include <string>
#include <system_error>

namespace kvx {

class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The request or file is wrong; HTTP 400, exit 3.
class InputError : public Error {
  using Error::Error;
};

// HTTP 404, exit 5.
class NotFound : public Error {
  using Error::Error;
};

// HTTP 409.
class Conflict : public Error {
  using Error::Error;
};

// May be retried; HTTP 503.
class Unavailable : public Error {
  using Error::Error;
};

// The system does not let whoever runs this program read or write something; exit 6.
class Denied : public Unavailable {
  using Unavailable::Unavailable;
};

// Of what a call to the system has told.
inline bool IsDenial(const std::error_code& told) {
  return told == std::errc::permission_denied || told == std::errc::operation_not_permitted ||
         told == std::errc::read_only_file_system;
}
inline bool IsDenial(int error_number) {
  return IsDenial(std::error_code(error_number, std::generic_category()));
}

// Somebody asked for the work to stop; exit 130.
class Cancelled : public Error {
 public:
  Cancelled() : Error("cancelled on request") {}
};

// Where several kinds are met alike.
template <class... Kinds>
bool IsOneOf(const Error& error) {
  return (dynamic_cast<const Kinds*>(&error) || ...);
}

}  // namespace kvx
