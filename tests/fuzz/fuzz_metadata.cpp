// Any text is an archive's metadata or one line that says what is wrong; what was read is written, and reads back as the
// same text. Records that lie in its extensions are read as well.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/error.h"
#include "isohf/metadata.h"
#include "isohf/restore/lossless.h"

namespace {

template <typename Read>
void tried(const Read& read) {
  try {
    read();
  } catch (const isohf::Error& error) {
    if (std::string(error.what()).find_first_of("\n\r") != std::string::npos) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  tried([&] {
    const isohf::Metadata metadata = isohf::parse_metadata(text);
    tried([&] { static_cast<void>(isohf::lossless_record(metadata)); });
    tried([&] { static_cast<void>(isohf::shadow_seed_info(metadata)); });
    tried([&] { static_cast<void>(isohf::texture_info(metadata)); });
    tried([&] { static_cast<void>(isohf::shard_record(metadata)); });
    for (int plane = 0; plane <= metadata.planes.count; ++plane) static_cast<void>(metadata.plane_grid(plane));
    // What the first text leaves out is written as what it stands for: from then on nothing changes.
    const std::string written = format_metadata(metadata);
    isohf::Metadata read = metadata;
    try {
      read = isohf::parse_metadata(written);
    } catch (const isohf::Error&) {
      std::abort();
    }
    if (format_metadata(read) != written) std::abort();
  });
  return 0;
}
