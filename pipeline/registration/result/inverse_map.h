// From a scan back to the template: where the tissue that a scan shows at a point lies in the template.
#pragma once
#include <optional>

#include "core/host/progress.h"
#include "pipeline/registration/result/bordered_field.h"

namespace kvx {

// The inverse of v-hat = v + u(v) over the body. Where tissue overlaps (a fold, or two fingers in one place),
// one of the points that come there. Refers to its arguments.
class InverseMap {
 public:
  InverseMap(const BorderedField& scan_from_template, const Mask& body, const Grid& scan);

  // Nothing where no tissue of the template comes to.
  std::optional<PointMm> operator()(const PointMm& in_scan) const;

 private:
  std::optional<PointMm> From(const PointMm& first, const PointMm& in_scan) const;
  bool InTissue(const PointMm& in_template) const;

  const BorderedField& scan_from_template_;
  const Mask& body_;
  Grid scan_;
  std::vector<uint32_t> tenants_;  // body voxel that comes to, or near, every voxel of the scan
};

// On the scan's grid: template point = x + u(x). Not a number where no tissue of the template comes to.
// Throws Cancelled through `progress`, which it asks and does not tell.
DisplacementField InverseField(const BorderedField& scan_from_template, const Mask& body, const Grid& scan,
                               const Progress& progress = {});

}  // namespace kvx
