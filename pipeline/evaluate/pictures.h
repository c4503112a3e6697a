// Pictures of a model beside its scans, for people to judge (as the paper's figures 7 to 9).
#pragma once
#include <filesystem>

#include "pipeline/model/model.h"

namespace kvx {

// One PNG per scan, `folder/NAME.png`: a row for each of the grid's three planes through the joints; columns:
// template, scan, posed by bones alone (VBD), posed as registered, and both laid over the scan (scan green,
// posed magenta, equal is grey).
void WritePictures(const Model& model, const PosingEngine& engine, const std::filesystem::path& folder,
                   const Progress& progress);

}  // namespace kvx
