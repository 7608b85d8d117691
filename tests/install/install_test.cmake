# cmake -DBINARY_DIR=... -DSOURCE_DIR=... -DWORK_DIR=... -DLIBDIR=... -DCXX=... -DRASTER=... -P install_test.cmake
# Installs into a folder of its own, then builds and runs the examples on it, by CMake and by pkg-config.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    string(JOIN " " command ${ARGV})
    message(FATAL_ERROR "${command}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
set(prefix ${WORK_DIR}/prefix)
run(${CMAKE_COMMAND} --install ${BINARY_DIR} --prefix ${prefix})

# Private headers stay at home.
file(GLOB folders LIST_DIRECTORIES true ${prefix}/include/* ${prefix}/include/isohf/*)
foreach(path IN LISTS folders)
  if(IS_DIRECTORY ${path} AND NOT path STREQUAL ${prefix}/include/isohf)
    message(FATAL_ERROR "${path} is installed")
  endif()
endforeach()

run(${SOURCE_DIR}/manual_test.sh ${prefix})

# As someone else's project, who has but the package.
file(WRITE ${WORK_DIR}/says/CMakeLists.txt
     "cmake_minimum_required(VERSION 3.25)\nproject(says CXX)\nfind_package(isohf REQUIRED)\n"
     "file(WRITE ${WORK_DIR}/module_folder.txt \${isohf_MODULE_FOLDER})\n")
run(${CMAKE_COMMAND} -S ${WORK_DIR}/says -B ${WORK_DIR}/says -DCMAKE_PREFIX_PATH=${prefix})
# As they are installed, with nothing else of the tree beside them.
file(COPY ${prefix}/share/doc/isohf/examples DESTINATION ${WORK_DIR})
run(${CMAKE_COMMAND} -S ${WORK_DIR}/examples -B ${WORK_DIR}/build -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_CXX_COMPILER=${CXX})
run(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
run(${CMAKE_CTEST_COMMAND} --test-dir ${WORK_DIR}/build --output-on-failure)

set(ENV{PKG_CONFIG_PATH} ${prefix}/${LIBDIR}/pkgconfig)
# Both say where the modules lie.
file(STRINGS ${WORK_DIR}/module_folder.txt module_folder)
execute_process(COMMAND pkg-config --variable=moduledir isohf OUTPUT_VARIABLE moduledir
                COMMAND_ERROR_IS_FATAL ANY OUTPUT_STRIP_TRAILING_WHITESPACE)
file(REAL_PATH "${moduledir}" moduledir)
file(REAL_PATH ${prefix}/lib/isohf expected)
foreach(said IN ITEMS "${module_folder}" "${moduledir}")
  if(NOT said STREQUAL expected)
    message(FATAL_ERROR "modules are said to be in ${said}, they are in ${expected}")
  endif()
endforeach()

execute_process(COMMAND pkg-config --cflags --libs isohf OUTPUT_VARIABLE flags
                COMMAND_ERROR_IS_FATAL ANY OUTPUT_STRIP_TRAILING_WHITESPACE)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${CXX} ${prefix}/share/doc/isohf/examples/convert.cpp -o ${WORK_DIR}/by_pkg_config ${flags})
run(${WORK_DIR}/by_pkg_config ${RASTER} ${WORK_DIR}/by_pkg_config.isohf)

file(REMOVE_RECURSE ${WORK_DIR})
