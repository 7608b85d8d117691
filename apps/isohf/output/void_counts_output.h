#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "isohf/fill/filled_source.h"

namespace isohf::cli {

/// The voids of an input of which every row has been read: as a FilledSource counted them, or `voids` where there is
/// none; nullopt where nobody counted.
[[nodiscard]] std::optional<VoidCounts> counts_of_voids(const HeightSource& source, std::optional<std::int64_t> voids);

/// "1 204 samples, 17 of them by --valid-range; 1 100 filled, 104 left".
[[nodiscard]] std::string text_from_voids(const VoidCounts& counts);
[[nodiscard]] nlohmann::ordered_json json_from_voids(const std::optional<VoidCounts>& counts);

}  // namespace isohf::cli
