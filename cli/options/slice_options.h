// The options that name a plane and its picture, shared by slice and animate.
#pragma once
#include <string>
#include <vector>

#include "core/grid.h"
#include "core/slice_request.h"

namespace CLI {
class App;
}

namespace kvx {

struct SliceOptions {
  SliceRequest numbers;  // those that stand for themselves
  std::string axis, projection = "none";
  std::vector<double> centre, right, down, window;

  SliceRequest Request() const;  // throws UsageError; whether it goes together is not looked at
};

void RequireFitting(const SliceRequest& view);  // throws UsageError for what does not go together

// Warns on stderr of a plane beside the posed body, whose picture is empty.
void WarnOfPlane(const SliceRequest& view, const Grid& posed_body);

// The sentence with the command line's names of what HTTP calls 'slab_mm'.
std::string WithOptionNames(std::string sentence);

void AddSliceOptions(CLI::App& command, SliceOptions& options);

}  // namespace kvx
