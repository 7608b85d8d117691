#pragma once

#include <mutex>
#include <vector>

#include "isohf/projection.h"
#include "isohf/projection/crs/proj.h"

namespace isohf {

/// A coordinate operation of PROJ's between coordinates of a map (East before North) and longitudes and latitudes,
/// degrees from Greenwich. Any number of threads at once.
class ProjOperation {
 public:
  enum class Runs { kToGeo, kFromGeo };

  /// operation           is cloned
  /// runs                where it leads to
  /// degrees_per_unit    of its longitudes and latitudes
  /// prime_meridian_deg  where these are counted from, East of Greenwich
  ProjOperation(const PJ* operation, Runs runs, double degrees_per_unit = 1.0, double prime_meridian_deg = 0.0);

  /// longitude in [-180, 180]. NaN where the map shows no place.
  [[nodiscard]] GeoPoint geo_from_map(MapPoint place) const;
  /// NaN where the map has no place for it.
  [[nodiscard]] MapPoint map_from_geo(GeoPoint place) const;

  /// Finds the outline of maps like the sinusoidal one, beyond which the way back goes round the body again: from then
  /// on nothing is shown twice.
  void find_outline();

 private:
  /// PROJ's objects are for one thread at a time.
  struct Worker {
    proj::Context context;
    proj::Object operation;
  };

  [[nodiscard]] Worker take() const;
  void give_back(Worker worker) const;

  proj::Context context_;
  proj::Object original_;  ///< what workers are cloned from
  Runs runs_;
  double degrees_per_unit_;
  double prime_meridian_deg_;
  double most_apart_ = 0.0;  ///< how far what is there and back may lie apart, in units; 0: that is not asked
  mutable std::mutex mutex_;
  mutable std::vector<Worker> idle_;
};

}  // namespace isohf
