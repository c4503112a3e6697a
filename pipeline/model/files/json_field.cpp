// Checks of single JSON values.
#include "pipeline/model/files/json_field.h"

#include <algorithm>
#include <cmath>

#include "core/name.h"
#include "core/text/json_object.h"
#include "core/text/listed.h"

namespace kvx {
namespace {

const char kNameRule[] = "must be 1 to 64 letters, digits, dots, underscores or hyphens";

}  // namespace

JsonField JsonField::Child(const nlohmann::json& value, const std::string& key) const {
  return {value, name_.empty() ? key : name_ + "." + key};
}

bool JsonField::Has(const char* key) const {
  if (!value_.is_object()) Fail("must be an object");
  const auto found = value_.find(key);
  return found != value_.end() && !found->is_null();
}

JsonField JsonField::At(const char* key) const {
  static const nlohmann::json kNothing;
  const bool given = Has(key);
  const JsonField child = Child(given ? value_.at(key) : kNothing, key);
  if (!given) child.Fail("is missing");
  return child;
}

std::vector<JsonField> JsonField::Items() const {
  if (!value_.is_array()) Fail("must be a list");
  std::vector<JsonField> items;
  for (const auto& item : value_) items.emplace_back(item, name_ + "[" + std::to_string(items.size()) + "]");
  return items;
}

std::vector<std::pair<std::string, JsonField>> JsonField::Members() const {
  if (!value_.is_object()) Fail("must be an object");
  std::vector<std::pair<std::string, JsonField>> members;
  for (const auto& [key, value] : value_.items()) {
    if (!IsName(key)) Fail(std::string("has a key that is not a name: it ") + kNameRule);
    members.emplace_back(key, Child(value, key));
  }
  return members;
}

void JsonField::RequireOnly(std::initializer_list<std::string_view> known, const std::string& what) const {
  if (!value_.is_object()) throw InputError(what + " must be an object");
  for (const auto& item : value_.items()) {
    if (std::ranges::find(known, item.key()) == known.end())
      throw InputError("there is no field " + QuotedWord(item.key()) + " in " + what + "; there is " +
                       Listed(known));
  }
}

std::string JsonField::Text() const {
  if (!value_.is_string() || value_.get_ref<const std::string&>().empty())
    Fail("must be a text that is not empty");
  return value_.get<std::string>();
}

std::string JsonField::Name() const {
  if (!value_.is_string() || !IsName(value_.get_ref<const std::string&>())) Fail(kNameRule);
  return value_.get<std::string>();
}

std::string JsonField::Title() const {
  const std::string title = Text();
  if (!IsTitle(title)) Fail("must be one line of at most 256 bytes");
  return title;
}

double JsonField::Number() const {
  if (!value_.is_number() || !std::isfinite(value_.get<double>())) Fail("must be a number");
  return value_.get<double>();
}

RigidTransform JsonField::Rigid() const {
  const char kRule[] = "must be 16 numbers: a 4x4 row-major rigid motion, scan_from_template in LPS mm";
  if (!value_.is_array() || value_.size() != 16) Fail(kRule);
  std::array<double, 16> matrix;
  for (size_t i = 0; i < 16; ++i) {
    if (!value_[i].is_number()) Fail(kRule);
    matrix[i] = value_[i].get<double>();
  }
  try {
    return RigidFromRowMajor(matrix);
  } catch (const InputError&) {
    Fail(kRule);
  }
}

}  // namespace kvx
