// Statements from storage/sql with their arguments bound; for the sources of this room alone.
#pragma once
#include <SQLiteCpp/SQLiteCpp.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kvx {

std::string_view EmbeddedSql(std::string_view file_name);  // generated at build

namespace sqlite {

// What the first line includes ("-- include line_of_jobs.sql") is pasted there.
inline std::string Sql(std::string_view name) {
  constexpr std::string_view kInclude = "-- include ", kEnding = ".sql";
  const std::string_view sql = EmbeddedSql(std::string(name) + std::string(kEnding));
  if (sql.empty()) throw std::logic_error("an SQL statement is missing from the program");
  if (!sql.starts_with(kInclude)) return std::string(sql);
  const size_t end = sql.find('\n'), length = end - kInclude.size() - kEnding.size();
  return Sql(sql.substr(kInclude.size(), length)) + std::string(sql.substr(end + 1));
}

inline void BindOne(SQLite::Statement& s, int i, int64_t v) { s.bind(i, v); }
inline void BindOne(SQLite::Statement& s, int i, int v) { s.bind(i, v); }
inline void BindOne(SQLite::Statement& s, int i, double v) { s.bind(i, v); }
inline void BindOne(SQLite::Statement& s, int i, const std::string& v) { s.bind(i, v); }
inline void BindOne(SQLite::Statement& s, int i, const char* v) { s.bind(i, v); }
inline void BindOne(SQLite::Statement& s, int i, const std::optional<int64_t>& v) {
  if (v)
    s.bind(i, *v);
  else
    s.bind(i);
}
inline void BindOne(SQLite::Statement& s, int i, const std::optional<std::string>& v) {
  if (v)
    s.bind(i, *v);
  else
    s.bind(i);
}

// The statement storage/sql/<name>.sql with ?1, ?2, ... bound in order.
template <class... Args>
SQLite::Statement Prepare(SQLite::Database& db, std::string_view name, const Args&... args) {
  SQLite::Statement statement(db, Sql(name));
  int index = 0;
  (BindOne(statement, ++index, args), ...);
  return statement;
}

template <class... Args>
int Execute(SQLite::Database& db, std::string_view name, const Args&... args) {
  return Prepare(db, name, args...).exec();  // rows changed
}

template <class Map, class... Args>
auto One(SQLite::Database& db, std::string_view name, const Map& map, const Args&... args)
    -> std::optional<decltype(map(std::declval<SQLite::Statement&>()))> {
  SQLite::Statement statement = Prepare(db, name, args...);
  if (!statement.executeStep()) return std::nullopt;
  auto row = map(statement);
  while (statement.executeStep()) {
  }
  return row;
}

template <class Map, class... Args>
auto All(SQLite::Database& db, std::string_view name, const Map& map, const Args&... args) {
  std::vector<decltype(map(std::declval<SQLite::Statement&>()))> rows;
  SQLite::Statement statement = Prepare(db, name, args...);
  while (statement.executeStep()) rows.push_back(map(statement));
  return rows;
}

inline std::string Text(SQLite::Statement& row, int column) { return row.getColumn(column).getString(); }
inline std::optional<std::string> OptionalText(SQLite::Statement& row, int column) {
  if (row.isColumnNull(column)) return std::nullopt;
  return Text(row, column);
}
inline int64_t Integer(SQLite::Statement& row, int column) { return row.getColumn(column).getInt64(); }
inline std::optional<int64_t> OptionalInteger(SQLite::Statement& row, int column) {
  if (row.isColumnNull(column)) return std::nullopt;
  return Integer(row, column);
}

}  // namespace sqlite
}  // namespace kvx
