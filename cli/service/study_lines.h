// One line per study on stderr: redrawn in place on a terminal that has room for all of them, elsewhere
// printed when something changes.
#pragma once
#include <cstdio>
#include <string>
#include <vector>

namespace kvx {

class StudyLines {
 public:
  StudyLines(bool quiet, std::FILE* out = stderr);
  void Add(const std::string& study);
  void Show(size_t index, const std::string& what, double fraction);  // of the study, 0..1
  size_t size() const { return lines_.size(); }
  // As far as it was.
  void Show(size_t index, const std::string& what) { Show(index, what, lines_.at(index).fraction); }

 private:
  struct Line {
    std::string study, what;
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
