// kinevox completion bash|zsh: a script for the shell, made from the program's own subcommands and options.
#include <CLI/CLI.hpp>

#include "cli/commands.h"

namespace kvx {
namespace {

struct Offers {
  std::string plain;    // subcommands, and values of arguments without a name
  std::string options;  // --names
  std::string values;   // lines of the script's `case`: what follows an option that takes something
};

void Append(std::string& words, const std::string& word) { words += (words.empty() ? "" : " ") + word; }

// "hand knee" of an option that takes one of a set: CLI11 shows the set as "TEXT:{hand,knee}".
std::string ChoicesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t begin = type.find('{'), end = type.find('}');
  if (begin == type.npos || end == type.npos) return "";
  std::string choices = type.substr(begin + 1, end - begin - 1);
  std::replace(choices.begin(), choices.end(), ',', ' ');
  return choices;
}

void OfferOption(const CLI::Option& option, const std::string& path, Offers& offers) {
  if (option.get_lnames().empty()) {
    const std::string choices = ChoicesOf(option);
    if (!choices.empty()) Append(offers.plain, choices);
  }
  for (const std::string& name : option.get_lnames()) {
    Append(offers.options, "--" + name);
    if (option.get_items_expected_max() > 0)
      offers.values += "    \"" + path + " --" + name + "\") words=\"" + ChoicesOf(option) + "\" ;;\n";
  }
}

std::vector<const CLI::App*> PartsOf(const CLI::App& command) {
  return command.get_subcommands([](const CLI::App* part) { return !part->get_group().empty(); });
}

// A part without a name is a group of options.
void OfferOptions(const CLI::App& command, const std::string& path, Offers& offers) {
  for (const CLI::Option* option : command.get_options()) OfferOption(*option, path, offers);
  for (const CLI::App* part : PartsOf(command)) {
    if (part->get_name().empty())
      OfferOptions(*part, path, offers);
    else
      Append(offers.plain, part->get_name());
  }
}

struct Script {
  std::string commands;  // "/keys|/keys/add|..."
  std::string values, words;
};

// A command's path is "/keys/add"; the program's is empty.
void AddCommand(const CLI::App& command, const std::string& path, Script& script) {
  Offers offers;
  OfferOptions(command, path, offers);
  if (!path.empty()) script.commands += (script.commands.empty() ? "" : "|") + path;
  script.values += offers.values;
  script.words +=
      "    \"" + path + "\") plain=\"" + offers.plain + "\" options=\"" + offers.options + "\" ;;\n";
  for (const CLI::App* part : PartsOf(command))
    if (!part->get_name().empty()) AddCommand(*part, path + "/" + part->get_name(), script);
}

// Bash's own form; zsh reads it through bashcompinit. Bash makes "=" a word of its own.
std::string TextOf(const CLI::App& program) {
  Script script;
  AddCommand(program, "", script);
  return "_kinevox() {\n"
         "  local word=\"${COMP_WORDS[COMP_CWORD]}\" before=\"${COMP_WORDS[COMP_CWORD-1]}\"\n"
         "  local path=\"\" plain=\"\" options=\"\" words=\"-\" i\n"
         "  COMPREPLY=()\n"
         "  if [ \"$before\" = \"=\" ]; then before=\"${COMP_WORDS[COMP_CWORD-2]}\"; fi\n"
         "  if [ \"$word\" = \"=\" ]; then word=\"\"; fi\n"
         "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
         "    case \"$path/${COMP_WORDS[i]}\" in\n"
         "    " +
         script.commands +
         ") path=\"$path/${COMP_WORDS[i]}\" ;;\n"
         "    esac\n"
         "  done\n"
         "  case \"$path $before\" in\n" +
         script.values +
         "  esac\n"
         "  case \"$path\" in\n" +
         script.words +
         "  esac\n"
         "  if [ \"$words\" = \"-\" ]; then\n"
         "    case \"$word\" in -*) words=\"$options\" ;; *) words=\"$plain\" ;; esac\n"
         "  fi\n"
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
         "}\n"
         "complete -o default -F _kinevox kinevox\n";
}

}  // namespace

void AddCompletion(CLI::App& program, CommandContext&) {
  CLI::App* command = program.add_subcommand("completion", "Print a completion script for the shell");
  auto shell = std::make_shared<std::string>();
  command->add_option("shell", *shell, "bash or zsh")->required()->check(CLI::IsMember({"bash", "zsh"}));
  command->footer("Examples:\n  source <(kinevox completion bash)\n  source <(kinevox completion zsh)");
  command->callback([shell, &program] {
    const std::string start =
        *shell == "zsh" ? "autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n"
                        : "";
    PrintDocument(start + TextOf(program));
  });
}

}  // namespace kvx
