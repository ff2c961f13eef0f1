# SPDX-License-Identifier: Apache-2.0
# Options of the build and the flags of our own targets.
option(MHE_BUILD_TESTS "Build the tests" ON)
option(MHE_WERROR "Warnings are errors (presets dev and sanitizers)" OFF)
option(MHE_FUZZ "Build the fuzz targets (clang with libFuzzer)" OFF)
set(MHE_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize= (address,undefined or thread)")

set(MHE_PLUGIN_ABI_DIR mhe/plugins/abi0)
# Debian's packages: the programs' own package needs no other, so it has the library beside its plugins, and libmhe0 the
# one that other programs link with.
option(MHE_PACKAGES "Programs, Python and Octave use a libmhe.so of their own, LIBDIR/mhe, besides the one in LIBDIR" OFF)
set(MHE_OWN_LIBRARY_DIR ${CMAKE_INSTALL_LIBDIR})
if(MHE_PACKAGES)
    set(MHE_OWN_LIBRARY_DIR ${CMAKE_INSTALL_LIBDIR}/mhe)
endif()
set(MHE_PLUGIN_BUILD_DIR ${CMAKE_BINARY_DIR}/plugins)

# mhe_finds_library(<target> <folder>): installed in the folder, it finds libmhe.so, wherever the whole was moved to.
function(mhe_finds_library target folder)
    file(RELATIVE_PATH there ${CMAKE_INSTALL_PREFIX}/${folder} ${CMAKE_INSTALL_PREFIX}/${MHE_OWN_LIBRARY_DIR})
    set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/${there}")
endfunction()

# Flags of everything compiled here; interface only, never installed.
add_library(mhe_flags INTERFACE)
target_compile_definitions(mhe_flags INTERFACE _POSIX_C_SOURCE=200809L)
target_compile_options(mhe_flags INTERFACE
    -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wvla
    $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes>
    $<$<BOOL:${MHE_WERROR}>:-Werror>)
if(MHE_SANITIZE)
    target_compile_options(mhe_flags INTERFACE -fsanitize=${MHE_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(mhe_flags INTERFACE -fsanitize=${MHE_SANITIZE})
    if(MHE_SANITIZE MATCHES "undefined")
        target_compile_options(mhe_flags INTERFACE -fno-sanitize-recover=undefined)
    endif()
endif()
if(MHE_FUZZ)
    target_compile_options(mhe_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()

find_package(PkgConfig REQUIRED)
pkg_check_modules(CJSON REQUIRED IMPORTED_TARGET libcjson) # of the programs mhe-bench and mhe-study, and of tests

set_property(GLOBAL PROPERTY MHE_PLUGINS_BUILT "")
set_property(GLOBAL PROPERTY MHE_PLUGINS_SKIPPED "")

function(mhe_print_summary)
    get_property(built GLOBAL PROPERTY MHE_PLUGINS_BUILT)
    get_property(skipped GLOBAL PROPERTY MHE_PLUGINS_SKIPPED)
    message(STATUS "mhe ${PROJECT_VERSION}, ${CMAKE_BUILD_TYPE}")
    message(STATUS "  plugins: ${built}")
    foreach(line IN LISTS skipped)
        message(STATUS "  skipped: ${line}")
    endforeach()
endfunction()
