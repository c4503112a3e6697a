// open() takes the lowest free number. Nothing can be read from what was opened for writing, or the reverse.
#include "cli/terminal/standard_streams.h"

#include <fcntl.h>
#include <unistd.h>

namespace kvx {

void HoldStandardStreams() {
  constexpr int kModes[] = {O_WRONLY, O_RDONLY, O_WRONLY};
  for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream)
    if (::fcntl(stream, F_GETFD) < 0) ::open("/dev/null", kModes[stream]);
}

}  // namespace kvx
