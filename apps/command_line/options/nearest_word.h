#pragma once

#include <string>
#include <vector>

namespace isohf::cli {

/// The candidate that was probably meant by `text`: a slip or two of the fingers away, or begun with it; empty where
/// there is none.
[[nodiscard]] std::string nearest_word(const std::string& text, const std::vector<std::string>& candidates);
/// "; did you mean NEAREST?", or nothing.
[[nodiscard]] std::string did_you_mean(const std::string& text, const std::vector<std::string>& candidates);

}  // namespace isohf::cli
