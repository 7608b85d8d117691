#pragma once

#include <string>

#include "isohf/base/memory/kept_rows.h"
#include "isohf/job.h"

namespace isohf {

/// Measured (docs/performance.md, decision 23): the program with its libraries and its pools of memory that was freed.
inline constexpr double kProgramBytes = 19.5e6;
inline constexpr double kThreadBytes = 0.7e6;
/// In each thread, of each vertex of a tile that is decoded.
inline constexpr double kDecodingBytesPerVertex = 60.0;

/// Gives memory that was freed back to the system, where it would be added to what comes next.
void give_back_freed_memory();

/// What a program that reads archives takes, whatever it does.
[[nodiscard]] double reading_bytes(const Job& job, double vertices_of_tile);

/// Throws Error{kOutOfMemory} if the job's bound does not allow `bytes`; `least` is enough. what  does:
/// "this conversion"   remedy: other than that
void require_memory(const Job& job, double bytes, double least, const std::string& what, const std::string& remedy);

/// Where rows are kept by what takes so many bytes with them in memory, or without. Throws Error{kOutOfMemory}.
[[nodiscard]] ScratchFolder scratch_for(const Job& job, double in_memory, double in_scratch, const std::string& what);

}  // namespace isohf
