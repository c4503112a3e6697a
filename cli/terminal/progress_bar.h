// Progress for people: a bar on a terminal, one line per stage elsewhere; always on stderr, never on stdout.
#pragma once
#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>

#include "core/host/progress.h"

namespace kvx {

class ProgressBar {
 public:
  enum class Form { kNone, kLines, kBar };
  static Form FormFor(std::FILE* out, bool quiet);  // a bar on a terminal

  explicit ProgressBar(bool quiet, std::FILE* out = stderr);
  ProgressBar(Form form, std::FILE* out) : form_(form), out_(out) {}
  ~ProgressBar() { Finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Show(std::string_view stage, double fraction);  // fraction of the whole, 0..1
  void Finish();  // clears the bar, so that what follows starts on its own line
  // Shows on this bar; cancelled by Ctrl-C (cli/terminal/interrupt.h). Must not outlive the bar.
  Progress AsProgress();

 private:
  using Clock = std::chrono::steady_clock;
  void Draw(double fraction);

  Form form_;
  std::FILE* out_;
  std::string stage_;
  Clock::time_point last_drawn_{};
  bool drawn_ = false;
};

}  // namespace kvx
