# SPDX-License-Identifier: Apache-2.0
# mhe_add_plugin(<name> KIND <kind> SOURCES <files> [LIBRARIES <targets>] [DEFINITIONS <defs>])
#
# Builds one plugin as a loadable module that exports mhe_plugin_entry alone, installs it, and registers its
# conformance test. Works inside this tree and, after find_package(mhe CONFIG), outside it.
function(mhe_add_plugin name)
    cmake_parse_arguments(arg "" "KIND" "SOURCES;LIBRARIES;DEFINITIONS" ${ARGN})
    if(NOT arg_KIND OR NOT arg_SOURCES)
        message(FATAL_ERROR "mhe_add_plugin(${name}): KIND and SOURCES are needed")
    endif()
    set(target mhe_${name})
    add_library(${target} MODULE ${arg_SOURCES})
    target_link_libraries(${target} PRIVATE mhe::plugin ${arg_LIBRARIES})
    target_compile_definitions(${target} PRIVATE ${arg_DEFINITIONS})
    set_target_properties(${target} PROPERTIES
        PREFIX "" C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden
        VISIBILITY_INLINES_HIDDEN ON POSITION_INDEPENDENT_CODE ON)
    target_compile_features(${target} PRIVATE c_std_11)
    target_compile_options(${target} PRIVATE $<$<CONFIG:>:-O2>) # no build type was chosen: a plugin is never meant to be slow
    if(TARGET mhe_flags)
        target_link_libraries(${target} PRIVATE mhe_flags)
        set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${MHE_PLUGIN_BUILD_DIR})
        set_property(GLOBAL APPEND PROPERTY MHE_PLUGINS_BUILT ${name})
    endif()
    # A sanitizer's run-time symbols live in the executable, so an instrumented module cannot be link-checked.
    if(NOT MHE_SANITIZE AND NOT MHE_FUZZ)
        target_link_options(${target} PRIVATE -Wl,-z,defs)
    endif()
    install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/${MHE_PLUGIN_ABI_DIR})
    if(COMMAND mhe_conformance_test)
        mhe_conformance_test(${target} ${arg_KIND})
    endif()
endfunction()
