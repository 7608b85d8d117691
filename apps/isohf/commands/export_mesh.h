#pragma once

#include <optional>
#include <string>

#include "input/box_ground.h"
#include "isohf/mesh.h"
#include "options/work_options.h"
#include "program.h"

namespace isohf::cli {

/// isohf export into a mesh.
struct ExportMeshOptions {
  std::string archive{};
  std::string output{};
  bool overwrite = false;
  std::optional<BoundingBox> bbox{};  ///< tiles that touch it
  double exaggeration = 1.0;
  MeshRequest mesh{};
};

int export_mesh(const ExportMeshOptions& options, const Common& common, const WorkOptions& work);

}  // namespace isohf::cli
