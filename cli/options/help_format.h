// How --help looks: every line fits a terminal, in all subcommands alike.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace kvx {

// Breaks lines between words where they are longer than `width`. Lines that start with a blank (examples)
// stay.
std::string Wrapped(const std::string& text, size_t width);

// Texts of options and footers wrapped to kWidth columns.
class HelpFormat : public CLI::Formatter {
 public:
  static constexpr size_t kWidth = 100;

  std::string make_option_desc(const CLI::Option* option) const override;
  std::string make_footer(const CLI::App* app) const override;
};

}  // namespace kvx
