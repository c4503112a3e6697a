// kinevox completion bash|zsh: a script for the shell, made from the program's own subcommands and options.
#include <CLI/CLI.hpp>

#include "cli/commands.h"

namespace kvx {
namespace {

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::vector<std::string> OptionsOf(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
  }
  return words;
}

std::vector<const CLI::App*> Shown(const CLI::App& program) {
  return program.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

// Bash's own form; zsh reads it through bashcompinit.
std::string Script(const CLI::App& program) {
  std::vector<std::string> names;
  std::string cases;
  for (const CLI::App* command : Shown(program)) {
    names.push_back(command->get_name());
    cases += "    " + command->get_name() + ") words=\"" + Joined(OptionsOf(*command)) + "\" ;;\n";
  }
  return "_kinevox() {\n"
         "  local word=\"${COMP_WORDS[COMP_CWORD]}\" words=\"\"\n"
         "  COMPREPLY=()\n"
         "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
         "    words=\"" +
         Joined(names) + " " + Joined(OptionsOf(program)) +
         "\"\n"
         "  else case \"${COMP_WORDS[1]}\" in\n" +
         cases +
         "    esac\n"
         "  fi\n"
         "  case \"$word\" in\n"
         "    -*) COMPREPLY=($(compgen -W \"$words\" -- \"$word\")) ;;\n"
         "    *) [ \"$COMP_CWORD\" -eq 1 ] && COMPREPLY=($(compgen -W \"$words\" -- \"$word\")) ;;\n"
         "  esac\n"
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
    PrintDocument(start + Script(program));
  });
}

}  // namespace kvx
