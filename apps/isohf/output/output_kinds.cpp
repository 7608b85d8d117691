#include "output/output_kinds.h"

#include "formats/io/text.h"
#include "formats/registry.h"
#include "formats/write/encoders.h"
#include "formats/write/raster_sink.h"
#include "isohf/archive/writer.h"
#include "isohf/base/output_file.h"
#include "isohf/error.h"
#include "output/output_file.h"

namespace isohf::cli {
namespace {

[[noreturn]] void refuse(const std::string& output, const std::string& kind, const std::string& remedy) {
  throw Error(ErrorCode::kInvalidArgument, {output, "exists and is " + kind, "", remedy});
}

template <typename Look>
auto named(const std::string& output, Look look) {
  try {
    return look();
  } catch (const Error& error) {
    throw error.within(output);
  }
}

/// What a file is that somebody was about to lose.
std::string kind_of(const std::string& path) {
  const Format* found = nullptr;
  try {
    found = native_format_of(path, {});
  } catch (const Error&) {
    // What cannot be looked into is told to be nothing of ours.
  }
  return found != nullptr ? std::string("a raster (") + found->name + ")" : "no isohf archive";
}

}  // namespace

bool is_archive_name(const std::string& name) {
  return lower_case(name).ends_with(".isohf");
}

void check_archive_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite) {
  const std::string place = check_output_place(inputs, output);
  if (named(output, [&] { return !head_of_file(place, 1).empty() && !is_archive_file(place); })) {
    refuse(output, kind_of(place), "an archive replaces only archives, choose another name");
  }
  check_output_file(inputs, output, overwrite);
}

void check_raster_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite) {
  std::vector<std::string> also_written;
  for (const std::string& sidecar : sidecar_paths(output)) {
    also_written.push_back(sidecar);
    also_written.push_back(sidecar + ".part");
  }
  static_cast<void>(check_output_place(inputs, output, std::move(also_written)));
  check_raster_target(output, overwrite);
}

}  // namespace isohf::cli
