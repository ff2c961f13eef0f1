# SPDX-License-Identifier: Apache-2.0
# Install rules: headers, core, test kit, package files. Programs and plugins are installed by their own folders.
# All of it can be moved as a whole.
include(CMakePackageConfigHelpers)

set(MHE_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/mhe)
set(MHE_PC_DIR ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/core/include/mhe DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
    FILES_MATCHING PATTERN *.h)
install(FILES ${PROJECT_BINARY_DIR}/core/include/mhe/version.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/mhe COMPONENT dev)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/NOTICE ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

# Examples that build where they lie, against the installed package; docs/plugins.md explains them.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/mhe COMPONENT dev)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN *.md PATTERN *.svg
    PATTERN study EXCLUDE)

# Two sets: plugins and applications need the headers, libmhe.so and the conformance program, and none of the libraries
# behind the core; who links the test kit statically needs those too.
install(TARGETS mhe_plugin mhe_library EXPORT mhePluginTargets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libmhe0 NAMELINK_COMPONENT dev)
if(MHE_PACKAGES)
    install(TARGETS mhe_library LIBRARY DESTINATION ${MHE_OWN_LIBRARY_DIR} NAMELINK_SKIP)
endif()
install(TARGETS mhe_base mhe_core EXPORT mheTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
if(TARGET mhe_testkit)
    install(TARGETS mhe_testkit EXPORT mheTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endif()
if(TARGET mhe_conformance)
    install(TARGETS mhe_conformance EXPORT mhePluginTargets RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT dev)
endif()
install(EXPORT mhePluginTargets NAMESPACE mhe:: DESTINATION ${MHE_CMAKE_DIR} COMPONENT dev)
install(EXPORT mheTargets NAMESPACE mhe:: DESTINATION ${MHE_CMAKE_DIR} COMPONENT dev)

configure_package_config_file(cmake/mheConfig.cmake.in ${PROJECT_BINARY_DIR}/mheConfig.cmake INSTALL_DESTINATION ${MHE_CMAKE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/mheConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/mheConfig.cmake ${PROJECT_BINARY_DIR}/mheConfigVersion.cmake
        cmake/MheAddPlugin.cmake cmake/MheConformance.cmake DESTINATION ${MHE_CMAKE_DIR} COMPONENT dev)

file(RELATIVE_PATH MHE_PREFIX_FROM_PC ${CMAKE_INSTALL_PREFIX}/${MHE_PC_DIR} ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" MHE_PREFIX_FROM_PC ${MHE_PREFIX_FROM_PC})
foreach(package IN ITEMS mhe mhe-plugin)
    configure_file(cmake/${package}.pc.in ${PROJECT_BINARY_DIR}/${package}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/${package}.pc DESTINATION ${MHE_PC_DIR} COMPONENT dev)
endforeach()
