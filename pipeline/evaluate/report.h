// The evaluation as tables and as JSON.
#pragma once
#include "pipeline/evaluate/evaluate.h"

namespace kvx {

std::string EvaluationText(const Evaluation& evaluation);  // the tables, for people
std::string EvaluationJson(const Evaluation& evaluation);

}  // namespace kvx
