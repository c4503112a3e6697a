// A place in a JSON document that knows its own name, so that every complaint says which field is meant.
#pragma once
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/errors.h"
#include "core/rigid_transform.h"

namespace kvx {

class JsonField {
 public:
  JsonField(const nlohmann::json& value, std::string name) : value_(value), name_(std::move(name)) {}

  const nlohmann::json& value() const { return value_; }
  const std::string& name() const { return name_; }
  [[noreturn]] void Fail(const std::string& what) const { throw InputError(name_ + " " + what); }

  bool Has(const char* key) const;       // present and not null; this must be an object
  JsonField At(const char* key) const;   // throws "<name> is missing"
  std::vector<JsonField> Items() const;  // of an array; "scans[0]", "scans[1]", ...
  std::vector<std::pair<std::string, JsonField>> Members() const;  // of an object; keys must be names

  // This, called `what`, must be an object without other keys; throws InputError naming the first other.
  void RequireOnly(std::initializer_list<std::string_view> known, const std::string& what) const;

  std::string Text() const;      // a string that is not empty
  std::string Name() const;      // core/name.h
  std::string Title() const;     // for people: one line of any script, at most 256 bytes of UTF-8
  double Number() const;         // finite
  RigidTransform Rigid() const;  // 16 numbers, 4x4 row-major

 private:
  JsonField Child(const nlohmann::json& value, const std::string& key) const;

  const nlohmann::json& value_;
  std::string name_;
};

}  // namespace kvx
