#pragma once

#include <memory>
#include <string>

#include "isohf/archive.h"
#include "isohf/archive/writer.h"
#include "isohf/convert/stages/plane_stage.h"
#include "isohf/metadata.h"
#include "isohf/parts.h"

namespace isohf {

/// Why tiles of one archive cannot be compared with those of the other by elevations, one clause; empty if both lie on
/// one lattice.
[[nodiscard]] std::string why_other_vertices(const Metadata& one, const Metadata& other);

/// Throws Error{kInvalidArgument} if an archive's members cannot be copied as they are: repacked.
void require_copyable(const ArchiveReader& archive);

/// "columns 0 to 5 and rows 2 to 3", for messages.
[[nodiscard]] std::string text_of(const TileRange& tiles);

/// Coarse planes of tiles that are copied to a writer, whose archive is `output`; nullptr if there are none.
[[nodiscard]] std::unique_ptr<PlaneStage> planes_while_copying(const Metadata& metadata, ArchiveWriter& writer,
                                                               const std::string& output);

void drop_extension(Metadata& metadata, const char* name);
void set_extension(Metadata& metadata, const char* name, std::string text);

/// How an archive of copied tiles is written.
[[nodiscard]] WriterOptions options_while_copying(const Metadata& metadata, const PartOptions& options);
/// Completes the archive. Its metadata get the number and size of the seeds and textures that were written.
void finish_copy(ArchiveWriter& writer, Metadata& metadata, PartSummary& summary);

}  // namespace isohf
