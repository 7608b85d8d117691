// Any bytes take the place of a member of an archive, or of its metadata, with checksums, index and directory put right:
// verify says what is wrong, and what opens is read to the end. The first two bytes choose archive and member.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/error.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "support/altered_archive.h"
#include "support/temporary_folder.h"

namespace {

using isohf::test::AlteredArchive;

const std::vector<AlteredArchive>& archives() {
  static const std::vector<AlteredArchive> all = [] {
    std::vector<AlteredArchive> read;
    for (const char* name : {"u16-small-tiles", "u16-lossless-voids", "projected-lossless", "seeds-hulls",
                             "seeds-hulls-voids", "f32-voids", "u8-coarse-lossless", "textures-png", "textures-jpeg"}) {
      read.emplace_back(std::string(ISOHF_SOURCE_DIR "/testdata/conformance/good/") + name + ".isohf");
    }
    return read;
  }();
  return all;
}

void require_one_line(const std::string& text) {
  if (text.find_first_of("\n\r") != std::string::npos) std::abort();
}

/// All samples of the source, or why not.
void restore(const std::string& path) {
  try {
    const isohf::ArchiveReader archive(path);
    isohf::SourceRowReader rows(archive, {.threads = 1});
    while (!rows.at_end()) static_cast<void>(rows.read_next());
  } catch (const isohf::Error& error) {
    require_one_line(error.what());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  static const isohf::test::TemporaryFolder folder("/dev/shm");
  AlteredArchive altered = archives()[data[0] % archives().size()];
  const auto bytes = std::as_bytes(std::span(data, size)).subspan(2);
  const std::vector<std::string> names = altered.names();
  const std::size_t member = data[1] % (names.size() + 1);
  if (member == names.size()) {
    const auto text = nlohmann::json::parse(data + 2, data + size, nullptr, false);
    if (!text.is_object()) return 0;
    altered.metadata.merge_patch(text);
  } else {
    altered.set(names[member], {bytes.begin(), bytes.end()});
  }
  const std::string path = folder / "a.isohf";
  try {
    altered.write(path);
  } catch (const std::exception&) {
    return 0;  // no such archive can be put together
  }
  const isohf::VerifyReport report = isohf::verify_archive(path, {.threads = 1});
  for (const isohf::Finding& finding : report.findings) require_one_line(finding.text);
  restore(path);
  return 0;
}
