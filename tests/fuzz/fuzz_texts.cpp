// Any text is a reference system, or an .aux.xml, or one line that says why it is none.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "formats/georeference/sidecars.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/source_system.h"
#include "support/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    isohf::SourceInfo info;
    isohf::take_system(text, info);
    static_cast<void>(isohf::wkt_of(info.georeference.system, isohf::WktDialect::kGdal));
  } catch (const isohf::Error& error) {
    if (std::string(error.what()).find_first_of("\n\r") != std::string::npos) std::abort();
  }
  static const isohf::test::TemporaryFolder folder("/dev/shm");
  isohf::SourceInfo info;
  info.path = folder / "a.png";
  info.width = 5;
  info.height = 4;
  isohf::test::write_file(info.path + ".aux.xml", text);
  try {
    read_sidecars(info, 1);
  } catch (const isohf::Error& error) {
    const std::string message = error.what();
    if (!message.starts_with(info.path) || message.find_first_of("\n\r") != std::string::npos) std::abort();
  }
  return 0;
}
