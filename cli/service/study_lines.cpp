// The cursor goes up by as many lines as were drawn, and each is cleared before it is drawn again. It cannot
// go up to lines that have left the terminal.
#include "cli/service/study_lines.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include "cli/terminal/terminal_line.h"

namespace kvx {
namespace {

constexpr size_t kTitleColumns = 28;

}  // namespace

StudyLines::StudyLines(bool quiet, std::FILE* out)
    : quiet_(quiet), terminal_(isatty(fileno(out))), out_(out) {}

void StudyLines::Add(const std::string& study) { lines_.push_back({study, "waiting", "", 0}); }

void StudyLines::Show(size_t index, const std::string& what, double fraction, const std::string& left) {
  Line& line = lines_.at(index);
  const bool changed = what != line.what || !line.drawn;
  if (!changed && left == line.left && int(1000 * fraction) == int(1000 * line.fraction)) return;
  line.what = what, line.left = left;
  line.fraction = fraction;
  line.drawn = true;
  if (quiet_) return;
  if (terminal_ && AllFit()) return Redraw();
  drawn_lines_ = 0;
  if (changed)
    std::fprintf(out_, "%s  %3.0f %%  %s%s\n", line.study.c_str(), 100 * fraction, what.c_str(),
                 left.c_str());
}

void StudyLines::Above(const std::function<void()>& print) {
  const bool drawn = drawn_lines_ > 0;
  if (drawn) std::fprintf(out_, "\x1b[%zuA\r\x1b[J", drawn_lines_);
  std::fflush(out_);
  drawn_lines_ = 0;
  print();
  if (drawn) Redraw();
}

// Below the last line the cursor has one of its own. A terminal that does not say how large it is has room.
bool StudyLines::AllFit() const {
  winsize size{};
  return ::ioctl(fileno(out_), TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || lines_.size() < size.ws_row;
}

void StudyLines::Redraw() {
  if (drawn_lines_ > 0) std::fprintf(out_, "\x1b[%zuA", drawn_lines_);
  const size_t columns = ColumnsOf(out_);
  size_t title = kTitleColumns;
  for (const Line& line : lines_) title = std::max(title, std::min(columns / 2, WidthOf(line.study)));
  for (const Line& line : lines_) {
    char share[16];
    std::snprintf(share, sizeof share, " %3.0f %%  ", 100 * line.fraction);
    const std::string row = CutTo(columns, FilledTo(title, line.study) + share + line.what + line.left);
    std::fprintf(out_, "\r\x1b[K%s\n", row.c_str());
  }
  drawn_lines_ = lines_.size();
  std::fflush(out_);
}

}  // namespace kvx
