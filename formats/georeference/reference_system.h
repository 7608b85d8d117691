#pragma once

#include <memory>
#include <optional>
#include <string>

#include "isohf/projection/reference_map.h"
#include "isohf/raster.h"

namespace isohf {

/// A reference system as PROJ understands it.
class UnderstoodSystem : public ReferenceMap {
 public:
  struct Description {
    std::string name;  ///< of the horizontal part
    std::string authority;
    std::string code;  ///< "EPSG" and "32632"; empty where the text gives none
    std::string datum;
    bool is_projected = false;
    bool is_compound = false;  ///< heights belong to it
    double unit = 1.0;         ///< of the system's axes: metres, or degrees where it is not projected
    std::string wkt2;          ///< of all of it (ISO 19162:2019)
    Ellipsoid ellipsoid;
  };
  [[nodiscard]] virtual const Description& description() const = 0;
};

/// Understands "EPSG:2154", WKT of any version and dialect, PROJ strings and PROJJSON, by the module isohf_proj.so,
/// which is loaded at the first call. Coordinates are the system's own, East before North. metres_per_unit  of the
/// coordinates that are asked for; nullopt: as the system has it Throws Error{kUnsupported}, in one line, where the
/// module or PROJ's database is missing, or PROJ does not understand the text.
[[nodiscard]] std::shared_ptr<const UnderstoodSystem> understand_system(
    const std::string& text, std::optional<double> metres_per_unit = std::nullopt);

/// The same where coordinates and places are all that is wanted: PROJ is left alone where utm_map() knows the system.
[[nodiscard]] std::shared_ptr<const ReferenceMap> understand_map(const std::string& text,
                                                                 std::optional<double> metres_per_unit);

/// What names the system to PROJ: "EPSG:n", or the WKT; empty where a file has neither.
[[nodiscard]] std::string system_text(const ReferenceSystem& system);

}  // namespace isohf
