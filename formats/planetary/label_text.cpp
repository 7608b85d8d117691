#include "formats/planetary/label_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <span>

#include "formats/io/raw_file.h"
#include "formats/io/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kMostLabelBytes = std::size_t{1} << 20U;
constexpr std::size_t kDeepestBlock = 16;

bool is_space(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

class Parser {
 public:
  Parser(const std::string& path, std::string_view text) : path_(path), text_(text) {}

  LabelText parse() {
    LabelText label;
    // Blocks are built on a stack and moved into their parents, so that no pointer into a growing list is kept.
    std::vector<LabelBlock> open(1);
    while (true) {
      skip_blank();
      const int line = line_;
      const std::string key = upper_case(bare());
      if (key.empty()) fail(line, fmt::format("found {}, must be a keyword", what_is_here()));
      if (key == "END") break;
      if (key == "OBJECT" || key == "GROUP" || key == "BEGIN_OBJECT" || key == "BEGIN_GROUP") {
        if (!skip_equals()) fail(line, key + " has no name");
        if (open.size() > kDeepestBlock) fail(line, fmt::format("blocks lie deeper than {}", kDeepestBlock));
        open.push_back({upper_case(scalar(key)), line, {}, {}});
      } else if (key == "END_OBJECT" || key == "END_GROUP") {
        close(open, line, key);
      } else {
        open.back().entries.push_back(statement(key, line));
      }
    }
    if (open.size() > 1) fail(open.back().line, fmt::format("block {} has no end", open.back().name));
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\r')) ++at_;
    if (at_ < text_.size() && text_[at_] == '\n') ++at_;
    label.end_bytes = at_;
    label.root = std::move(open.front());
    return label;
  }

 private:
  [[noreturn]] void fail(int line, const std::string& what) const {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: {}", path_, line, what));
  }

  [[nodiscard]] std::string what_is_here() const {
    if (at_ >= text_.size()) return "the end of the label";
    const auto c = static_cast<unsigned char>(text_[at_]);
    return c > ' ' && c < 127 ? fmt::format("'{}'", text_[at_]) : fmt::format("byte {:#04x}", c);
  }

  [[nodiscard]] bool starts(std::string_view what) const { return text_.substr(at_, what.size()) == what; }

  void step() {
    if (text_[at_] == '\n') ++line_;
    ++at_;
  }

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
    bool blank = false;
    for (step(); at_ < text_.size() && text_[at_] != quote; step()) {
      if (is_space(text_[at_])) {
        blank = true;
      } else if (static_cast<unsigned char>(text_[at_]) < ' ') {
        fail(line_, fmt::format("the text of {} of line {} holds {}", key, line, what_is_here()));
      } else {
        if (blank && !result.empty()) result += ' ';
        blank = false;
        result += text_[at_];
      }
    }
    if (at_ >= text_.size()) fail(line, fmt::format("the text of {} has no closing {}", key, quote));
    step();
    return result;
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

  LabelValue value(const std::string& key) {
    LabelValue result{scalar(key), {}};
    skip_blank();
    if (text_[at_] == '<') result.unit = unit(key);
    return result;
  }

  std::string unit(const std::string& key) {
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
        values.push_back(value(key));
      }
    } while (!closing.empty());
  }

  LabelEntry statement(const std::string& key, int line) {
    LabelEntry entry{key, {}, line};
    if (!skip_equals()) fail(line, fmt::format("{} is followed by {}, must be by =", key, what_is_here()));
    skip_blank();
    if (text_[at_] == '(' || text_[at_] == '{') {
      list(key, entry.values);
      skip_blank();
      if (text_[at_] == '<') {
        const std::string shared = unit(key);
        for (LabelValue& each : entry.values) {
          if (each.unit.empty()) each.unit = shared;
        }
      }
      return entry;
    }
    // Some labels leave a value out: KEY =, and the next line is a statement of its own.
    const auto [at, before] = std::pair(at_, line_);
    const std::string next = before > line ? upper_case(bare()) : "";
    if (next == "END" || next == "END_OBJECT" || next == "END_GROUP" || (!next.empty() && skip_equals())) {
      at_ = at;
      line_ = before;
      return entry;
    }
    at_ = at;
    line_ = before;
    entry.values.push_back(value(key));
    return entry;
  }

  void close(std::vector<LabelBlock>& open, int line, const std::string& key) {
    std::string name;
    if (skip_equals()) name = upper_case(scalar(key));
    if (open.size() < 2) fail(line, key + " without a beginning");
    if (!name.empty() && name != open.back().name) {
      fail(line, fmt::format("{} = {} ends block {} of line {}", key, name, open.back().name, open.back().line));
    }
    LabelBlock done = std::move(open.back());
    open.pop_back();
    open.back().blocks.push_back(std::move(done));
  }

  std::string path_;
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

template <typename Number, typename... Base>
std::optional<Number> whole_text(std::string_view text, Base... base) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base...);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

const LabelEntry* LabelBlock::entry(std::string_view key) const {
  const auto found = std::find_if(entries.begin(), entries.end(), [&](const LabelEntry& e) { return e.key == key; });
  return found == entries.end() ? nullptr : &*found;
}

std::vector<const LabelBlock*> LabelBlock::all(std::string_view block_name) const {
  std::vector<const LabelBlock*> found;
  collect(*this, block_name, found);
  return found;
}

LabelText parse_label(const std::string& path, std::string_view text) {
  return Parser(path, text).parse();
}

LabelText read_label(const std::string& path, std::uint64_t unpacked_bytes) {
  const RawFile file(path, unpacked_bytes);
  std::string text(static_cast<std::size_t>(std::min<std::uint64_t>(file.size_bytes(), kMostLabelBytes)), '\0');
  text.resize(file.read_some(0, std::as_writable_bytes(std::span(text))));
  return parse_label(path, text);
}

std::optional<double> number_of(const LabelValue& value) {
  std::string_view text = value.text;
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const std::size_t hash = text.find('#');
  if (hash != std::string_view::npos && text.back() == '#' && text.size() > hash + 2) {
    const std::optional<int> base = whole_text<int>(text.substr(0, hash));
    if (!base || *base < 2 || *base > 16) return std::nullopt;
    const auto digits = whole_text<std::uint32_t>(text.substr(hash + 1, text.size() - hash - 2), *base);
    return digits ? std::optional(static_cast<double>(*digits)) : std::nullopt;
  }
  const std::optional<double> number = whole_text<double>(text);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

const LabelValue* LabelFields::value(std::string_view key) const {
  const LabelEntry* entry = block_->entry(key);
  if (entry == nullptr || entry->values.empty()) return nullptr;
  if (entry->values.size() > 1) refuse(key, "one value");
  return &entry->values.front();
}

std::optional<std::string> LabelFields::text(std::string_view key) const {
  const LabelValue* found = value(key);
  return found == nullptr ? std::nullopt : std::optional(found->text);
}

std::optional<std::string> LabelFields::word(std::string_view key) const {
  const std::optional<std::string> found = text(key);
  return found ? std::optional(upper_case(*found)) : std::nullopt;
}

std::optional<double> LabelFields::number(std::string_view key) const {
  const LabelValue* found = value(key);
  return found == nullptr ? std::nullopt : number_of(*found);
}

std::string LabelFields::unit(std::string_view key) const {
  const LabelValue* found = value(key);
  return found == nullptr ? std::string() : found->unit;
}

std::int64_t LabelFields::count(std::string_view key, std::int64_t lowest, std::int64_t highest,
                                std::optional<std::int64_t> fallback) const {
  const LabelValue* found = value(key);
  if (found == nullptr && fallback) return *fallback;
  const std::string required = fmt::format("a whole number from {} to {}", lowest, highest);
  if (found == nullptr) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: label line {}: block {} has no {}, must be {}", path_,
                                                 block_->line, block_->name, key, required));
  }
  const std::optional<double> number = number_of(*found);
  if (!number || std::trunc(*number) != *number || *number < static_cast<double>(lowest) ||
      *number > static_cast<double>(highest)) {
    refuse(key, required);
  }
  return static_cast<std::int64_t>(*number);
}

void LabelFields::refuse(std::string_view key, const std::string& required) const {
  const LabelEntry* entry = block_->entry(key);
  std::vector<std::string> texts;
  if (entry != nullptr) {
    for (const LabelValue& each : entry->values) texts.push_back(each.text);
  }
  throw Error(ErrorCode::kCorrupt,
              fmt::format("{}: label line {}: {} is \"{}\", must be {}", path_,
                          entry == nullptr ? block_->line : entry->line, key, fmt::join(texts, ", "), required));
}

}  // namespace isohf
