#include "formats/io/bands.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>

#include "formats/georeference/sidecars.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {

std::size_t band_of_heights(const std::vector<std::string>& names) {
  const auto rank = [](const std::string& name) {
    const std::string word = trimmed(lower_case(name).substr(0, name.find_first_of("([")));
    const auto at = static_cast<std::size_t>(std::ranges::find(kHeightWords, word) - kHeightWords.begin());
    return at == kHeightWords.size() && word != "z" ? at + 1 : at;
  };
  return static_cast<std::size_t>(std::ranges::min_element(names, {}, rank) - names.begin());
}

std::int64_t choose_band(SourceInfo& info, const OpenOptions& options, std::int64_t bands,
                         std::vector<std::string> names) {
  if (bands > 1) name_bands_beside(info.path, static_cast<std::size_t>(bands), names);
  std::int64_t band = 0;
  const auto named = std::find(names.begin(), names.end(), options.channel);
  const auto called = [&](std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    return at < names.size() && !names[at].empty() ? printable(names[at]) : fmt::format("{}", i);
  };
  if (!options.channel.empty() && named != names.end() && named - names.begin() < bands) {
    band = named - names.begin();
  } else if (!options.channel.empty()) {
    const char* const end = options.channel.data() + options.channel.size();
    const auto [at, error] = std::from_chars(options.channel.data(), end, band);
    if (error != std::errc{} || at != end || band < 0 || band >= bands) {
      std::string there = bands == 1 ? "is 0 alone" : fmt::format("are 0 to {}", bands - 1);
      constexpr std::size_t kLongestList = 200;
      for (std::size_t i = 0; i < names.size() && there.size() < kLongestList; ++i) {
        if (!names[i].empty()) there += fmt::format("{} {}", i == 0 ? ":" : ",", printable(names[i]));
      }
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{}: there is no channel \"{}\"; there {}", info.path, options.channel, there));
    }
  } else if (bands > 1) {
    band = static_cast<std::int64_t>(band_of_heights(names));
    info.warnings.push_back(fmt::format("there are {} bands; channel {} is read", bands, called(band)));
  }
  if (bands > 1) info.channel = called(band);
  return band;
}

}  // namespace isohf
