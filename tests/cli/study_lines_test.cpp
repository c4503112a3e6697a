// What a terminal of so many rows is sent.
#include "cli/study_lines.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <string>

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::Not;

// Four studies, of which each changes its words once and its figure twice.
std::string SentTo(unsigned short rows) {
  const int screen = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (screen < 0 || ::grantpt(screen) != 0 || ::unlockpt(screen) != 0) return "no terminal can be made";
  const winsize size{rows, 80, 0, 0};
  ::ioctl(screen, TIOCSWINSZ, &size);
  std::FILE* const out = ::fopen(::ptsname(screen), "w");
  StudyLines lines(false, out);
  for (const char* study : {"a", "b", "c", "d"}) lines.Add(study);
  for (size_t i = 0; i < lines.size(); ++i) {
    lines.Show(i, "building", 0.25);
    lines.Show(i, "building", 0.5);
  }
  std::fclose(out);
  std::string sent, part(4096, '\0');
  // A busy machine hands it over in pieces; after the last one the terminal's other end is gone.
  for (ssize_t bytes; (bytes = ::read(screen, part.data(), part.size())) > 0;)
    sent.append(part, 0, size_t(bytes));
  ::close(screen);
  return sent;
}

TEST(StudyLines, AreRedrawnWhereAllFit) { EXPECT_THAT(SentTo(5), HasSubstr("\x1b[4A")); }

TEST(StudyLines, ArePrintedAsTheyChangeWhereTheyDoNot) {
  const std::string sent = SentTo(4);
  EXPECT_THAT(sent, Not(HasSubstr("\x1b[")));
  EXPECT_EQ(std::count(sent.begin(), sent.end(), '\n'), 4) << sent;
}

TEST(StudyLines, AreRedrawnOnATerminalOfUnknownSize) { EXPECT_THAT(SentTo(0), HasSubstr("\x1b[4A")); }

}  // namespace
}  // namespace kvx
