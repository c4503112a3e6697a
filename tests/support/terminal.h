// A terminal of so many rows and columns, and what a program sends it.
#pragma once
#include <fcntl.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <string>

namespace kvx::testing_support {

struct TerminalSize {
  unsigned short rows, columns;
};

inline std::string SentTo(const TerminalSize& given, const std::function<void(std::FILE*)>& write) {
  const int screen = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (screen < 0 || ::grantpt(screen) != 0 || ::unlockpt(screen) != 0) return "no terminal can be made";
  const winsize size{given.rows, given.columns, 0, 0};
  ::ioctl(screen, TIOCSWINSZ, &size);
  std::FILE* const out = ::fopen(::ptsname(screen), "w");
  write(out);
  std::fclose(out);
  std::string sent, part(4096, '\0');
  // A busy machine hands it over in pieces; after the last one the terminal's other end is gone.
  for (ssize_t bytes; (bytes = ::read(screen, part.data(), part.size())) > 0;)
    sent.append(part, 0, size_t(bytes));
  ::close(screen);
  return sent;
}

}  // namespace kvx::testing_support
