// The bar is redrawn at most ten times a second.
#include "cli/terminal/progress_bar.h"

#include <unistd.h>

#include "cli/terminal/interrupt.h"
#include "cli/terminal/terminal_line.h"

namespace kvx {
namespace {

constexpr int kBarWidth = 28;
constexpr std::chrono::milliseconds kRedraw{100};

}  // namespace

ProgressBar::Form ProgressBar::FormFor(std::FILE* out, bool quiet) {
  if (quiet) return Form::kNone;
  return isatty(fileno(out)) ? Form::kBar : Form::kLines;
}

ProgressBar::ProgressBar(bool quiet, std::FILE* out) : ProgressBar(FormFor(out, quiet), out) {}

void ProgressBar::Show(std::string_view stage, double fraction) {
  if (form_ == Form::kNone) return;
  const bool new_stage = stage != stage_;
  stage_ = stage;
  if (form_ == Form::kLines) {
    if (new_stage) std::fprintf(out_, "%3.0f %% %s\n", 100 * fraction, stage_.c_str());
    return;
  }
  const auto now = Clock::now();
  if (!new_stage && now - last_drawn_ < kRedraw) return;
  last_drawn_ = now;
  Draw(fraction);
}

void ProgressBar::Draw(double fraction) {
  const int full = int(kBarWidth * std::min(1.0, std::max(0.0, fraction)));
  const std::string bar = std::string(size_t(full), '#') + std::string(size_t(kBarWidth - full), '.');
  char share[16];
  std::snprintf(share, sizeof share, " %3.0f %% ", 100 * fraction);
  const std::string row = CutTo(ColumnsOf(out_), "[" + bar + "]" + share + stage_);
  std::fprintf(out_, "\r%s\x1b[K", row.c_str());
  std::fflush(out_);
  drawn_ = true;
}

void ProgressBar::Finish() {
  if (!drawn_) return;
  std::fprintf(out_, "\r\x1b[K");
  std::fflush(out_);
  drawn_ = false;
}

Progress ProgressBar::AsProgress() {
  return Progress([this](std::string_view stage, double fraction) { Show(stage, fraction); },
                  InterruptRequested);
}

}  // namespace kvx
