// A plane is named by axis and place, or spanned by two directions.
#include "api/handlers/slice_query.h"

#include "api/handlers/pose_query.h"

namespace kvx {
namespace {

std::vector<double> Numbers(const Query& query, const std::string& name) {
  std::vector<double> numbers;
  std::string_view rest;
  const std::string text = QueryValue(query, name);
  for (rest = text; !rest.empty();) {
    const size_t end = std::min(rest.find(','), rest.size());
    numbers.push_back(ParseNumber(rest.substr(0, end), "'" + name + "'"));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return numbers;
}

}  // namespace

const std::initializer_list<std::string_view> kSliceParameters = {
    "axis",   "mm",       "centre",    "right",    "down",   "projection", "slab_mm",
    "window", "width_mm", "height_mm", "pixel_mm", "format", "mode",       "level"};

SliceRequest ViewOf(const Query& query) {
  SliceRequest view;
  view.at_mm = QueryNumber(query, "mm"), view.slab_mm = QueryNumber(query, "slab_mm");
  view.width_mm = QueryNumber(query, "width_mm"), view.height_mm = QueryNumber(query, "height_mm");
  view.pixel_mm = QueryNumber(query, "pixel_mm");
  view.level = QueryLevel(query);
  if (const auto axis = QueryText(query, "axis")) view.axis = SliceAxisFromName(*axis);
  view.projection = ProjectionFromName(QueryValue(query, "projection", "none"));
  view.oblique = ObliqueOf(Numbers(query, "centre"), Numbers(query, "right"), Numbers(query, "down"));
  view.window = WindowOf(Numbers(query, "window"));
  return view;
}

void AddView(Hasher& hasher, const SliceRequest& view) {
  const auto add = [&](const std::optional<double>& value) {
    hasher.Add(int64_t(value.has_value())).Add(value.value_or(0));
  };
  hasher.Add(NameOf(view.Axis())).Add(NameOf(view.projection));
  for (const auto& value : {view.at_mm, view.width_mm, view.height_mm, view.pixel_mm, view.slab_mm})
    add(value);
  hasher.Add(int64_t(view.oblique.has_value()));
  if (view.oblique) {
    for (const Eigen::Vector3d& vector : view.oblique->Vectors()) {
      for (const double number : vector) hasher.Add(number);
    }
  }
  add(view.window ? std::optional(view.window->first) : std::nullopt);
  add(view.window ? std::optional(view.window->second) : std::nullopt);
}

}  // namespace kvx
