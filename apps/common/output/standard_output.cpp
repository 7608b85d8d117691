#include "output/standard_output.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "output/json_output.h"
#include "output/terminal.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kBufferBytes = 1 << 16;

/// Settings as the library's messages name them, where the option is not called the same.
constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
    {"code_type", "--type"},     {"max_size", "--texture-size"}, {"memory_bytes", "--memory"},
    {"projection", "--to-crs"},  {"reference_system", "--crs"},  {"sun_min_deg", "--sun-min"},
    {"void_values", "--nodata"},
};

/// Returns errno of what failed, 0 if everything was written.
int write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno != EINTR) return errno;
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// Control characters become blanks, but for those of `kept`.
std::string without_controls(std::string text, std::string_view kept) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto at = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
    const bool is_c0 = (at(i) < 0x20 || at(i) == 0x7f) && kept.find(text[i]) == std::string_view::npos;
    // In UTF-8: U+0080 to U+009F, and what turns the direction of writing or breaks a line.
    const bool is_c1 = at(i) == 0xc2 && at(i + 1) >= 0x80 && at(i + 1) < 0xa0;
    const bool is_format = at(i) == 0xe2 && ((at(i + 1) == 0x80 && at(i + 2) >= 0xa8 && at(i + 2) <= 0xae) ||
                                             (at(i + 1) == 0x81 && at(i + 2) >= 0xa6 && at(i + 2) <= 0xa9));
    if (!is_c0 && !is_c1 && !is_format) continue;
    text[i] = ' ';
    text.erase(i + 1, is_c0 ? 0 : is_c1 ? 1 : 2);
  }
  return text;
}

/// A line on standard error for people, or with --progress json the object that says the same. One call, so that lines
/// of two processes do not mix; nobody can be told that it failed.
void print_line(const Common& common, const std::string& line, const ordered_json& object) {
  static_cast<void>(write_all(common.err, common.json_notes ? json_line(object) : line + "\n"));
}

}  // namespace

void StandardOutput::write(std::string_view text) {
  // Text quotes what stands in files; rows of numbers pass as they are.
  const bool is_plain = std::ranges::all_of(text, [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte >= 0x20 && byte < 0x7f) || c == '\n';
  });
  if (is_plain) return write_styled(text);
  write_styled(without_controls(std::string(text), "\n\t"));
}

void StandardOutput::write_styled(std::string_view text) {
  pending_ += text;
  if (pending_.size() >= kBufferBytes) finish();
}

void StandardOutput::finish() {
  const int failure = write_all(file_, pending_);
  if (failure == EPIPE) throw OutputClosed{};
  if (failure != 0) throw Error(ErrorCode::kIo, std::string("standard output: ") + std::strerror(failure));
  pending_.clear();
}

std::string printable(std::string text) {
  return without_controls(std::move(text), "");
}

int exit_code_for(ErrorCode code) {
  if (code == ErrorCode::kInvalidArgument) return kExitUsage;
  if (code == ErrorCode::kCancelled) return kExitInterrupted;
  return kExitFailed;
}

std::string spelled(std::string text) {
  for (std::size_t open = 0; (open = text.find('`', open)) != std::string::npos; ++open) {
    const std::size_t close = text.find('`', open + 1);
    if (close == std::string::npos) break;
    const std::string setting = text.substr(open + 1, close - open - 1);
    if (setting.find_first_not_of("abcdefghijklmnopqrstuvwxyz_") != std::string::npos) continue;
    std::string option = "--" + setting;
    std::ranges::replace(option, '_', '-');
    for (const auto& [name, other] : kSpellings) {
      if (name == setting) option = other;
    }
    text.replace(open, close - open + 1, option);
  }
  return text;
}

void print_warnings(const Common& common, const std::vector<Warning>& warnings) {
  if (common.strict && !warnings.empty()) throw error_from(warnings);
  for (const Warning& warning : warnings) {
    const bool is_loss = warning.kind == Warning::Kind::kLoss;
    if (common.quiet && !is_loss) continue;
    const std::string text = spelled(warning);
    print_line(common, common.name + ": " + styled("warning:", Style::kWarning, common.err) + " " + printable(text),
               {{"warning", {{"kind", is_loss ? "loss" : "note"}, {"message", text}}}});
  }
}

void print_warning(const Common& common, const Warning& warning) {
  print_warnings(common, {warning});
}

ordered_json json_from(const std::vector<Warning>& warnings) {
  ordered_json list = ordered_json::array();
  for (const Warning& warning : warnings) list.push_back(spelled(warning));
  return list;
}

ordered_json json_from(const Error& error, int exit_code) {
  // In the order of ErrorCode.
  static constexpr std::array kCodes = {"invalid-argument", "io",        "unsupported", "corrupt",
                                        "out-of-memory",    "cancelled", "warning",     "no-elevation"};
  ordered_json json = {{"code", kCodes.at(static_cast<std::size_t>(error.code()))},
                       {"exit_code", exit_code},
                       {"message", spelled(error.what())}};
  const ErrorParts parts = error.parts();
  const auto add = [&](const char* name, const std::string& text) {
    if (!text.empty()) json[name] = spelled(text);
  };
  add("where", parts.where);
  add("found", parts.found);
  add("required", parts.required);
  add("remedy", parts.remedy);
  return json;
}

void print_error_line(const Common& common, const Error& error) {
  Common without_document = common;
  without_document.json = false;
  print_error(without_document, error, exit_code_for(error.code()));
}

int print_error(const Common& common, const Error& error, int exit_code) {
  const ordered_json document = {{"error", json_from(error, exit_code)}};
  print_line(common, styled(common.name + ":", Style::kError, common.err) + " " + printable(spelled(error.what())),
             document);
  // Standard output may be what failed.
  if (common.json) static_cast<void>(write_all(common.out, json_line(document)));
  return exit_code;
}

void print_note(const Common& common, const std::string& text) {
  print_line(common, common.name + ": " + printable(text), {{"note", text}});
}

}  // namespace isohf::cli
