#include "formats/planetary/label_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "formats/io/raw_file.h"
#include "formats/io/text_tokens.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/length_unit.h"

namespace isohf {
namespace {

constexpr std::size_t kMostLabelBytes = std::size_t{1} << 20U;
constexpr std::size_t kDeepestBlock = 16;

bool is_space(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

class Parser {
 public:
  Parser(const std::string& path, std::string_view text)
      : path_(std::make_shared<const std::string>(path)), text_(text) {}

  LabelText parse() {
    LabelText label{{path_, "", 1}};
    statements(label.root, 0);
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\r')) ++at_;
    if (at_ < text_.size() && text_[at_] == '\n') ++at_;
    label.end_bytes = at_;
    return label;
  }

 private:
  [[noreturn]] void fail(int line, const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: {}", *path_, line, what));
  }

  [[nodiscard]] std::string what_is_here() const { return '\'' + printable(text_.substr(at_, 1)) + '\''; }

  [[nodiscard]] bool starts(std::string_view what) const { return text_.substr(at_, what.size()) == what; }

  void step() {
    if (text_[at_] == '\n') ++line_;
    ++at_;
  }

  /// Goes to what is neither white space nor comment, which must be there.
  void skip_blank() {
    while (true) {
      while (at_ < text_.size() && is_space(text_[at_])) step();
      if (starts("/*")) {
        const int line = line_;
        while (at_ < text_.size() && !starts("*/")) step();
        if (at_ >= text_.size()) fail(line, "a comment has no end");
        at_ += 2;
      } else if (starts("#")) {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
      } else {
        break;
      }
    }
    if (at_ >= text_.size()) fail(line_, fmt::format("the label has no END within its first {} bytes", text_.size()));
  }

  bool skip_equals() {
    skip_blank();
    if (text_[at_] != '=') return false;
    ++at_;
    return true;
  }

  /// Characters up to white space or punctuation; only printable ones. A based integer holds its '#'.
  std::string bare() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && text_[at_] > ' ' && text_[at_] < 127 &&
           std::string_view("=,(){}<>\"'").find(text_[at_]) == std::string_view::npos && !starts("/*")) {
      ++at_;
    }
    return std::string(text_.substr(begin, at_ - begin));
  }

  std::string quoted(const std::string& key) {
    const char quote = text_[at_];
    const int line = line_;
    std::string result;
    for (step(); at_ < text_.size() && text_[at_] != quote; step()) {
      const bool is_blank = static_cast<unsigned char>(text_[at_]) <= ' ';
      if (!is_blank || (!result.empty() && result.back() != ' ')) result += is_blank ? ' ' : text_[at_];
    }
    if (at_ >= text_.size()) fail(line, fmt::format("the text of {} has no closing {}", key, quote));
    step();
    return trimmed(result);
  }

  std::string scalar(const std::string& key) {
    skip_blank();
    if (text_[at_] == '"' || text_[at_] == '\'') return quoted(key);
    std::string result = bare();
    if (result.empty()) fail(line_, fmt::format("{} has no value: found {}", key, what_is_here()));
    // GDAL writes Mars_2000_(Sphere) without quotes.
    while (at_ < text_.size() && text_[at_] == '(') {
      const std::size_t end = text_.find_first_of(")\n", at_);
      if (end == std::string_view::npos || text_[end] == '\n') break;
      result += text_.substr(at_, end + 1 - at_);
      at_ = end + 1;
      result += bare();
    }
    return result;
  }

  /// "<KM>", where one stands here.
  std::string unit(const std::string& key) {
    skip_blank();
    if (text_[at_] != '<') return {};
    const std::size_t begin = ++at_;
    while (at_ < text_.size() && text_[at_] != '>' && text_[at_] >= ' ') ++at_;
    if (at_ >= text_.size() || text_[at_] != '>') fail(line_, fmt::format("the unit of {} has no closing >", key));
    return lower_case(text_.substr(begin, at_++ - begin));
  }

  /// A list; lists within it are read as one with it.
  void list(const std::string& key, std::vector<LabelValue>& values) {
    std::string closing;
    do {
      skip_blank();
      const char c = text_[at_];
      if (c == '(' || c == '{') {
        if (closing.size() == kDeepestBlock) fail(line_, fmt::format("the lists of {} lie too deep", key));
        closing += c == '(' ? ')' : '}';
        ++at_;
      } else if (c == closing.back()) {
        closing.pop_back();
        ++at_;
      } else if (c == ',') {
        ++at_;
      } else {
        values.push_back({scalar(key), unit(key)});
      }
    } while (!closing.empty());
    const std::string shared = unit(key);
    for (LabelValue& each : values) {
      if (each.unit.empty()) each.unit = shared;
    }
  }

  /// Whether a value is left out, as some labels do: KEY =, and the next line is a statement of its own.
  bool is_left_out(int line) {
    if (line_ == line) return false;
    const auto [at, before] = std::pair(at_, line_);
    const std::string next = upper_case(bare());
    const bool is_statement = next == "END" || next == "END_OBJECT" || next == "END_GROUP" ||  //
                              (!next.empty() && skip_equals());
    at_ = at;
    line_ = before;
    return is_statement;
  }

  LabelEntry statement(const std::string& key, int line) {
    LabelEntry entry{key, {}, line};
    if (!skip_equals()) fail(line, fmt::format("{} is followed by {}, must be by =", key, what_is_here()));
    skip_blank();
    if (text_[at_] == '(' || text_[at_] == '{') {
      list(key, entry.values);
    } else if (!is_left_out(line)) {
      entry.values.push_back({scalar(key), unit(key)});
    }
    return entry;
  }

  /// Reads what stands in `block`, and its end.
  void statements(LabelBlock& block, std::size_t depth) {
    while (true) {
      skip_blank();
      const int line = line_;
      const std::string key = upper_case(bare());
      if (key.empty()) fail(line, fmt::format("found {}, must be a keyword", what_is_here()));
      if (key == "END") {
        if (depth > 0) fail(block.line, fmt::format("block {} has no end", block.name));
        return;
      }
      if (key == "END_OBJECT" || key == "END_GROUP") {
        const std::string name = skip_equals() ? upper_case(scalar(key)) : block.name;
        if (depth == 0) fail(line, key + " without a beginning");
        if (name == block.name) return;
        fail(line, fmt::format("{} = {} ends block {} of line {}", key, name, block.name, block.line));
      }
      if (key == "OBJECT" || key == "GROUP" || key == "BEGIN_OBJECT" || key == "BEGIN_GROUP") {
        if (!skip_equals()) fail(line, key + " has no name");
        if (depth == kDeepestBlock) fail(line, fmt::format("blocks lie deeper than {}", kDeepestBlock));
        statements(block.blocks.emplace_back(LabelBlock{path_, upper_case(scalar(key)), line}), depth + 1);
      } else {
        block.entries.push_back(statement(key, line));
      }
    }
  }

  std::shared_ptr<const std::string> path_;
  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

void collect(const LabelBlock& block, std::string_view name, std::vector<const LabelBlock*>& found) {
  for (const LabelBlock& inner : block.blocks) {
    if (inner.name == name) found.push_back(&inner);
    collect(inner, name, found);
  }
}

}  // namespace

const LabelEntry* LabelBlock::entry(std::string_view key) const {
  const auto found = std::ranges::find(entries, key, &LabelEntry::key);
  return found == entries.end() ? nullptr : &*found;
}

std::vector<const LabelBlock*> LabelBlock::all(std::string_view block_name) const {
  std::vector<const LabelBlock*> found;
  collect(*this, block_name, found);
  return found;
}

const LabelBlock& LabelBlock::inner(std::string_view block_name) const {
  const auto found = std::ranges::find(blocks, block_name, &LabelBlock::name);
  if (found != blocks.end()) return *found;
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: there is no {} in {}", *path, line, block_name,
                                               name.empty() ? "the label" : name));
}

const LabelValue* LabelBlock::value(std::string_view key) const {
  const LabelEntry* found = entry(key);
  if (found == nullptr || found->values.empty()) return nullptr;
  if (found->values.size() > 1) refuse(key, "one value");
  return &found->values.front();
}

std::optional<std::string> LabelBlock::text(std::string_view key) const {
  const LabelValue* found = value(key);
  return found == nullptr ? std::nullopt : std::optional(found->text);
}

std::string LabelBlock::word(std::string_view key, const char* otherwise) const {
  return upper_case(text(key).value_or(otherwise));
}

std::optional<double> LabelBlock::number(std::string_view key) const {
  const LabelValue* found = value(key);
  return found == nullptr ? std::nullopt : number_of(*found);
}

std::string LabelBlock::unit(std::string_view key) const {
  const LabelValue* found = value(key);
  return found == nullptr ? std::string() : found->unit;
}

std::optional<double> LabelBlock::metres(std::string_view key, const char* unit_by_default) const {
  const std::string stated = unit(key);
  const auto length = linear_unit(stated.empty() ? unit_by_default : stated.substr(0, stated.find('/')));
  const std::optional<double> found = number(key);
  return found && length ? std::optional(*found * length->metres) : std::nullopt;
}

std::int64_t LabelBlock::count(std::string_view key, std::int64_t lowest, std::int64_t highest,
                               std::optional<std::int64_t> otherwise) const {
  const LabelValue* found = value(key);
  if (found == nullptr && otherwise) return *otherwise;
  const std::string required = fmt::format("a whole number from {} to {}", lowest, highest);
  if (found == nullptr) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: label line {}: block {} has no {}, must be {}", *path, line, name, key, required));
  }
  const double given = number_of(*found).value_or(NAN);
  if (std::trunc(given) == given && given >= static_cast<double>(lowest) && given <= static_cast<double>(highest))
    return static_cast<std::int64_t>(given);
  refuse(key, required);
}

void LabelBlock::refuse(std::string_view key, const std::string& required) const {
  const LabelEntry* found = entry(key);
  std::vector<std::string> texts;
  if (found != nullptr) {
    for (const LabelValue& each : found->values) texts.push_back(each.text);
  }
  throw Error(ErrorCode::kCorrupt,
              fmt::format("{}: label line {}: {} is \"{}\", must be {}", *path, found == nullptr ? line : found->line,
                          key, fmt::join(texts, ", "), required));
}

LabelText read_label(const std::string& path) {
  const std::string text = first_bytes(RawFile(path), kMostLabelBytes);
  return Parser(path, text).parse();
}

std::optional<double> number_of(const LabelValue& value) {
  double number = 0.0;
  return read_decimal(value.text, number) && std::isfinite(number) ? std::optional(number) : std::nullopt;
}

}  // namespace isohf
