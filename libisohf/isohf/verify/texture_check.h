#pragma once

#include <string>
#include <vector>

#include "isohf/archive.h"

namespace isohf {

/// Decodes every texture of an archive and holds it against the metadata: size, channels, number, names, all levels of
/// a tile or none, PNG borders equal to those of the tiles East and South. One line for each thing wrong, naming the
/// member; empty where all is well or there are no textures. On the caller's oneTBB arena; memory: one row of tiles'
/// borders. Throws nothing that a damaged archive could cause.
[[nodiscard]] std::vector<std::string> check_textures(const ArchiveReader& archive);

}  // namespace isohf
