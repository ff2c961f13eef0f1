# SPDX-License-Identifier: Apache-2.0
# Debian packages: cmake --preset package && cmake --build --preset package && cpack --preset package
#   myohorizon (programs, plugins, models; needs none of the others)  python3-myohorizon  octave-myohorizon
#   libmhe0 (the library for other programs)  libmhe-dev
# What an install rule does not name goes to myohorizon.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME myohorizon)
set(CPACK_PACKAGE_CONTACT "The Myohorizon authors <maintainers@myohorizon.invalid>")
# CPack puts a summary of the whole before each package's own, but not this one, its default.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${CMAKE_PROJECT_NAME} built using CMake")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_BINARY_DIR}/lib)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/packaging/prepare.cmake)
set(CPACK_MHE_SOURCE_DIR ${PROJECT_SOURCE_DIR})
set(CPACK_COMPONENTS_ALL libmhe0 dev myohorizon)

# mhe_package(<component> <package> <section> DEPENDS <text> SUMMARY <text> TEXT <text> [MORE <key> <value>...])
function(mhe_package component package section)
    cmake_parse_arguments(arg "" "DEPENDS;SUMMARY;TEXT" "MORE" ${ARGN})
    string(TOUPPER ${component} up)
    set(CPACK_DEBIAN_${up}_PACKAGE_NAME ${package} PARENT_SCOPE)
    set(CPACK_DEBIAN_${up}_PACKAGE_SECTION ${section} PARENT_SCOPE)
    set(CPACK_DEBIAN_${up}_PACKAGE_DEPENDS "${arg_DEPENDS}" PARENT_SCOPE)
    set(CPACK_DEBIAN_${up}_DESCRIPTION "${arg_SUMMARY}\n${arg_TEXT}" PARENT_SCOPE)
    while(arg_MORE)
        list(POP_FRONT arg_MORE key value)
        string(REPLACE "|" ";" value "${value}") # several values, which a list of arguments would take apart
        set(CPACK_DEBIAN_${up}_${key} "${value}" PARENT_SCOPE)
    endwhile()
endfunction()

set(same "(= ${PROJECT_VERSION}-1)")
set(about "Joint angles, muscle activations and muscle forces from markers and EMG,\nframe by frame, with a musculoskeletal model (OpenSim, biorbd).\n")
mhe_package(libmhe0 libmhe0 libs DEPENDS ""
    SUMMARY "moving horizon estimation of muscle forces (library)"
    TEXT "${about}This package has the library for programs that embed it. Its plugins are in\nthe package myohorizon."
    MORE PACKAGE_RECOMMENDS "myohorizon ${same}"
         PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/packaging/libmhe0/triggers|${PROJECT_BINARY_DIR}/packaging/shlibs")
# While the major version is 0, programs need the minor version that they were built with.
math(EXPR next_minor "${PROJECT_VERSION_MINOR} + 1")
file(WRITE ${PROJECT_BINARY_DIR}/packaging/shlibs
    "libmhe ${PROJECT_VERSION_MAJOR} libmhe0 (>= ${PROJECT_VERSION}), libmhe0 (<< ${PROJECT_VERSION_MAJOR}.${next_minor}~)\n")
mhe_package(dev libmhe-dev libdevel DEPENDS "libmhe0 ${same}"
    SUMMARY "moving horizon estimation of muscle forces (development)"
    TEXT "${about}This package has headers, CMake and pkg-config files, the conformance checks\nfor plugins, and examples of plugins and of an embedding program.")
mhe_package(myohorizon myohorizon science DEPENDS ""
    SUMMARY "muscle forces from markers and EMG by moving horizon estimation"
    TEXT "${about}This package has the programs (mhe-run, mhe-live, mhe-model, mhe-calibrate,\nmhe-sim, mhe-study, mhe-bench), all plugins, models with demonstrations,\ndocumentation."
    MORE PACKAGE_RECOMMENDS "gnuplot-nox"
         PACKAGE_SUGGESTS "python3-myohorizon, python3-pandas, python3-statsmodels, python3-matplotlib")
if(TARGET mhe_python)
    list(APPEND CPACK_COMPONENTS_ALL python)
    mhe_package(python python3-myohorizon python
        DEPENDS "python3, python3-numpy, python3-cffi-backend (>= 1.15), myohorizon ${same}"
        SUMMARY "moving horizon estimation of muscle forces (Python)"
        TEXT "${about}This package has the module myohorizon for Python 3."
        MORE PACKAGE_ARCHITECTURE all PACKAGE_SHLIBDEPS OFF PACKAGE_RECOMMENDS "python3-pandas"
             PACKAGE_SUGGESTS "python3-xarray"
             PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/packaging/python/postinst|${PROJECT_SOURCE_DIR}/packaging/python/prerm")
endif()
if(TARGET mhe_octave)
    list(APPEND CPACK_COMPONENTS_ALL octave)
    list(APPEND CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${MHE_OCTAVE_LIBRARY_DIR})
    mhe_package(octave octave-myohorizon math
        DEPENDS "${MHE_OCTAVE_ABI}, myohorizon ${same}"
        SUMMARY "moving horizon estimation of muscle forces (Octave)"
        TEXT "${about}This package has the package +myohorizon for GNU Octave.")
endif()
include(CPack)
