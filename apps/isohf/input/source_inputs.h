#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/adapters/cropped_source.h"
#include "formats/mosaic/mosaic_source.h"
#include "formats/registry.h"
#include "isohf/convert.h"
#include "isohf/fill/geoid_source.h"
#include "isohf/raster.h"
#include "options/work_options.h"

namespace isohf::cli {

/// The options by which an input was read, as an archive records them: name without dashes, and text.
using RecordedOptions = std::vector<std::pair<std::string, std::string>>;

/// The inputs of a command that form one source, and how they are joined.
struct SourceInputs {
  std::vector<std::string> names;  ///< files, folders, patterns and @lists, as typed
  OverlapRule overlap = OverlapRule::kLast;
  bool recursive = false;
  std::optional<BoundingBox> box;           ///< of the whole, only this part
  std::optional<RecordedOptions> as_given;  ///< for the archive's metadata
  ProjectionRequest onto;                   ///< the map on which inputs of different reference systems are joined
};

/// --bbox, --on-top, --recursive.
void add_mosaic_options(CLI::App& line, SourceInputs& inputs);

/// After parsing: the options by which samples are read, and of a geoid the file's name without its folder.
[[nodiscard]] RecordedOptions recorded_options(const CLI::App& line);

/// An input's options, as an archive records them.
struct RecordedInput {
  SourceInputs inputs;
  OpenOptions open;
  GeoidRequest geoid;  ///< by its name, without a folder
};
/// Throws Error{kCorrupt} naming the archive's member for what are no such options.
[[nodiscard]] RecordedInput recorded_input(const RecordedOptions& recorded);

/// Inputs, opened as one source.
struct OpenedInputs {
  std::vector<std::string> files;
  std::unique_ptr<HeightSource> source;
  SourceNote note;              ///< for the archive's metadata and --resume
  bool is_reprojected = false;  ///< inputs of different systems are on SourceInputs::onto already
};

/// Opens what `files`, as expand_inputs returns them, are together: the file itself if it is one, else their mosaic.
[[nodiscard]] OpenedInputs open_inputs(std::vector<std::string> files, const SourceInputs& inputs,
                                       const OpenOptions& options, const WorkOptions& work);

/// The source without a last column that repeats the first one, if both edges will be joined, and moved by the geoid.
/// keeps_samples  all of them are wanted back: no column goes unless joining was demanded
[[nodiscard]] std::unique_ptr<HeightSource> laid_out(std::unique_ptr<HeightSource> source, const GeoidRequest& geoid,
                                                     const GroundRequest& ground, bool keeps_samples);

}  // namespace isohf::cli
