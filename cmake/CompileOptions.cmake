# One interface target that every target of ours links: warnings, sanitizers and the floating-point contract.
add_library(isohf_options INTERFACE)
target_compile_options(isohf_options INTERFACE
  -Wall -Wextra -Wconversion -Wshadow
  # Bytes become numbers by copying: no pointer is cast to a type of larger alignment.
  $<$<CXX_COMPILER_ID:GNU>:-Wcast-align=strict>
  # The same input gives the same bytes on every machine: a fused multiply-add in one build and not in another would
  # change the last bit of a resampled elevation.
  -ffp-contract=off
  # Loops over heights may assume neither errno nor traps; results stay IEEE.
  -fno-math-errno -fno-trapping-math)
if(ISOHF_WERROR)
  target_compile_options(isohf_options INTERFACE -Werror)
endif()
if(ISOHF_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "ISOHF_FUZZ needs clang: -DCMAKE_CXX_COMPILER=clang++-14")
  endif()
  # Every target counts the edges that it takes; only the fuzz targets have libFuzzer's main().
  target_compile_options(isohf_options INTERFACE -fsanitize=fuzzer-no-link)
  target_link_options(isohf_options INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(ISOHF_SANITIZE)
  # Left out are the checks that double compile time and that AddressSanitizer makes as well (a null pointer faults, so
  # does what a wild one points at), a warning does (-Wcast-align), or this code has no use for (no downcasts).
  target_compile_options(isohf_options INTERFACE -fsanitize=address,undefined
                         -fno-sanitize=null,object-size,vptr,alignment,pointer-overflow
                         -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
  target_link_options(isohf_options INTERFACE -fsanitize=address,undefined)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # What it says of optionals and regular expressions behind the sanitizers' checks is not so; the build without them
    # warns as before.
    target_compile_options(isohf_options INTERFACE -Wno-maybe-uninitialized)
  endif()
endif()
if(ISOHF_TSAN)
  # Where oneTBB is instrumented as well (scripts/dev/tsan): fences, which ThreadSanitizer does not follow, stand in its headers alone.
  target_compile_options(isohf_options INTERFACE -fsanitize=thread -fno-omit-frame-pointer $<$<CXX_COMPILER_ID:GNU>:-Wno-tsan>)
  target_link_options(isohf_options INTERFACE -fsanitize=thread)
endif()

# What stands behind a precompiled header: GCC 12 forgets which of its lines are the system's, so that its optimiser warns
# of the standard library's own inner calls, falsely. A build without them has these warnings on.
add_library(isohf_precompiled INTERFACE)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
  target_compile_options(isohf_precompiled INTERFACE -Wno-array-bounds -Wno-dangling-pointer -Wno-free-nonheap-object
                         -Wno-maybe-uninitialized -Wno-nonnull -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread
                         -Wno-use-after-free)
endif()

# isohf_compile(TARGET HEADER...): parses what most sources of the product include once for the target, and compiles the
# sources of each folder together: most of a compilation is templates that the next one makes again. A build with ccache
# (scripts/lib/build.sh) and the preset lean compile each source by itself, so that it includes what it uses and keeps all
# warnings. Two sources of a folder cannot have private names in common: that build fails.
function(isohf_compile target)
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:isohf_precompiled>)
  # What a program says of a broken invariant names the source in this tree, not a folder of the machine that built it.
  target_compile_options(${target} PRIVATE -fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=)
  target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <cstdint> <functional> <memory> <optional> <span>
                            <string> <utility> <vector> <fmt/format.h> ${ARGN})
  if(NOT CMAKE_CXX_COMPILER_LAUNCHER AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    # A private type of one source may have members of types that only it has.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
    get_target_property(sources ${target} SOURCES)
    foreach(source IN LISTS sources)
      cmake_path(GET source PARENT_PATH folder)
      string(MAKE_C_IDENTIFIER "room_${folder}" folder)
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${folder}")
    endforeach()
  endif()
endfunction()
