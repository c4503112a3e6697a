// One line per study on stderr: redrawn in place on a terminal that has room for all of them, elsewhere
// printed when something changes.
#pragma once
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

namespace kvx {

class StudyLines {
 public:
  StudyLines(bool quiet, std::FILE* out = stderr);
  void Add(const std::string& study);
  // Of the study; `fraction` 0..1. `left`, how long it will take, is told with the rest, and is no change by
  // itself.
  void Show(size_t index, const std::string& what, double fraction, const std::string& left = {});
  // What `print` writes stays above the lines.
  void Above(const std::function<void()>& print);
  size_t size() const { return lines_.size(); }
  // As far as it was.
  void Show(size_t index, const std::string& what) { Show(index, what, lines_.at(index).fraction); }

 private:
  struct Line {
    std::string study, what, left;
    double fraction = 0;
    bool drawn = false;
  };
  bool AllFit() const;
  void Redraw();
  std::vector<Line> lines_;
  bool quiet_, terminal_;
  std::FILE* out_;
  size_t drawn_lines_ = 0;
};

}  // namespace kvx
