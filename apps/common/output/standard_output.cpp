#include "output/standard_output.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "output/terminal.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kBufferBytes = 1 << 16;

/// Settings as the library's messages name them, and the options that set them.
constexpr std::pair<std::string_view, std::string_view> kSpellings[] = {
    {"acquisition", "--acquisition"},
    {"bbox", "--bbox"},
    {"channel", "--channel"},
    {"clamp_range", "--clamp-range"},
    {"code_type", "--type"},
    {"density", "--density"},
    {"date", "--date"},
    {"encoding", "--encoding"},
    {"fill", "--fill"},
    {"fit", "--fit"},
    {"geoid", "--geoid"},
    {"levels", "--levels"},
    {"like", "--like"},
    {"lossless", "--lossless"},
    {"max_error", "--max-error"},
    {"max_rounding", "--max-rounding"},
    {"max_size", "--texture-size"},
    {"memory_bytes", "--memory"},
    {"method", "--method"},
    {"overwrite", "--overwrite"},
    {"part", "--part"},
    {"projection", "--to-crs"},
    {"raw", "--raw"},
    {"raw_scale", "--raw-scale"},
    {"reference_system", "--crs"},
    {"registration", "--registration"},
    {"resume", "--resume"},
    {"shadow_seeds", "--shadow-seeds"},
    {"shape", "--shape"},
    {"size", "--size"},
    {"spacing", "--spacing"},
    {"step", "--step"},
    {"sun_min_deg", "--sun-min"},
    {"surface", "--surface"},
    {"texture", "--texture"},
    {"threads", "--threads"},
    {"tiles", "--tiles"},
    {"valid_range", "--valid-range"},
    {"void_values", "--nodata"},
    {"wrap_x", "--wrap-x"},
    {"z_offset", "--z-offset"},
    {"z_range", "--z-range"},
    {"z_scale", "--z-scale"},
};

/// Writes a line in one call, so that lines of two processes do not mix; what cannot be told is not told.
void write_line(int file, const std::string& text) {
  const std::string line = text + '\n';
  const char* data = line.data();
  std::size_t left = line.size();
  while (left > 0) {
    const ssize_t written = ::write(file, data, left);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    data += written;
    left -= static_cast<std::size_t>(written);
  }
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

/// On one line; bytes that are no UTF-8 are replaced.
std::string line_of(const ordered_json& object) {
  return object.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

/// A line for people, `head` of them styled, or the JSON object that says the same.
void tell(const Common& common, const std::string& head, Style style, const std::string& text,
          const ordered_json& object) {
  if (common.json_notes) return write_line(common.err, line_of(object));
  const std::string name = common.name + ":";
  write_line(common.err, (style == Style::kWarning ? name + " " + styled(head, style, common.err)
                                                   : styled(name, style, common.err) + head) +
                             " " + printable(text));
}

int report(const Common& common, const std::string& text, const ordered_json& object, int exit_code) {
  tell(common, "", Style::kError, text, object);
  if (!common.json) return exit_code;
  try {
    StandardOutput out(common);
    out.write(line_of(object) + "\n");
    out.finish();
  } catch (const OutputClosed&) {
  } catch (const Error&) {  // it has been told on standard error, or is what is being told
  }
  return exit_code;
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
  if (pending_.size() >= kBufferBytes) flush();
}

void StandardOutput::flush() {
  std::size_t from = 0;
  while (from < pending_.size()) {
    const ssize_t written = ::write(file_, pending_.data() + from, pending_.size() - from);
    if (written < 0) {
      if (errno == EINTR) continue;
      if (errno == EPIPE) throw OutputClosed{};
      throw Error(ErrorCode::kIo, std::string("standard output: ") + std::strerror(errno));
    }
    from += static_cast<std::size_t>(written);
  }
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
    const std::string_view name = std::string_view(text).substr(open + 1, close - open - 1);
    for (const auto& [setting, option] : kSpellings) {
      if (name != setting) continue;
      text.replace(open, close - open + 1, option);
      break;
    }
  }
  return text;
}

void print_warnings(const Common& common, const std::vector<Warning>& warnings) {
  if (common.strict && !warnings.empty()) throw error_from(warnings);
  for (const Warning& warning : warnings) {
    const bool is_loss = warning.kind == Warning::Kind::kLoss;
    if (common.quiet && !is_loss) continue;
    const std::string text = spelled(warning);
    tell(common, "warning:", Style::kWarning, text,
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
  tell(common, "", Style::kError, spelled(error.what()), {{"error", json_from(error, exit_code_for(error.code()))}});
}

int print_error(const Common& common, const Error& error, int exit_code) {
  return report(common, spelled(error.what()), {{"error", json_from(error, exit_code)}}, exit_code);
}

int print_internal_error(const Common& common, const std::string& what) {
  return report(common, "internal error: " + what,
                {{"error", {{"code", "internal"}, {"exit_code", +kExitFailed}, {"message", what}}}}, kExitFailed);
}

void print_note(const Common& common, const std::string& text) {
  write_line(common.err, common.json_notes ? line_of({{"note", text}}) : common.name + ": " + printable(text));
}

void print_progress(const Common& common, const std::string& line) {
  write_line(common.err, printable(line));
}

}  // namespace isohf::cli
