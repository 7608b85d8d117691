#include "formats/georeference/reference_system.h"
#include "isohf/surface.h"

namespace isohf {

void understand_source(ArchiveReader& archive) {
  understand_world(archive);
  const SourceRecord& source = archive.metadata().source;
  const Georeference own = source_georeference(source);
  if (source.map || own.unit != HorizontalUnit::kMetre) return;
  const std::string text = system_text(own.system);
  if (text.empty()) {
    throw Error(ErrorCode::kInvalidArgument,
                archive.path() + ": names no reference system: it cannot be told where its metres lie");
  }
  try {
    archive.set_source_map(understand_map(text, source.metres_per_unit));
  } catch (const Error& error) {
    throw error.within(archive.path());
  }
}

void understand_world(ArchiveReader& archive) {
  const auto& projection = archive.metadata().projection;
  if (!projection || projection->spec.kind != ProjectionKind::kSystem || projection->spec.map) return;
  try {
    archive.set_world_map(understand_way(projection->spec.system, projection->spec.ellipsoid));
  } catch (const Error& error) {
    throw error.within(archive.path());
  }
}

}  // namespace isohf
