// `kinevox info --json` and GET /v1/models/{m}: everything known about a model (contract).
#pragma once
#include <string>

#include "pipeline/model/model.h"

namespace kvx {

std::string InfoJson(const Model& model);  // one JSON document

}  // namespace kvx
