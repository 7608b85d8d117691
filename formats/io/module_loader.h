#pragma once

#include <cstdint>
#include <string>

namespace isohf {

/// A module: a library of ours that is loaded only when it is needed, because of what it brings with it.
struct ModuleFile {
  const char* file;    ///< "isohf_oiio.so"
  const char* symbol;  ///< of the function that gives its table, whose first member is its version
  std::int32_t abi;    ///< the version of the table that is understood
  const char* needed;  ///< "other formats need the OpenImageIO module"
  const char* option;  ///< of CMake, that builds it
};

/// The module's table; it stays loaded until the program ends. Looked for in the folder that set_module_folder named,
/// beside the running program, and in ../lib/isohf seen from there.
/// Throws Error{kUnsupported} where there is none, or it is another version's.
[[nodiscard]] const void* load_module(const ModuleFile& module);

/// The path of a file of ours that is looked for as modules are; empty where there is none.
[[nodiscard]] std::string find_beside_program(const std::string& file);

}  // namespace isohf
