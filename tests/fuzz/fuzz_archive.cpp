// Any file is an archive or an error; what opens can be read from end to end without harm.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "isohf/archive.h"
#include "isohf/archive/textures/texture_reader.h"
#include "isohf/error.h"

namespace {

void read_everything(std::span<const std::byte> bytes) {
  const isohf::ArchiveReader reader(isohf::memory_source({bytes.begin(), bytes.end()}), "archive");
  static_cast<void>(reader.check_structure());
  for (const auto& member : reader.members()) {
    try {
      static_cast<void>(reader.read_member(member.name));
    } catch (const isohf::Error&) {
    }
  }
  if (isohf::texture_info(reader.metadata())) static_cast<void>(isohf::TextureReader(reader));
  const std::int64_t tiles = std::min<std::int64_t>(reader.grid().tile_count(), 64);
  if (reader.grid().shape().stored_vertex_count() > 1000000) return;  // an honest claim, but slow to fill
  for (std::int64_t flat = 0; flat < tiles; ++flat) {
    try {
      static_cast<void>(reader.read_tile(reader.grid().tile_at(flat)));
    } catch (const isohf::Error&) {
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    read_everything(std::as_bytes(std::span(data, size)));
  } catch (const isohf::Error&) {
  }
  return 0;
}
