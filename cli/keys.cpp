// kinevox keys: API keys of a data folder, beside a running service or without one.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/request.h"
#include "cli/commands.h"
#include "cli/service/data_folder_records.h"
#include "storage/api_keys.h"
#include "storage/audit.h"

namespace kvx {
namespace {

constexpr int64_t kMostDays = 36500;  // a hundred years
constexpr int64_t kMostGibPerDay = int64_t(1) << 20;

struct KeysArguments {
  std::filesystem::path data;
  std::string name, project = kDefaultProject, scope = "write", id;
  double days = 0, gib_per_day = 0;
  int64_t requests_per_minute = 0;
};

Json ViewOf(const ApiKeyRecord& key) {
  const auto time = [](const std::optional<int64_t>& ms) { return ms ? Json(IsoTime(*ms)) : Json(); };
  const auto number = [](const std::optional<int64_t>& n) { return n ? Json(*n) : Json(); };
  return {{"id", key.id},
          {"name", key.name},
          {"project", key.project},
          {"scope", NameOf(key.scope)},
          {"requests_per_minute", number(key.quota.requests_per_minute)},
          {"bytes_per_day", number(key.quota.bytes_per_day)},
          {"created", IsoTime(key.created_ms)},
          {"expires", time(key.expires_ms)},
          {"revoked", time(key.revoked_ms)}};
}

void Note(Database& db, const ApiKeyRecord& key, const char* action) {
  AuditTrail(db).Append({"command line", key.project, action, key.id, "done"});
}

void Add(const KeysArguments& a, const CommandContext& context) {
  RequireName(a.name, "--name");
  RequireName(a.project, "--project");
  NewApiKey key{a.name, a.project, ParseScope(a.scope), {}, {}};
  if (a.requests_per_minute > 0) key.quota.requests_per_minute = a.requests_per_minute;
  if (a.gib_per_day > 0) key.quota.bytes_per_day = int64_t(a.gib_per_day * double(1 << 30));
  if (a.days > 0) key.lifetime_ms = int64_t(a.days * double(kDayMs));
  Database db(DatabaseOfMaybeNew(a.data));
  const ApiKeys::Made made = db.Write([&](SQLite::Database&) {
    ApiKeys::Made added = ApiKeys(db).Add(key);
    Note(db, added.record, "keys add");
    return added;
  });
  Json json = ViewOf(made.record);
  json["key"] = made.text;
  if (context.json) return PrintDocument(Dump(json));
  std::printf("%s\n", made.text.c_str());
  std::fprintf(stderr,
               "key %s of project %s; it is shown this once: clients send 'Authorization: Bearer ...'\n",
               made.record.id.c_str(), made.record.project.c_str());
}

void List(const KeysArguments& a, const CommandContext& context) {
  Database db(DatabaseOf(a.data));
  Json items = Json::array();
  for (const ApiKeyRecord& key : ApiKeys(db).List()) items.push_back(ViewOf(key));
  if (context.json) return PrintDocument(Dump(Json{{"items", items}}));
  for (const Json& key : items) {
    const bool revoked = !key["revoked"].is_null();
    const std::string until =
        key["expires"].is_null() ? "for ever" : "until " + key["expires"].get<std::string>();
    std::printf("%s  %-5s  %s  %s  %s\n", key["id"].get<std::string>().c_str(),
                key["scope"].get<std::string>().c_str(), key["project"].get<std::string>().c_str(),
                key["name"].get<std::string>().c_str(), revoked ? "revoked" : until.c_str());
  }
}

void Revoke(const KeysArguments& a, const CommandContext& context) {
  Database db(DatabaseOf(a.data));
  const ApiKeyRecord key = db.Write([&](SQLite::Database&) {
    const ApiKeyRecord revoked = ApiKeys(db).Revoke(a.id);
    Note(db, revoked, "keys revoke");
    return revoked;
  });
  if (context.json) return PrintDocument(Dump(ViewOf(key)));
  std::printf("%s is revoked\n", key.id.c_str());
}

// Of a new key.
void AddKeyOptions(CLI::App& add, KeysArguments& arguments) {
  add.add_option("--name", arguments.name, "What it is for, as in ci-runner")->required()->type_name("NAME");
  add.add_option("--project", arguments.project, "Whose records it sees")
      ->capture_default_str()
      ->type_name("NAME");
  add.add_option("--scope", arguments.scope,
                 "read; write: uploads and builds; admin: removal and the audit trail")
      ->check(CLI::IsMember({"read", "write", "admin"}))
      ->capture_default_str();
  add.add_option("--days", arguments.days, "Days until it expires (default: never)")
      ->check(AboveZero())
      ->check(AtMost(kMostDays));
  add.add_option("--requests-per-minute", arguments.requests_per_minute, "Its own limit")->check(AboveZero());
  add.add_option("--gib-per-day", arguments.gib_per_day, "Its own limit of uploads")
      ->check(AboveZero())
      ->check(AtMost(kMostGibPerDay));
}

}  // namespace

void AddKeys(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("keys", "API keys of the service: add, list, revoke");
  command->require_subcommand(1);
  auto arguments = std::make_shared<KeysArguments>();
  CLI::App* add = command->add_subcommand("add", "Make a key; it is shown this once");
  AddKeyOptions(*add, *arguments);
  CLI::App* list = command->add_subcommand("list", "All keys, without their secrets");
  CLI::App* revoke = command->add_subcommand("revoke", "Make a key useless, at once");
  revoke->add_option("id", arguments->id, "key_...")->required()->type_name("ID");
  for (CLI::App* one : {add, list, revoke}) {
    AddData(*one, arguments->data);
    AddJson(*one, context);
  }
  add->footer(
      "Example:\n  kinevox keys add --data /srv/kinevox --name ci --project lab --scope write --days 90");
  list->footer("Example:\n  kinevox keys list --data /srv/kinevox --json");
  revoke->footer("Example:\n  kinevox keys revoke key_5r1... --data /srv/kinevox");
  add->callback([arguments, &context] { Add(*arguments, context); });
  list->callback([arguments, &context] { List(*arguments, context); });
  revoke->callback([arguments, &context] { Revoke(*arguments, context); });
  command->footer(
      "Keys count when the service runs with auth.api_keys = true (kinevox serve --set "
      "auth.api_keys=true).\n\n"
      "Examples:\n  kinevox keys add --data /srv/kinevox --name ci --project lab --days 90\n"
      "  kinevox keys list --data /srv/kinevox\n  kinevox keys revoke key_5r1... --data /srv/kinevox");
}

}  // namespace kvx
