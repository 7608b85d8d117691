#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "support/run_program.h"

/// What GDAL's programs say of a file, and whether isohf says the same. GDAL is a test tool here; nothing links it.
namespace isohf::test {

/// Whether they are installed (Debian: gdal-bin).
bool has_gdal();

/// Runs one of GDAL's programs, with nothing kept in or taken from files of its own (.aux.xml) unless `with_aux`. ASCII
/// grids are read as float64, which holds the numbers as written; GDAL would round them to float32.
RunResult run_gdal(std::vector<std::string> command, const std::string& input = {}, bool with_aux = false);

/// Expects the first sample and the spacing of `isohf info --json` where those of `gdalinfo -json` are.
void expect_same_place(const nlohmann::json& ours, const nlohmann::json& gdal);

/// Expects the same numbers at fifty random places; `turned`: GDAL's first row is the southernmost.
void expect_same_samples(const std::string& file, bool turned);

}  // namespace isohf::test
