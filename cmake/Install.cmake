# What `cmake --install` lays down: the programs, the reader module beside them, the library with its headers, and what
# CMake (find_package(isohf)) and pkg-config need to find it.
include(CMakePackageConfigHelpers)

install(TARGETS isohf isohf_formats EXPORT isohf ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(DIRECTORY libisohf/include/isohf DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
        FILES_MATCHING PATTERN "*.h")
install(TARGETS isohf_cli isohf_experiment RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
if(TARGET isohf_view)
  install(TARGETS isohf_view RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT programs)
endif()
# The reader module is installed where it is built: formats/CMakeLists.txt.

# Everything that `cmake --install` lays down, and no test: what scripts/quickstart builds.
add_custom_target(installed DEPENDS isohf isohf_formats isohf_cli isohf_experiment manual)
foreach(target IN ITEMS isohf_view isohf_oiio)
  if(TARGET ${target})
    add_dependencies(installed ${target})
  endif()
endforeach()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/isohf)
install(EXPORT isohf FILE isohfTargets.cmake NAMESPACE isohf:: DESTINATION ${package_dir} COMPONENT development)
set(module_dir lib/isohf)
configure_package_config_file(cmake/isohfConfig.cmake.in ${PROJECT_BINARY_DIR}/isohfConfig.cmake
                              INSTALL_DESTINATION ${package_dir} PATH_VARS module_dir NO_SET_AND_CHECK_MACRO)
# Before 1.0 every minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/isohfConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/isohfConfig.cmake ${PROJECT_BINARY_DIR}/isohfConfigVersion.cmake
        DESTINATION ${package_dir} COMPONENT development)

# Of where the file lies, whatever `cmake --install --prefix` says.
file(RELATIVE_PATH pc_to_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/isohf.pc.in ${PROJECT_BINARY_DIR}/isohf.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/isohf.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

install(DIRECTORY docs/schema DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs FILES_MATCHING PATTERN "*.json" PATTERN "README.md")
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development FILES_MATCHING PATTERN "*.cpp" PATTERN "*.py" PATTERN "CMakeLists.txt")
