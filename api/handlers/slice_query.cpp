// A plane is named by axis and place, or spanned by two directions.
#include "api/handlers/slice_query.h"

#include "api/handlers/pose_query.h"
#include "core/errors.h"

namespace kvx {
namespace {

std::vector<double> Numbers(const Query& query, const std::string& name, size_t count) {
  std::vector<double> numbers;
  std::string_view rest;
  const std::string text = QueryValue(query, name);
  for (rest = text; !rest.empty();) {
    const size_t end = std::min(rest.find(','), rest.size());
    numbers.push_back(ParseNumber(rest.substr(0, end), "'" + name + "'"));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  if (!numbers.empty() && numbers.size() != count)
    throw InputError("'" + name + "' is " + std::to_string(count) + " numbers with commas between them");
  return numbers;
}

}  // namespace

const std::initializer_list<std::string_view> kSliceParameters = {
    "axis",   "mm",       "centre",    "right",    "down",   "projection", "slab_mm",
    "window", "width_mm", "height_mm", "pixel_mm", "format", "mode",       "level"};

SliceView ViewOf(const Query& query) {
  SliceView view;
  view.at_mm = QueryNumber(query, "mm"), view.slab_mm = QueryNumber(query, "slab_mm");
  view.width_mm = QueryNumber(query, "width_mm"), view.height_mm = QueryNumber(query, "height_mm");
  view.pixel_mm = QueryNumber(query, "pixel_mm");
  view.axis = QueryValue(query, "axis"), view.projection = QueryValue(query, "projection", "none");
  const auto centre = Numbers(query, "centre", 3), right = Numbers(query, "right", 3),
             down = Numbers(query, "down", 3);
  if (!centre.empty() || !right.empty() || !down.empty()) {
    if (centre.empty() || right.empty() || down.empty())
      throw InputError("an oblique plane needs 'centre', 'right' and 'down'");
    if (query.contains("axis") || view.at_mm)
      throw InputError("give 'axis' and 'mm', or an oblique plane, not both");
    view.oblique = {Eigen::Vector3d(centre.data()), Eigen::Vector3d(right.data()),
                    Eigen::Vector3d(down.data())};
  }
  const auto window = Numbers(query, "window", 2);
  if (!window.empty()) {
    if (!(window[1] > window[0]))
      throw InputError("'window' is the intensities shown black and white, the lower first");
    view.window = {window[0], window[1]};
  }
  return view;
}

void RequireProjectionOfSlab(const SliceView& view) {
  if (view.slab_mm && view.projection == "none")
    throw InputError("'slab_mm' is how thick a projection is; give projection=max or mean too");
}

void AddView(Hasher& hasher, const SliceView& view) {
  const auto add = [&](const std::optional<double>& value) {
    hasher.Add(int64_t(value.has_value())).Add(value.value_or(0));
  };
  hasher.Add(view.Axis()).Add(view.projection);
  for (const auto& value : {view.at_mm, view.width_mm, view.height_mm, view.pixel_mm, view.slab_mm})
    add(value);
  hasher.Add(int64_t(view.oblique.has_value()));
  for (int v = 0; view.oblique && v < 3; ++v) {
    for (const double number : (*view.oblique)[size_t(v)]) hasher.Add(number);
  }
  add(view.window ? std::optional(view.window->first) : std::nullopt);
  add(view.window ? std::optional(view.window->second) : std::nullopt);
}

}  // namespace kvx
