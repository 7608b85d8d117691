#include "options/nearest_word.h"

#include <algorithm>
#include <cctype>

namespace isohf::cli {
namespace {

/// Letters to insert, leave out, replace, or swap with their neighbour.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

std::string nearest_word(const std::string& text, const std::vector<std::string>& candidates) {
  constexpr std::size_t kLongest = 64;
  if (text.size() > kLongest) return {};
  const std::string typed = lower(text);
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(1, typed.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::string word = lower(candidate);
    std::size_t distance = edit_distance(typed, word);
    if (typed.size() >= 3 && word.starts_with(typed)) distance = std::min<std::size_t>(distance, 1);
    // A letter for another of a word of one letter or two is no slip.
    if (distance < best_distance && distance < word.size() && (word.size() > 2 || distance == 0)) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(const std::string& text, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_word(text, candidates);
  return nearest.empty() ? "" : "; did you mean " + nearest + "?";
}

}  // namespace isohf::cli
