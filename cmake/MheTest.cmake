# SPDX-License-Identifier: Apache-2.0
# mhe_test(<name> LABEL <unit|abi|conformance|numeric|regress|install> SOURCES <files> [LIBRARIES <targets>])
#
# One cmocka executable, one process, one ctest entry. Exit status 77 is "skipped" (reference data absent). Tests see
# the build tree's plugins and never a user's.
find_package(cmocka QUIET)
if(NOT cmocka_FOUND)
    pkg_check_modules(CMOCKA REQUIRED IMPORTED_TARGET cmocka)
endif()
add_library(mhe_cmocka INTERFACE)
if(TARGET cmocka::cmocka)
    target_link_libraries(mhe_cmocka INTERFACE cmocka::cmocka)
elseif(TARGET PkgConfig::CMOCKA)
    target_link_libraries(mhe_cmocka INTERFACE PkgConfig::CMOCKA)
else()
    target_link_libraries(mhe_cmocka INTERFACE ${CMOCKA_LIBRARIES})
endif()

function(mhe_test_environment test)
    set_tests_properties(${test} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 ENVIRONMENT
        "MHE_PLUGIN_PATH=${MHE_PLUGIN_BUILD_DIR};OMP_NUM_THREADS=1;OPENBLAS_NUM_THREADS=1;ASAN_OPTIONS=detect_leaks=1;LSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/cmake/lsan.supp;TSAN_OPTIONS=suppressions=${CMAKE_SOURCE_DIR}/cmake/tsan.supp")
endfunction()

function(mhe_test name)
    if(NOT MHE_BUILD_TESTS)
        return()
    endif()
    cmake_parse_arguments(arg "" "LABEL" "SOURCES;LIBRARIES" ${ARGN})
    add_executable(test_${name} ${arg_SOURCES})
    target_link_libraries(test_${name} PRIVATE ${arg_LIBRARIES} mhe_test_support mhe_core mhe_flags)
    target_compile_definitions(test_${name} PRIVATE
        MHE_TEST_SOURCE_DIR="${CMAKE_SOURCE_DIR}" MHE_TEST_BINARY_DIR="${CMAKE_BINARY_DIR}"
        MHE_TEST_PLUGIN_DIR="${MHE_PLUGIN_BUILD_DIR}")
    set_target_properties(test_${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
    add_test(NAME ${name} COMMAND test_${name})
    set_tests_properties(${name} PROPERTIES LABELS ${arg_LABEL})
    mhe_test_environment(${name})
endfunction()

# mhe_plugin_test(<name> LABEL <label> SOURCES <files> [LIBRARIES <targets>] [PLUGINS <targets>]): called in a plugin's folder,
# whose tests lie in tests/. They load the plugin through the registry and never link it; a part that needs nothing of
# the rest is compiled into its test.
function(mhe_plugin_test name)
    if(NOT MHE_BUILD_TESTS)
        return()
    endif()
    cmake_parse_arguments(arg "" "" "PLUGINS" ${ARGN})
    if(NOT arg_PLUGINS)
        get_filename_component(folder ${CMAKE_CURRENT_SOURCE_DIR} NAME)
        set(arg_PLUGINS mhe_${folder})
    endif()
    mhe_test(${name} ${arg_UNPARSED_ARGUMENTS})
    target_include_directories(test_${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
    add_dependencies(test_${name} ${arg_PLUGINS})
endfunction()

# mhe_public_test(<name> SOURCES <files>): the same against libmhe.so and the public headers alone, as an application
# would be built.
function(mhe_public_test name)
    if(NOT MHE_BUILD_TESTS)
        return()
    endif()
    cmake_parse_arguments(arg "" "" "SOURCES" ${ARGN})
    add_executable(test_${name} ${arg_SOURCES})
    target_link_libraries(test_${name} PRIVATE mhe::core mhe_flags mhe_cmocka m)
    target_compile_definitions(test_${name} PRIVATE
        MHE_TEST_SOURCE_DIR="${CMAKE_SOURCE_DIR}" MHE_TEST_BINARY_DIR="${CMAKE_BINARY_DIR}")
    set_target_properties(test_${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
    add_test(NAME ${name} COMMAND test_${name})
    set_tests_properties(${name} PROPERTIES LABELS unit)
    mhe_test_environment(${name})
endfunction()

include(MheConformance)
