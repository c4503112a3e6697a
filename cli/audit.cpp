// kinevox audit: the trail of a data folder, checked or shown.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/request.h"
#include "cli/commands.h"
#include "cli/service/data_folder_records.h"
#include "core/text/hex_digest.h"
#include "storage/audit.h"

namespace kvx {
namespace {

struct AuditArguments {
  std::filesystem::path data;
  std::string head;
  int limit = 50;
};

void Verify(const AuditArguments& a, const CommandContext& context) {
  if (!a.head.empty() && !IsHexDigest(a.head))
    throw InputError("a head has 64 digits, as verify prints it; give --head all of them");
  Database db(DatabaseOf(a.data));
  const AuditCheck check = AuditTrail(db).Verify(a.head);
  const bool good = !check.broken_at && check.knows_head;
  if (context.json) {
    PrintDocument(Dump(Json{{"intact", good},
                            {"entries", check.entries},
                            {"head", check.head},
                            {"broken_at", check.broken_at ? Json(*check.broken_at) : Json()}}));
  }
  if (check.broken_at) {
    throw InputError("the audit trail was changed: entry " + std::to_string(*check.broken_at) +
                     " does not follow from the one before");
  }
  if (!check.knows_head)
    throw InputError("the audit trail does not hold the given head: entries were cut off");
  if (!context.json)
    std::printf("intact: %lld entries, head %s\n", static_cast<long long>(check.entries), check.head.c_str());
}

void List(const AuditArguments& a, const CommandContext& context) {
  Database db(DatabaseOf(a.data));
  Json items = Json::array();
  PageRequest request;
  request.limit = a.limit;
  const auto page = AuditTrail(db).List(request);
  for (const AuditRecord& r : page.items) {
    items.push_back({{"seq", r.seq},
                     {"at", IsoTime(r.at_ms)},
                     {"who", r.entry.who},
                     {"project", r.entry.project},
                     {"action", r.entry.action},
                     {"object", r.entry.object},
                     {"outcome", r.entry.outcome},
                     {"hash", r.hash}});
  }
  if (context.json) return PrintDocument(Dump(Json{{"items", items}}));
  for (const AuditRecord& r : page.items) {
    std::printf("%lld  %s  %s  %s  %s  %s  %s\n", static_cast<long long>(r.seq), IsoTime(r.at_ms).c_str(),
                r.entry.who.c_str(), r.entry.project.c_str(), r.entry.action.c_str(), r.entry.object.c_str(),
                r.entry.outcome.c_str());
  }
}

}  // namespace

void AddAudit(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("audit", "The service's audit trail: verify, list");
  command->require_subcommand(1);
  auto arguments = std::make_shared<AuditArguments>();
  CLI::App* verify =
      command->add_subcommand("verify", "Check the chain of hashes; exit code 3 when it was changed");
  verify
      ->add_option("--head", arguments->head,
                   "A head that was printed earlier, all 64 digits: is it still there?")
      ->type_name("HASH");
  CLI::App* list = command->add_subcommand("list", "The newest entries");
  list->add_option("--limit", arguments->limit, "How many, newest first")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str()
      ->type_name("N");
  for (CLI::App* one : {verify, list}) {
    AddData(*one, arguments->data);
    AddJson(*one, context);
  }
  verify->footer("Example:\n  kinevox audit verify --data /srv/kinevox --head 3f9c...   (all 64 digits)");
  list->footer("Example:\n  kinevox audit list --data /srv/kinevox --limit 200 --json");
  verify->callback([arguments, &context] { Verify(*arguments, context); });
  list->callback([arguments, &context] { List(*arguments, context); });
  command->footer(
      "Keep a head that 'verify' prints somewhere else: given back with --head, it shows that nothing was "
      "cut off.\n\n"
      "Examples:\n  kinevox audit verify --data /srv/kinevox\n  kinevox audit list --data /srv/kinevox "
      "--json");
}

}  // namespace kvx
