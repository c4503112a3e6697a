// The options that name a plane and its picture, shared by slice and animate.
#pragma once
#include <string>
#include <vector>

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

void AddSliceOptions(CLI::App& command, SliceOptions& options);

}  // namespace kvx
