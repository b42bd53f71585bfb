#include "apps/commands/commands.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include "apps/commands/convert.h"
#include "data/core/error.h"
#include "data/io/yaml.h"
#include "data/source/sequence.h"

namespace slcmap::inline commands {
namespace {

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  return names;
}

std::vector<std::string> OptionNames(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::string DescribeUnknownCommand(const CLI::App& app, const std::string& found) {
  const std::vector<std::string> names = CommandNames(app);
  return fmt::format("found command '{}', expected one of {}{}", found, fmt::join(names, ", "),
                     DidYouMean(found, names));
}

// The text behind the last of some words, as CLI11's messages end with what they are about.
std::string After(const std::string& text, const std::string& words) {
  const std::size_t at = text.rfind(words);
  return at == std::string::npos ? "" : text.substr(at + words.size());
}

// CLI11 lists all that it did not expect, the values of a mistyped option before its name.
std::string DescribeExtras(const CLI::App& command, const std::string& text) {
  const std::string all = After(text, "expected: ");
  const std::size_t dash = (" " + all).find(" -");
  const std::string from = all.substr(dash == std::string::npos ? 0 : dash);
  const std::string found = from.substr(0, from.find(' '));
  const std::string known = found.starts_with("-") ? "an option of its usage" : "no more arguments";
  return fmt::format("{}: found '{}', expected {}{}", command.get_name(), found, known,
                     DidYouMean(found, OptionNames(command)));
}

std::string DescribeConversion(const CLI::App& command, const std::string& text) {
  const std::string pair = After(text, "Could not convert: ");
  const std::size_t sign = pair.find(" = ");
  if (sign == std::string::npos) return text;
  const std::string name = pair.substr(0, sign);
  const CLI::Option* option = command.get_option_no_throw(name);
  const std::string type = option ? option->get_type_name() : "";
  return fmt::format("{}: found '{}', expected {}", name, pair.substr(sign + 3),
                     type == "INT" || type == "UINT" ? "a whole number"
                     : type == "FLOAT"               ? "a number"
                                                     : "another kind of value");
}

std::string DescribeCount(const std::string& text) {
  const std::string name = text.substr(0, text.find(": "));
  if (text.ends_with("missing")) return name + ": found no value, expected one";
  const std::string received = After(text, "received ");
  if (received.empty()) return text;
  return fmt::format("{}: found {} values, expected one", name, received);
}

std::string Describe(const CLI::App& app, const CLI::App* command, const CLI::ParseError& error) {
  const std::string text = error.what(), kind = error.get_name();
  if (!command) {
    if (app.remaining_size() > 0) return DescribeUnknownCommand(app, app.remaining().front());
    if (kind == "RequiredError") {
      return fmt::format("found no command, expected one of {}",
                         fmt::join(CommandNames(app), ", "));
    }
    return text;
  }
  if (dynamic_cast<const CLI::ExtrasError*>(&error)) return DescribeExtras(*command, text);
  if (kind == "ConversionError") return DescribeConversion(*command, text);
  if (kind == "ArgumentMismatch") return DescribeCount(text);
  const std::size_t is_required = text.rfind(" is required");
  if (kind == "RequiredError" && is_required != std::string::npos) {
    return fmt::format("{}: found no {}, expected one", command->get_name(),
                       text.substr(0, is_required));
  }
  return text;
}

void PrintHelp(CLI::App& app, const std::string& name) {
  if (name.empty()) {
    // help() of a program that has run a command is that command's.
    const auto all =
        app.get_formatter()->make_help(&app, app.get_name(), CLI::AppFormatMode::Normal);
    std::fputs(all.c_str(), stdout);
    return;
  }
  for (const CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) {
    if (command->get_name() != name) continue;
    std::fputs(command->help(app.get_name()).c_str(), stdout);
    return;
  }
  throw ConfigError(DescribeUnknownCommand(app, name));
}

}  // namespace

void AddHelpCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("help", "Show the usage of a command");
  const auto name = std::make_shared<std::string>();
  command->add_option("command", *name, "One of the commands; all without it");
  command->callback([&app, name] { PrintHelp(app, *name); });
}

void RefuseEmptyValues(CLI::App& app) {
  const CLI::Validator not_empty(
      [](std::string& value) {
        return value.empty() ? std::string("found an empty text, expected a value") : "";
      },
      "");
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) {
    for (CLI::Option* option : command->get_options()) {
      if (option->get_items_expected_max() > 0) option->check(not_empty);
    }
  }
}

std::string DescribeUsageError(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const CLI::App* command = chosen.empty() ? nullptr : chosen.front();
  const std::string where = command ? " help " + command->get_name() : " help";
  return fmt::format("{} ({}{} shows the usage)", Describe(app, command, error), app.get_name(),
                     where);
}

void AddCommands(CLI::App& app) {
  app.name("slcmap");
  app.description("Maps buildings from the images of a stereo camera and the samples of an IMU.");
  app.require_subcommand(1);
  // In the order in which data flows; each is in the file of its name.
  AddSimulateCommand(app);
  AddCheckCommand(app);
  AddConvertCommand(app);
  AddCalibrationCommand(app);
  AddOdometryCommand(app);
  AddMapCommand(app);
  AddMergeCommand(app);
  AddRegisterCommand(app);
  AddGeoreferenceCommand(app);
  AddExportCommand(app);
  AddViewCommand(app);
  AddRunCommand(app);
  AddEvaluateCommand(app);
  AddCompareCommand(app);
  AddBatchCommand(app);
  AddHelpCommand(app);
  RefuseEmptyValues(app);
}

bool Exists(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

void LogWarnings(const Warnings& warnings) {
  for (const auto& [kind, entry] : warnings.entries()) {
    spdlog::warn("{}: {}, first {}", Warnings::InWords(kind), entry.count, entry.first_place);
  }
}

void CheckThreads(int threads) {
  if (threads >= 1 && threads <= 256) return;
  throw ConfigError(fmt::format("--threads: found {}, expected 1 to 256", threads));
}

namespace {

// A file or folder that only one kind of folder holds. A killed run has no run.json, but poses.
struct Mark {
  const char* name;
  FolderKind kind;
};
constexpr Mark kMarks[] = {{"run.json", FolderKind::kRun},  {"journal", FolderKind::kRun},
                           {"map.json", FolderKind::kMap},  {"mav0", FolderKind::kSequence},
                           {"cam0", FolderKind::kSequence}, {"imu0", FolderKind::kSequence}};

const char* GetName(FolderKind kind) {
  return std::array{"a recorded sequence", "a run folder",
                    "a map folder"}[static_cast<std::size_t>(kind)];
}

// Where a result of `run` holds the folder that was meant.
std::string Hint(const std::string& path, FolderKind expected) {
  const std::string inner = path + (expected == FolderKind::kMap ? "/map" : "/run");
  const bool is_result = Exists(path + "/run/run.json") || Exists(path + "/map/map.json");
  if (expected == FolderKind::kSequence || !is_result || !Exists(inner)) return "";
  return fmt::format("; did you mean '{}'?", inner);
}

}  // namespace

void ExpectFolder(const std::string& path, FolderKind expected) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  const auto fail = [&](const std::string& found) {
    throw DataError(fmt::format("{}: found {}, expected {}", path, found, GetName(expected)) +
                    Hint(path, expected));
  };
  if (status.type() == std::filesystem::file_type::not_found) fail("no such folder");
  if (error) throw DataError(fmt::format("{}: cannot be opened: {}", path, error.message()));
  if (expected == FolderKind::kSequence && IsBagRecording(path)) return;
  if (expected == FolderKind::kSequence) RefuseVideo(path);
  if (status.type() != std::filesystem::file_type::directory) fail("a file");
  for (const Mark& mark : kMarks) {
    if (mark.kind == expected && Exists(path + "/" + mark.name)) return;
  }
  for (const Mark& mark : kMarks) {
    if (Exists(path + "/" + mark.name)) fail(GetName(mark.kind));
  }
  if (const std::string hint = Hint(path, expected); !hint.empty()) fail("the results of run");
}

}  // namespace slcmap::commands
