#include "formats/georeference/complete_system.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "isohf/base/handed_in.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/projection/crs/source_system.h"

namespace isohf {
namespace {

/// The system of a file; null where it names none, or PROJ does not understand it.
std::shared_ptr<const Crs> understood_if(const std::string& text) {
  try {
    return text.empty() ? nullptr : Crs::parse(text);
  } catch (const Error&) {
    return nullptr;
  }
}

/// Whether the coordinates of a file, in the system or unit that it names, can be those of `theirs` as well.
bool may_lie_in(const Georeference& own, const Georeference& theirs, const Crs& understood) {
  if (own.unit != HorizontalUnit::kUnknown && own.unit != theirs.unit) return false;
  const std::string said = system_text(own.system);
  if (said == system_text(theirs.system)) return true;
  if (const auto system = understood_if(said)) return understood.may_be(*system);
  constexpr double kSameUnit = 1e-5;  // feet of either kind go by one name
  constexpr double kSameRadius = 1e-6;
  const auto apart = [](double a, double b) { return std::abs(a / b - 1.0); };
  if (own.unit == HorizontalUnit::kMetre && apart(own.metres_per_unit, theirs.metres_per_unit) > kSameUnit)
    return false;
  return !own.system.semi_major_axis_m ||
         apart(*own.system.semi_major_axis_m, theirs.system.semi_major_axis_m.value_or(1.0)) < kSameRadius;
}

/// Whether heights of one system are above something else than those of the other. Names differ from format to format:
/// "EGM96", "EGM96 height", "NAVD88 height (ftUS)"; those that are no name of a surface contradict nothing.
bool have_other_heights(const ReferenceSystem& own, const ReferenceSystem& theirs) {
  const auto surface = [](const std::string& name) {
    const std::string word = lower_case(name.substr(0, name.find(' ')));
    for (const char* const known : {"egm84", "egm96", "egm2008", "navd88", "the"}) {
      if (word == known) return word;
    }
    return std::string();
  };
  const std::string ours = surface(own.vertical_datum);
  const std::string other = surface(theirs.vertical_datum);
  if (!ours.empty() && ours == other) return false;
  if (own.vertical_epsg && theirs.vertical_epsg) return *own.vertical_epsg != *theirs.vertical_epsg;
  const bool is_one_ellipsoidal = own.vertical_datum == kAboveEllipsoid || theirs.vertical_datum == kAboveEllipsoid;
  return !own.vertical_datum.empty() && (is_one_ellipsoidal || (!ours.empty() && !other.empty()));
}

/// Whether a file's words for a system say as much as the user's.
bool keeps_words(const ReferenceSystem& own, const ReferenceSystem& theirs) {
  if (!own.epsg && theirs.epsg) return false;
  const auto system = own.epsg == theirs.epsg ? nullptr : understood_if(system_text(own));
  return !system || system->description().is_datum_known;
}

/// Degrees that none are: what the file says is no system of its coordinates.
bool is_impossible(const SourceInfo& info) {
  if (info.georeference.unit != HorizontalUnit::kDegree) return false;
  try {
    require_source(info);
    return false;
  } catch (const Error&) {
    return true;
  }
}

}  // namespace

void complete_system(const std::string& text, SourceInfo& info) {
  const auto understood = Crs::parse(text);
  SourceInfo there = info;
  take_system(text, there);
  const Georeference& own = info.georeference;
  Georeference& theirs = there.georeference;
  const std::string said = system_text(own.system);
  const bool is_wrong = is_impossible(info);
  const std::string given = shown_name({}, text);
  const std::string word = given.find_first_of(" \"") == std::string::npos ? given : "'" + given + "'";
  const std::string way_out = "if the file is wrong, correct a copy with gdal_translate -a_srs " + word;
  if (!is_wrong && !may_lie_in(own, theirs, *understood)) {
    const bool can_project =
        theirs.unit == HorizontalUnit::kMetre && (!said.empty() || own.unit == HorizontalUnit::kDegree);
    const std::string project =
        can_project ? fmt::format("`projection` {} projects it; ", theirs.system.epsg ? name_of(theirs) : word) : "";
    throw Error(ErrorCode::kInvalidArgument,
                {"", fmt::format("is in {}, which `reference_system` {} contradicts", name_of(own), given), "",
                 project + way_out});
  }
  const std::string& heights = understood->description().vertical_name;
  if (!heights.empty() && have_other_heights(own.system, theirs.system)) {
    throw Error(ErrorCode::kInvalidArgument,
                {"",
                 fmt::format("has heights above {}, which `reference_system` contradicts with {}",
                             own.system.vertical_datum, heights),
                 "", "name the system without heights; " + way_out});
  }
  // The same system: in the file's words, unless these lack its datum or code. Coordinates may be in a unit of their own.
  if (!said.empty() && !is_wrong) {
    theirs.metres_per_unit = own.metres_per_unit;
    if (keeps_words(own.system, theirs.system)) {
      ReferenceSystem system = own.system;
      system.vertical_datum = theirs.system.vertical_datum;
      system.vertical_epsg = theirs.system.vertical_epsg;
      theirs.system = std::move(system);
    }
  }
  info = std::move(there);
}

}  // namespace isohf
