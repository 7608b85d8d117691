#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "input/source_inputs.h"
#include "isohf/convert.h"
#include "isohf/raster.h"
#include "isohf/shards.h"
#include "options/work_options.h"
#include "program.h"

namespace isohf::cli {

/// The options of convert, and of plan, which previews it.
struct ConvertCommandOptions {
  const Common& common;
  WorkOptions work{};
  SourceInputs inputs{};
  std::string output{};
  std::string out_dir{};    ///< for an archive of each input; empty: one of all
  bool keep_going = false;  ///< a failed input does not stop the others
  OpenOptions open{};
  std::string photo{};  ///< for textures; empty: none
  TextureRequest texture{};
  bool with_seeds = false;
  ShadowSeedRequest seeds{};
  ConvertOptions convert{};
  GeoidRequest geoid{};
  bool spacing_in_metres = false;
  std::optional<ShardNumber> shard{};
};

/// All options but INPUT.
void add_conversion_options(CLI::App& line, ConvertCommandOptions& options, Common& common);
/// After parsing: checks what options cannot check alone, and derives the rest. Throws Error{kInvalidArgument}.
void complete(const CLI::App& line, ConvertCommandOptions& options);

/// A source, and what is read with it.
struct Prepared {
  std::vector<std::string> files;
  std::unique_ptr<HeightSource> source;
  std::unique_ptr<PhotoSource> photo;
};

/// Opens the inputs and completes the options by them.
[[nodiscard]] Prepared prepare(ConvertCommandOptions& options, std::vector<std::string> files);

}  // namespace isohf::cli
