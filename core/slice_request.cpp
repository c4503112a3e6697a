// Names as in the API and on the command line.
#include "core/slice_request.h"

#include "core/errors.h"

namespace kvx {

std::string NameOf(SliceAxis axis) {
  return axis == SliceAxis::kAxial ? "axial" : axis == SliceAxis::kCoronal ? "coronal" : "sagittal";
}

SliceAxis SliceAxisFromName(const std::string& name) {
  for (const SliceAxis axis : {SliceAxis::kAxial, SliceAxis::kCoronal, SliceAxis::kSagittal}) {
    if (name == NameOf(axis)) return axis;
  }
  throw InputError("'axis' is axial, coronal or sagittal");
}

std::string NameOf(Projection projection) {
  return projection == Projection::kNone ? "none" : projection == Projection::kMaximum ? "max" : "mean";
}

Projection ProjectionFromName(const std::string& name) {
  for (const Projection projection : {Projection::kNone, Projection::kMaximum, Projection::kMean}) {
    if (name == NameOf(projection)) return projection;
  }
  throw InputError("'projection' is none, max or mean");
}

SliceRequest SliceRequest::OfVideo() const {
  SliceRequest view = *this;
  if (!NamesPlane()) view.axis = SliceAxis::kCoronal, view.projection = Projection::kMaximum;
  return view;
}

void SliceRequest::Validate() const {
  if (oblique && (axis || at_mm)) throw InputError("give 'axis' and 'mm', or an oblique plane, not both");
  if (slab_mm && projection == Projection::kNone)
    throw InputError("'slab_mm' is how thick a projection is; give a 'projection', max or mean, too");
}

std::optional<SliceRequest::Oblique> ObliqueOf(const std::vector<double>& centre,
                                               const std::vector<double>& right,
                                               const std::vector<double>& down) {
  if (centre.empty() && right.empty() && down.empty()) return {};
  if (centre.size() != 3 || right.size() != 3 || down.size() != 3)
    throw InputError("an oblique plane needs 'centre', 'right' and 'down', three numbers each");
  return SliceRequest::Oblique{
      {Eigen::Vector3d(centre.data())}, Eigen::Vector3d(right.data()), Eigen::Vector3d(down.data())};
}

std::optional<std::pair<double, double>> WindowOf(const std::vector<double>& black_and_white) {
  if (black_and_white.empty()) return {};
  if (black_and_white.size() != 2 || !(black_and_white[1] > black_and_white[0]))
    throw InputError("'window' is two intensities, shown black and white, the lower first");
  return std::pair{black_and_white[0], black_and_white[1]};
}

}  // namespace kvx
