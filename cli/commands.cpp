// What the subcommands share: common options, output, warnings.
#include "cli/commands.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>

#include "core/text/parse_number.h"

namespace kvx {
namespace {

double NumberOr(const std::string& text, double otherwise) {
  double number = 0;
  return CLI::detail::lexical_cast(text, number) && std::isfinite(number) ? number : otherwise;
}

}  // namespace

void AddJson(CLI::App& command, CommandContext& context) {
  command.add_flag("--json", context.json, "Print one JSON document on stdout");
}

void AddDevice(CLI::App& command, CommandContext& context) {
  command
      .add_option(
          "--device", context.backend.device,
          "OpenCL device: part of its name, or its number (default: the first GPU, else the first device)")
      ->type_name("NAME");
  command.add_option("--threads", context.backend.threads, "Threads to compute with (default: all)")
      ->check(CLI::Range(1, 4096))
      ->type_name("N");
}

void AddQuiet(CLI::App& command, CommandContext& context) {
  command.add_flag("--quiet", context.quiet, "No progress on stderr");
}

void AddComputing(CLI::App& command, CommandContext& context) {
  AddDevice(command, context);
  AddQuiet(command, context);
  AddJson(command, context);
}

void AddOut(CLI::App& command, std::filesystem::path& out, const std::string& help, const std::string& type) {
  command.add_option("--out", out, help)->required()->type_name(type);
}

void AddModelFolder(CLI::App& command, std::filesystem::path& model) {
  command.add_option("model", model, "A model made by 'kinevox build'")->required()->type_name("MODEL");
}

void AddServer(CLI::App& command, std::string& url) {
  url = "http://127.0.0.1:8080";
  command.add_option("--server", url, "Address of the service")->capture_default_str()->type_name("URL");
}

void AddData(CLI::App& command, std::filesystem::path& data) {
  data = "kinevox-data";
  command.add_option("--data", data, "The service's data folder")->capture_default_str()->type_name("DIR");
}

void AddLevel(CLI::App& command, int& level) {
  command.add_option("--level", level, "Resolution: 0 full, 1 half, 2 a quarter, ...")
      ->check(CLI::Range(0, 5))
      ->capture_default_str()
      ->type_name("L");
}

void AddMode(CLI::App& command, std::string& mode) {
  command
      .add_option("--mode", mode,
                  "evd: learnt from the examples; vbd: bones alone; elastic: evd, and between the "
                  "examples as elastic tissue comes to rest (a pose takes a little longer)")
      ->check(CLI::IsMember({"evd", "vbd", "elastic"}))
      ->capture_default_str();
}

CLI::Validator AboveZero() {
  return {[](std::string& text) { return NumberOr(text, -1) > 0 ? "" : "must be a number above 0"; }, "", ""};
}

CLI::Validator ZeroOrAbove() {
  return {[](std::string& text) { return NumberOr(text, -1) >= 0 ? "" : "must be 0 or a number above"; }, "",
          ""};
}

CLI::Validator AtMost(int64_t most) {
  return {[most](std::string& text) {
            return NumberOr(text, 0) <= double(most) ? "" : "must be at most " + std::to_string(most);
          },
          "", ""};
}

CLI::Validator WholeUpTo(uint64_t most) {
  return {[most](std::string& text) {
            const auto number = ParseAs<uint64_t>(text);
            if (!number || *number > most) return "must be a whole number from 0 to " + std::to_string(most);
            text = std::to_string(*number);
            return std::string();
          },
          "", ""};
}

void PrintDocument(std::string_view json) {
  std::fwrite(json.data(), 1, json.size(), stdout);
  if (!json.ends_with('\n')) std::fputc('\n', stdout);
  RequirePrinted();
}

void RequirePrinted() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout))
    throw Unavailable("the result cannot be written to stdout");
}

void Warn(std::string_view sentence) {
  std::fprintf(stderr, "kinevox: warning: %.*s\n", int(sentence.size()), sentence.data());
}

std::string SentenceOf(const std::filesystem::filesystem_error& error) {
  if (IsDenial(error.code())) return "a file or folder may not be read or written by who runs this program";
  return "a file or folder cannot be read or written (" + error.code().message() +
         "); is the folder writable and the disk not full?";
}

}  // namespace kvx
