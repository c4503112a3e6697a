// A header that says nothing of axes or an origin has ITK's usual: the world's axes, an origin of 0.
#include "pipeline/io/text_geometry.h"

#include <algorithm>
#include <set>
#include <sstream>

#include "core/errors.h"
#include "core/text/lower_case.h"
#include "core/text/parse_number.h"

namespace kvx {
namespace {

using Words = std::vector<std::string>;

const char kBadSpacing[] =
    "the volume's header gives a voxel spacing that is not a positive number; correct the header";
const char kBadAxes[] =
    "the volume's header gives axes or an origin that are not finite numbers; correct the header, or convert "
    "the original images again";
const char kUnspaced[] =
    "the volume's header does not say how large its voxels are; add a voxel spacing in mm (NRRD: space "
    "directions or spacings, MetaImage: ElementSpacing), or convert the original images again";
const char kUncounted[] =
    "the volume's header does not give one voxel spacing (in mm) for each axis; correct the header";

Words Split(const std::string& text) {
  std::istringstream in(text);
  Words words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

// What stands in brackets is one word.
Words Vectors(const std::string& text) {
  Words vectors;
  for (size_t at = text.find_first_not_of(" \t"); at != text.npos; at = text.find_first_not_of(" \t", at)) {
    size_t end = text[at] == '(' ? text.find(')', at) : text.find_first_of(" \t", at) - 1;
    end = std::min(end, text.size() - 1);
    vectors.push_back(text.substr(at, end + 1 - at));
    at = end + 1;
  }
  return vectors;
}

Words Components(std::string vector) {
  std::ranges::replace_if(
      vector, [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  return Split(vector);
}

bool AllFinite(const Words& words) {
  return std::ranges::all_of(words, [](const std::string& word) { return ParseFinite(word).has_value(); });
}

void RequirePositive(const std::string& word) {
  const auto spacing = ParseFinite(word);
  if (!spacing || !(*spacing > 0)) throw InputError(kBadSpacing);
}

// Of the axes that are the image's, the first three: beyond are frames.
std::vector<size_t> ImageAxes(const TextHeader& nrrd, size_t dimension) {
  static const std::set<std::string> kOfTheImage{"domain", "space", "time", "???", "none"};
  const Words kinds = Split(LowerCase(nrrd.Value("kinds")));
  std::vector<size_t> axes;
  for (size_t axis = 0; axis < dimension && axes.size() < 3; ++axis)
    if (axis >= kinds.size() || kOfTheImage.contains(kinds[axis])) axes.push_back(axis);
  return axes;
}

void RequireKnownSpace(const TextHeader& nrrd, size_t dimension) {
  static const std::set<std::string> kKnown{
      "rightanteriorsuperior", "ras", "leftanteriorsuperior", "las",
      "leftposteriorsuperior", "lps", "scannerxyz",           "3drighthanded"};
  static const std::set<std::string> kShortWithTime{"rast", "last", "lpst", "scannerxyzt"};
  const std::string space = SpaceOf(nrrd);
  const bool time = kShortWithTime.contains(space) || space.ends_with("time");
  if (time && dimension < 4) {
    throw InputError(
        "the volume's header gives a space with time (such as LPST) but no axis of time; save one frame in "
        "the space left-posterior-superior (LPS)");
  }
  if (space.starts_with("3dlefthanded")) {
    throw InputError(
        "the volume's header gives a left-handed space, which does not say how the patient lies in it; save "
        "it in the space left-posterior-superior (LPS)");
  }
  if (space.empty() || time || kKnown.contains(space)) return;
  throw InputError(
      "the volume's header gives a space that is not known here; save it in the space "
      "left-posterior-superior (LPS)");
}

void RequireSpacings(const TextHeader& nrrd, size_t dimension) {
  const Words spacings = Split(nrrd.Value("spacings"));
  if (spacings.empty()) {
    if (nrrd.FirstOf({"space directions", "spacedirections"}).empty()) throw InputError(kUnspaced);
    return;
  }
  if (spacings.size() != dimension) throw InputError(kUncounted);
  for (const size_t axis : ImageAxes(nrrd, dimension)) RequirePositive(spacings[axis]);
}

void RequireDirections(const TextHeader& nrrd, size_t dimension) {
  const Words vectors = Vectors(nrrd.FirstOf({"space directions", "spacedirections"}));
  if (vectors.empty()) {
    if (nrrd.Value("space").empty() || nrrd.Value("spacings").empty()) return;
    throw InputError(
        "the volume's header gives spacings beside a space, which NRRD does not allow; give space directions "
        "instead");
  }
  if (vectors.size() != dimension) throw InputError(kUncounted);
  for (const size_t axis : ImageAxes(nrrd, dimension)) {
    const Words components = Components(vectors[axis]);
    if (vectors[axis].front() != '(' || !AllFinite(components)) throw InputError(kBadAxes);
    if (std::ranges::all_of(components, [](const std::string& c) { return *ParseFinite(c) == 0; }))
      throw InputError(kBadSpacing);
  }
}

void RequireNrrdGeometry(const TextHeader& nrrd) {
  const size_t dimension = Split(nrrd.Value("sizes")).size();
  RequireKnownSpace(nrrd, dimension);
  RequireSpacings(nrrd, dimension);
  RequireDirections(nrrd, dimension);
  if (!AllFinite(Components(nrrd.FirstOf({"space origin", "spaceorigin"})))) throw InputError(kBadAxes);
}

void RequireMetaGeometry(const TextHeader& meta) {
  const size_t dimension = Split(meta.Value("dimsize")).size();
  if (meta.FirstOf({"elementspacing", "elementsize"}).empty()) throw InputError(kUnspaced);
  for (const char* key : {"elementspacing", "elementsize"}) {
    const Words spacings = Split(meta.Value(key));
    if (spacings.empty()) continue;
    if (spacings.size() < dimension) throw InputError(kUncounted);
    for (size_t axis = 0; axis < std::min<size_t>(3, dimension); ++axis) RequirePositive(spacings[axis]);
  }
  for (const char* key : {"transformmatrix", "rotation", "orientation", "offset", "position", "origin"})
    if (!AllFinite(Split(meta.Value(key)))) throw InputError(kBadAxes);
}

}  // namespace

void RequireGeometry(const TextHeader& header) {
  header.format == FileFormat::kNrrd ? RequireNrrdGeometry(header) : RequireMetaGeometry(header);
}

}  // namespace kvx
