// What a terminal of so many rows and columns is sent.
#include "cli/service/study_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>

#include "cli/terminal/progress_bar.h"
#include "cli/terminal/terminal_line.h"
#include "tests/support/terminal.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing_support::SentTo;

// Four studies, of which each changes its words once and its figure twice.
std::string StudiesOn(unsigned short rows, unsigned short columns = 80,
                      const std::string& what = "building") {
  return SentTo({rows, columns}, [&](std::FILE* out) {
    StudyLines lines(false, out);
    for (const char* study : {"a", "b", "c", "d"}) lines.Add(study);
    for (size_t i = 0; i < lines.size(); ++i) {
      lines.Show(i, what, 0.25);
      lines.Show(i, what, 0.5);
    }
  });
}

// Columns of the widest row, without what steers the terminal.
size_t Widest(std::string sent) {
  for (const char* steering : {"\x1b[K", "\x1b[4A", "\r"}) {
    for (size_t at; (at = sent.find(steering)) != sent.npos;)
      sent.replace(at, std::string(steering).size(), "\n");
  }
  size_t widest = 0;
  std::istringstream rows(sent);
  for (std::string row; std::getline(rows, row);) widest = std::max(widest, row.size());
  return widest;
}

TEST(StudyLines, AreRedrawnWhereAllFit) { EXPECT_THAT(StudiesOn(5), HasSubstr("\x1b[4A")); }

TEST(StudyLines, ArePrintedAsTheyChangeWhereTheyDoNot) {
  const std::string sent = StudiesOn(4);
  EXPECT_THAT(sent, Not(HasSubstr("\x1b[")));
  EXPECT_EQ(std::count(sent.begin(), sent.end(), '\n'), 4) << sent;
}

TEST(StudyLines, AreRedrawnOnATerminalOfUnknownSize) { EXPECT_THAT(StudiesOn(0, 0), HasSubstr("\x1b[4A")); }

// A row that is wrapped is two: the cursor would go up too few.
TEST(StudyLines, AreCutToTheTerminalsWidth) {
  const std::string reason(200, 'x');
  EXPECT_EQ(Widest(StudiesOn(24, 80, reason)), 79u);
  EXPECT_EQ(Widest(StudiesOn(24, 20, reason)), 19u);
  EXPECT_GT(Widest(StudiesOn(24, 0, reason)), 200u) << "it does not say how wide it is";
}

// A row that is printed among them would be drawn over, and shift them.
TEST(StudyLines, LeaveWhatIsPrintedAboveThem) {
  const std::string sent = SentTo({24, 80}, [](std::FILE* out) {
    StudyLines lines(false, out);
    for (const char* study : {"a", "b"}) lines.Add(study);
    lines.Show(0, "reading", 0);
    lines.Above([out] { std::fprintf(out, "look here\n"); });
    lines.Show(1, "reading", 0);
  });
  EXPECT_THAT(sent, HasSubstr("\x1b[2A\r\x1b[Jlook here\r\n\r\x1b[Ka "));
  EXPECT_THAT(sent.substr(sent.find("look here")), HasSubstr("\x1b[2A\r\x1b[Ka "));
}

// Minutes of a build would be hundreds of rows of a log.
TEST(StudyLines, ArePrintedOnceWhileOnlyTheTimeLeftChanges) {
  const auto sent = [](unsigned short rows) {
    return SentTo({rows, 80}, [](std::FILE* out) {
      StudyLines lines(false, out);
      for (const char* study : {"a", "b"}) lines.Add(study);
      for (const char* left : {", 9 s left", ", 8 s left", ", 7 s left"})
        lines.Show(0, "register", 0.5, left);
    });
  };
  EXPECT_EQ(sent(2), "a   50 %  register, 9 s left\r\n");
  EXPECT_THAT(sent(24), HasSubstr("7 s left")) << "drawn again where it can be";
}

TEST(StudyLines, KeepLongTitlesWhole) {
  const std::string north = "institute/north/patient-0001/right",
                    south = "institute/south/patient-0001/right";
  const std::string sent = SentTo({24, 80}, [&](std::FILE* out) {
    StudyLines lines(false, out);
    for (const std::string& study : {north, south}) lines.Add(study);
    lines.Show(0, "reading", 0);
  });
  EXPECT_THAT(sent, HasSubstr(north + "   0 %  reading"));
  EXPECT_THAT(sent, HasSubstr(south + "   0 %  waiting"));
}

TEST(ProgressBar, IsCutToTheTerminalsWidth) {
  const std::string sent = SentTo({24, 80}, [](std::FILE* out) {
    ProgressBar(ProgressBar::Form::kBar, out).Show("waiting: " + std::string(200, 'x'), 0.5);
  });
  EXPECT_EQ(Widest(sent), 79u);
}

TEST(TerminalLine, IsCutBetweenLetters) {
  EXPECT_EQ(CutTo(3, "knee"), "kne");
  EXPECT_EQ(CutTo(2, "kn\xc3\xa9"), "kn");
  EXPECT_EQ(CutTo(3, "kn\xc3\xa9"), "kn\xc3\xa9");
  EXPECT_EQ(CutTo(3, "\xe8\x86\x9d\xe9\x96\xa2"), "\xe8\x86\x9d") << "two columns each";
  EXPECT_EQ(CutTo(2, "\xe9\xe9\xe9"), "\xe9\xe9") << "no UTF-8";
  EXPECT_EQ(FilledTo(4, "\xc3\xa9"), "\xc3\xa9   ");
}

}  // namespace
}  // namespace kvx
