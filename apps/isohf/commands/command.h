#pragma once

#include "program.h"

namespace isohf::cli {

/// The commands, as Command::add is.

Run add_convert(CLI::App& line, Common& common);
Run add_diff(CLI::App& line, Common& common);
Run add_export(CLI::App& line, Common& common);
Run add_extract(CLI::App& line, Common& common);
Run add_formats(CLI::App& line, Common& common);
Run add_info(CLI::App& line, Common& common);
Run add_merge(CLI::App& line, Common& common);
Run add_plan(CLI::App& line, Common& common);
Run add_sample(CLI::App& line, Common& common);
Run add_shade(CLI::App& line, Common& common);
Run add_verify(CLI::App& line, Common& common);

/// isohf, with all of them.
extern const Program kIsohf;

}  // namespace isohf::cli
