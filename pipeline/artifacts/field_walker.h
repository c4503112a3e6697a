// The fields of artefacts, one after the other: one Fields(walker, value) per type serves writing, reading
// and hashing.
//
// A type takes part by a free function found by argument-dependent lookup (or an overload in core_fields.h):
//   template <class A> void Fields(A& a, MyType& v) { a(v.first, v.second); }
// Built in: numbers, enums, strings, paths, vectors, arrays, maps, optionals, fixed-size Eigen matrices.
#pragma once
#include <Eigen/Dense>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace kvx {

// Values as they lie in memory: no padding, and every supported host is little-endian.
template <class T>
concept PlainBytes = std::is_arithmetic_v<T> || std::is_enum_v<T>;

// Whether many of them, side by side in memory, are the bytes that they are stored as.
template <class T>
inline constexpr bool kLiesAsStored = PlainBytes<T> && !std::is_same_v<T, bool>;
template <>
inline constexpr bool kLiesAsStored<Eigen::Vector3f> = sizeof(Eigen::Vector3f) == 3 * sizeof(float);

// Derived supplies Bytes(void*, size_t) and Length(size_t) -> size_t.
template <class Derived>
class FieldWalker {
 public:
  template <class... Ts>
  void operator()(Ts&... values) {
    (Value(values), ...);
  }
  // What artefacts of an earlier version end without: left as it is there.
  template <class... Ts>
  void AtTheEnd(Ts&... values) {
    if constexpr (Derived::kReads) {
      if (self().AtEnd()) return;
    }
    (Value(values), ...);
  }

 private:
  Derived& self() { return static_cast<Derived&>(*this); }

  template <PlainBytes T>
  void Value(T& v) {
    self().Bytes(&v, sizeof v);
  }
  void Value(std::string& v) {
    v.resize(self().Length(v.size()));
    self().Bytes(v.data(), v.size());
  }
  template <class S, int R, int C, int O, int MR, int MC>
  void Value(Eigen::Matrix<S, R, C, O, MR, MC>& m) {
    if constexpr (R == Eigen::Dynamic || C == Eigen::Dynamic) {
      const size_t rows = self().Length(size_t(m.rows())), cols = self().Length(size_t(m.cols()));
      m.resize(Eigen::Index(rows), Eigen::Index(cols));
    }
    self().Bytes(m.data(), size_t(m.size()) * sizeof(S));
  }
  void Value(Eigen::Quaterniond& q) { self().Bytes(q.coeffs().data(), 4 * sizeof(double)); }
  template <class T>
  void Value(std::vector<T>& v) {
    v.resize(self().Length(v.size()));
    if constexpr (kLiesAsStored<T>) {
      self().Bytes(v.data(), v.size() * sizeof(T));
    } else {
      for (T& item : v) Value(item);
    }
  }
  template <class T, size_t N>
  void Value(std::array<T, N>& v) {
    for (T& item : v) Value(item);
  }
  template <class K, class T>
  void Value(std::map<K, T>& v) {
    const size_t count = self().Length(v.size());
    if constexpr (Derived::kReads) {
      v.clear();
      for (size_t i = 0; i < count; ++i) {
        K key{};
        Value(key);
        Value(v[key]);
      }
    } else {
      for (auto& [key, item] : v) {
        K copy = key;
        Value(copy);
        Value(item);
      }
    }
  }
  template <class T>
  void Value(std::optional<T>& v) {
    bool has = v.has_value();
    Value(has);
    if (has && !v) v.emplace();
    if (has)
      Value(*v);
    else
      v.reset();
  }
  template <class T>
  requires std::is_class_v<T>
  void Value(T& v) { Fields(self(), v); }
};

}  // namespace kvx
