#include "input/source_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>

#include "formats/adapters/windowed_source.h"
#include "input/options_source.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/base/arena.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/error.h"
#include "options/command_line.h"
#include "options/option_values.h"

namespace isohf::cli {
namespace {

constexpr const char* kOrders[] = {"last", "first"};  // of OverlapRule

std::string sha256_of(const std::string& text) {
  return hex(sha256(std::as_bytes(std::span<const char>(text))));
}

std::string file_name(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

/// How an archive records a mosaic, and the fingerprint of its files.
void describe_mosaic(const MosaicPlan& plan, OverlapRule rule, SourceNote& note) {
  constexpr std::size_t kFilesNamed = 8;
  std::vector<const MosaicMember*> members;  // the finest first, by their positions
  for (auto layer = plan.layers.rbegin(); layer != plan.layers.rend(); ++layer) {
    for (const MosaicMember& member : layer->members) members.push_back(&member);
  }
  MosaicRecord& record = note.mosaic.emplace();
  record.overlap = kOrders[static_cast<int>(rule)];
  record.files = static_cast<std::int64_t>(members.size());
  std::string names;
  for (const MosaicMember* member : members) {
    if (record.first_names.size() < kFilesNamed) record.first_names.push_back(file_name(member->path));
    names += file_name(member->path) + "\n";
  }
  record.names_sha256 = sha256_of(names);
  // The record does not depend on the order in which files were named; the fingerprint does.
  std::sort(members.begin(), members.end(), [](const auto* a, const auto* b) { return a->order < b->order; });
  std::string text;
  for (const MosaicMember* member : members)
    text += fmt::format("{} {} at {} {}\n", file_name(member->path), member->stamp.text(), member->column, member->row);
  note.fingerprint = fmt::format("mosaic {} {} files {}", record.overlap, members.size(), sha256_of(text));
}

/// Whether the last column repeats the first one, and both edges will be joined.
bool drops_repeated_column(const SourceInfo& info, GroundRequest request, bool keeps_samples) {
  if (request.wrap == Wrap::kNever || (request.wrap == Wrap::kAuto && keeps_samples)) return false;
  GroundRequest own;
  understand_ground(info, own);
  if (closure_of(info, own.source_map.get()) != Closure::kRepeated) return false;
  if (request.wrap == Wrap::kAlways) return true;
  SourceInfo closed = info;
  --closed.width;
  understand_ground(closed, request);
  return make_source_frame(closed, request).wraps_x;
}

/// Declares the options of an input in a command line of its own.
void declare_input(CLI::App& line, RecordedInput& input) {
  line.set_help_flag();
  line.option_defaults()->take_last();
  add_source_options(line, input.open);
  add_mosaic_options(line, input.inputs);
  add_geoid_option(line, input.geoid);
}

}  // namespace

void add_mosaic_options(CLI::App& line, SourceInputs& inputs) {
  option(line, "--bbox", "W,S,E,N", "Convert only this part, in the input's coordinates",
         [&inputs](const std::string& text) { inputs.box = bounding_box_from_string(text); });
  group(line, "Joining inputs");
  choice<OverlapRule>(line, "--on-top", {{"last", OverlapRule::kLast}, {"first", OverlapRule::kFirst}},
                      "Which of overlapping inputs shows. Finer inputs always do, and nodata shows what is below "
                      "[default: last]",
                      inputs.overlap);
  line.add_flag("--recursive", inputs.recursive, "Search folders of folders too");
}

RecordedOptions recorded_options(const CLI::App& line) {
  constexpr std::array kNumbers = {"nodata", "valid-range", "fill", "z-scale", "z-offset", "sample-spacing"};
  RecordedInput unused;
  CLI::App input;
  declare_input(input, unused);
  RecordedOptions recorded;
  for (const CLI::Option* declared : input.get_options()) {
    const std::string option = long_name(*declared);
    const std::string name = option.substr(2);
    // Files are found by --recursive; the same samples are the same bytes.
    if (name == "recursive" || !given(line, option)) continue;
    const std::string text = line.get_option(option)->results().back();
    if (text == "false") continue;
    // Not the file that holds the text of a system, nor the folder of a geoid.
    recorded.emplace_back(name, std::ranges::find(kNumbers, name) != kNumbers.end() ? with_plain_numbers(text)
                                : name == "crs"                                     ? system_from(text)
                                : name == "geoid"                                   ? file_name(text)
                                                                                    : text);
  }
  return recorded;
}

RecordedInput recorded_input(const RecordedOptions& recorded) {
  RecordedInput input;
  CLI::App line;
  declare_input(line, input);
  // Nothing that an archive records names a file but the geoid, and that without a folder.
  std::vector<std::string> words;
  for (const auto& [name, text] : recorded) {
    if (name == "crs") {
      input.open.reference_system = text;
    } else {
      words.insert(words.begin(), "--" + name + "=" + text);  // CLI11 takes the last one first
    }
  }
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorCode::kCorrupt, "isohf.json: source.options: " + why);
  };
  try {
    line.parse(words);
  } catch (const BadValue& bad) {
    refuse(bad.error.within(bad.option.substr(2)).what());
  } catch (const CLI::ExtrasError&) {
    refuse(line.remaining().front().substr(2) + ": is not an option of an input");
  } catch (const CLI::ParseError& error) {
    refuse(error.what());
  }
  if (input.geoid.path != file_name(input.geoid.path)) refuse("geoid: must be a name without a folder");
  return input;
}

OpenedInputs open_inputs(std::vector<std::string> files, const SourceInputs& inputs, const OpenOptions& options,
                         const WorkOptions& work) {
  OpenedInputs opened;
  opened.note.options = inputs.as_given;
  if (files.size() == 1) {
    opened.source = open_raster(files.front(), options);
  } else {
    MosaicPlan plan;
    Arena(Job{.threads = work.threads}).execute([&] { plan = plan_mosaic(files, options, inputs.box, inputs.onto); });
    opened.is_reprojected = plan.is_reprojected;
    opened.note.name = plan.info.path;
    describe_mosaic(plan, inputs.overlap, opened.note);
    opened.source = std::make_unique<MosaicSource>(opened.note.name, std::move(plan), options, inputs.overlap);
  }
  // Nodata is filled across the borders of files.
  opened.source = with_voids_treated(std::move(opened.source), options.voids, job_from(work));
  opened.files = std::move(files);
  if (inputs.box) {
    const BoundingBox& box = *inputs.box;
    opened.source = crop(std::move(opened.source), box);
    opened.note.fingerprint += fmt::format("{}bbox {} {} {} {}", opened.note.fingerprint.empty() ? "" : " ", box.west,
                                           box.south, box.east, box.north);
  }
  return opened;
}

std::unique_ptr<HeightSource> laid_out(std::unique_ptr<HeightSource> source, const GeoidRequest& geoid,
                                       const GroundRequest& ground, bool keeps_samples) {
  if (drops_repeated_column(source->info(), ground, keeps_samples))
    source = std::make_unique<ClosedSource>(std::move(source));
  if (!geoid.path.empty()) source = std::make_unique<GeoidSource>(std::move(source), geoid);
  return source;
}

}  // namespace isohf::cli
