#include "isohf/archive/metadata_json.h"

#include <fmt/format.h>

#include <set>

#include "isohf/error.h"

namespace isohf {

constexpr int kMaxDepth = 64;

bool is_format_member(const std::string& name) {
  static const std::set<std::string> names = {
      "format",     "version",  "producer",       "tile_shape", "tiles",   "extent",      "lattice",
      "samples",    "units",    "valid",          "outside",    "filter",  "acquisition", "source",
      "statistics", "textures", "content_sha256", "projection", "wraps_x", "level",       "edges"};
  return names.count(name) != 0;
}

void refuse_metadata(const std::string& where, const std::string& why) {
  throw Error(ErrorCode::kCorrupt, fmt::format("metadata: {}: {}", where, why));
}

void check_json_depth(const std::string& text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxDepth)
        refuse_metadata(fmt::format("at character {}", i), fmt::format("nests deeper than {}", kMaxDepth));
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

}  // namespace isohf
