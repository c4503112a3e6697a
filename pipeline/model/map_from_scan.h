// What the registration of one scan says, seen from the scan; and how sure it is.
#pragma once
#include "pipeline/model/model.h"

namespace kvx {

// Template points of what a scan shows. Not a number where no tissue of the template comes to.
std::vector<PointMm> MapPointsFromScan(const Model& model, const std::string& scan,
                                       const std::vector<PointMm>& in_scan);
// On the template's grid: scan point = x + u(x); says something in the body only.
DisplacementField ScanFromTemplate(const Model& model, const std::string& scan);
// On the scan's grid: template point = x + u(x), as above.
DisplacementField TemplateFromScan(const Model& model, const std::string& scan,
                                   const Progress& progress = {});
// Per cent, on the template's grid. Throws NotFound when the model's method states none.
Volume ConfidenceOf(const Model& model, const std::string& scan);
// In mm, as above: see PlaceErrorMm (registration/result/confidence.h). Not a number where it is not known.
Volume PlaceErrorOf(const Model& model, const std::string& scan);

}  // namespace kvx
