#include "output/output_kinds.h"

#include "formats/mesh/create_mesh.h"
#include "formats/registry.h"
#include "formats/write/encoders.h"
#include "formats/write/raster_sink.h"
#include "isohf/archive/writer.h"
#include "isohf/base/output_file.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "output/output_file.h"

namespace isohf::cli {
namespace {

/// What kind of file would be lost.
std::string kind_of(const std::string& path) {
  const Format* found = nullptr;
  try {
    found = native_format_of(path, {});
  } catch (const Error&) {  // not a file of ours
  }
  return found != nullptr ? std::string("a raster (") + found->name + ")" : "no isohf archive";
}

}  // namespace

bool is_archive_name(const std::string& name) {
  return lower_case(name).ends_with(".isohf");
}

void check_archive_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite) {
  check_output_file(inputs, output, overwrite, [&](const std::string& place) {
    if (head_of_file(place, 1).empty() || is_archive_file(place)) return;
    throw Error(ErrorCode::kInvalidArgument,
                {"", "exists and is " + kind_of(place), "", "an archive replaces only archives, choose another name"});
  });
}

void check_raster_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite) {
  std::vector<std::string> also_written;
  for (const std::string& sidecar : sidecar_paths(output)) {
    also_written.push_back(sidecar);
    also_written.push_back(sidecar + ".part");
  }
  check_output_file(inputs, output, true, {}, std::move(also_written));
  check_raster_target(output, overwrite);
}

void check_mesh_output(const std::vector<std::string>& inputs, const std::string& output, bool overwrite) {
  check_output_file(inputs, output, overwrite, [&](const std::string& place) {
    const std::vector<std::byte> head = head_of_file(place, 4);
    const std::string_view begins(reinterpret_cast<const char*>(head.data()), head.size());
    if (begins.empty() || begins_as_mesh(output, begins)) return;
    throw Error(ErrorCode::kInvalidArgument, {"", "exists and is " + kind_of(place), "",
                                              "a mesh replaces only meshes of its format, choose another name"});
  });
}

}  // namespace isohf::cli
