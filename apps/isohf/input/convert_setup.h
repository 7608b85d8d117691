#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "input/options_ground.h"
#include "input/options_source.h"
#include "input/options_texture.h"
#include "input/source_inputs.h"
#include "isohf/convert.h"
#include "isohf/raster.h"
#include "isohf/shards.h"
#include "options/work_options.h"
#include "program.h"

namespace isohf::cli {

/// Of convert, and of plan, which previews it.
struct ConvertCommandOptions {
  const Common& common;
  WorkOptions work{};
  SourceInputs inputs{};
  std::string input{};  ///< what messages and reports call them: the file, or "mosaic of 12 files"
  std::string output{};
  std::string out_dir{};    ///< for an archive of each input; empty: one of all
  bool keep_going = false;  ///< a file that fails does not stop the others
  OpenOptions open{};
  TextureOptions texture{};
  ConvertOptions convert{};
  GeoidRequest geoid{};
  bool spacing_in_metres = false;
  std::optional<ShardNumber> shard{};
};

/// All options but INPUT.
void add_conversion_options(CLI::App& line, ConvertCommandOptions& options, Common& common);
/// After parsing: checks what options cannot check alone, and derives the rest. Throws Error{kInvalidArgument}.
void complete(const CLI::App& line, ConvertCommandOptions& options);
/// What is packed shares the memory with what is read from it, and with the tiles.
void share_memory(ConvertCommandOptions& options);

/// A source, and what is read beside it.
struct Prepared {
  std::vector<std::string> files;
  std::unique_ptr<HeightSource> source;
  std::unique_ptr<PhotoSource> photo;
};

/// Opens the inputs and completes the options by them.
[[nodiscard]] Prepared prepare(ConvertCommandOptions& options, std::vector<std::string> files);

/// The largest resident set so far. getrusage() would also count the program that started this one.
[[nodiscard]] std::uint64_t peak_memory_bytes();

/// Why making `output` ended; `again`, a command, where there is a part that it goes on with.
[[nodiscard]] Error interrupted(const std::string& output, const std::string& again);

}  // namespace isohf::cli
