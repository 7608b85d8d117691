#pragma once

#include <string>

#include "experiment.h"
#include "isohf/lattice.h"

/// The paper's figures from an experiment, as the text of CSV and SVG files. CSV: a heading line, then commas; numbers
/// in the shortest form that reads back to the same value.

namespace isohf::experiment {

/// Every trial.
[[nodiscard]] std::string trials_csv(const ExperimentResult& result);

/// Fig. 2: errors against triangle count, averaged over orientations and frequencies.
[[nodiscard]] std::string figure2_csv(const ExperimentResult& result);
[[nodiscard]] std::string figure2_svg(const ExperimentResult& result);

/// What Fig. 3 is drawn for: the triangle count nearest to 5000 and the frequency nearest to 0.9 that was measured.
struct Figure3Case {
  std::int64_t triangles;
  double frequency;
};
[[nodiscard]] Figure3Case figure3_case(const ExperimentResult& result);
/// Fig. 3: mean elevation error against orientation.
[[nodiscard]] std::string figure3_csv(const ExperimentResult& result);
[[nodiscard]] std::string figure3_svg(const ExperimentResult& result);

/// Share of the orientations of one triangle count and frequency at which iso's mean elevation error is below the other
/// mesh's: 1 is the paper's "strictly lower".
[[nodiscard]] double share_of_lower_orientations(const ExperimentResult& result, MeshKind other, std::int64_t triangles,
                                                 double frequency);

/// Shading errors by vertex normals under lights that stand still, against the light's azimuth: the means over all
/// frequencies and orientations of the triangle count nearest to 5000.
[[nodiscard]] std::string azimuth_csv(const ExperimentResult& result);
[[nodiscard]] std::string azimuth_svg(const ExperimentResult& result);

/// Fig. 8: triangles of strip and stitch at every level of a tile; the paper's is 2564x3075 with 10 levels.
[[nodiscard]] std::string figure8_csv(const TileShape& shape);
[[nodiscard]] std::string figure8_svg(const TileShape& shape);

}  // namespace isohf::experiment
