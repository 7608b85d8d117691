#include "formats/mosaic/companions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>

#include "formats/io/input_files.h"
#include "isohf/base/text/text.h"

namespace isohf {
namespace {

/// A product's files: names that end in `heights` are elevations, those that end in one of `companions` are not.
struct Product {
  std::string_view heights;
  std::vector<std::string_view> companions;
};

const std::vector<Product>& products() {
  static const std::vector<Product> table = {
      // ASTER GDEM, ASTWBD; Copernicus GLO-30 and GLO-90; TanDEM-X; ArcticDEM and REMA; NASA's Ames Stereo Pipeline
      {"dem", {"num",         "att",     "edm",     "flm",      "hem",
               "wbm",         "acm",     "am2",     "amp",      "com",
               "cov",         "lsm",     "wam",     "count",    "countmt",
               "mad",         "mindate", "maxdate", "datamask", "matchtag",
               "bitmask",     "browse",  "ortho",   "drg",      "intersectionerr",
               "goodpixelmap"}},
      {"dsm", {"msk", "stk", "qai"}},                // AW3D30
      {"elv", {"dir", "upa", "upg", "wth", "hnd"}},  // MERIT Hydro
  };
  return table;
}

/// Words that make a companion of a file that is called the same without one: SRTM's counts, GEBCO's type identifiers,
/// 3DEP's metadata, and what people derive.
constexpr std::array<std::string_view, 12> kAdded = {"num",   "swb",   "tid",    "meta",      "mask",        "msk",
                                                     "error", "slope", "aspect", "hillshade", "uncertainty", "count"};

/// A name in lower case, in words.
std::vector<std::string> words_of(const std::string& path) {
  const std::string name = lower_case(bare_name(path));
  std::vector<std::string> words(1);
  for (const char c : name) {
    if (c == '_' || c == '-' || c == '.') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  return words;
}

bool is_one_of(const auto& words, const std::string& word) {
  return std::ranges::find(words, std::string_view(word)) != words.end();
}

/// The folder and the words of a name, without that at `left_out`.
std::string key_of(const std::string& path, std::vector<std::string> words, std::optional<std::size_t> left_out = {}) {
  if (left_out) words.erase(words.begin() + static_cast<std::ptrdiff_t>(*left_out));
  return fmt::format("{}/{}", std::filesystem::path(path).parent_path().string(), fmt::join(words, "_"));
}

}  // namespace

std::vector<Warning> leave_out_companions(std::vector<std::string>& paths) {
  std::set<std::string_view> heights;  // of the products of which elevations are there
  std::set<std::string> names;
  for (const std::string& path : paths) {
    const std::vector<std::string> words = words_of(path);
    for (const Product& product : products()) {
      if (words.back() == product.heights) heights.insert(product.heights);
    }
    names.insert(key_of(path, words));
  }
  const auto is_companion = [&](const std::string& path) {
    const std::vector<std::string> words = words_of(path);
    const bool is_of_product = std::ranges::any_of(products(), [&](const Product& product) {
      return heights.contains(product.heights) && is_one_of(product.companions, words.back());
    });
    if (is_of_product) return true;
    for (std::size_t i = 1; i < words.size(); ++i) {
      if (is_one_of(kAdded, words[i]) && names.contains(key_of(path, words, i))) return true;
    }
    return false;
  };
  std::vector<std::string> companions;
  std::erase_if(paths, [&](const std::string& path) {
    if (!is_companion(path)) return false;
    companions.push_back(path);
    return true;
  });
  if (companions.empty()) return {};
  constexpr std::size_t kMostNamed = 3;
  const std::size_t more = companions.size() - std::min(companions.size(), kMostNamed);
  companions.resize(companions.size() - more);
  return {loss(fmt::format("{}{}: left out; {} (errors, counts, masks), by the name", fmt::join(companions, ", "),
                           more > 0 ? fmt::format(" and {} more", more) : "",
                           companions.size() + more == 1 ? "it accompanies elevations" : "they accompany elevations"))};
}

}  // namespace isohf
