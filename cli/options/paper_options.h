// The options of the paper's method, shared by build and submit.
#pragma once
#include <string>

#include "pipeline/registration/paper/paper_options.h"

namespace CLI {
class App;
}

namespace kvx {

void AddPaperOptions(CLI::App& command, PaperOptions& paper);  // --max-blocks, --max-seconds, --seed

// Refuses those options that are given with another method.
void RequirePaperMethod(const CLI::App& command, const std::string& method);

}  // namespace kvx
