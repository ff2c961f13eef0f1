# SPDX-License-Identifier: Apache-2.0
# Run by cpack before it packs: what Debian wants to lie in every package, and compressed.
file(STRINGS ${CPACK_MHE_SOURCE_DIR}/CHANGELOG.md releases REGEX "^## ${CPACK_PACKAGE_VERSION}, ")
string(REGEX REPLACE ".*, " "" date "${releases}")
execute_process(COMMAND date --utc --rfc-email --date=${date} OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)

foreach(component IN LISTS CPACK_COMPONENTS_ALL)
    string(TOUPPER ${component} up)
    set(package ${CPACK_DEBIAN_${up}_PACKAGE_NAME})
    set(root ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/${component})
    set(doc ${root}/usr/share/doc/${package})
    file(MAKE_DIRECTORY ${doc})
    configure_file(${CPACK_MHE_SOURCE_DIR}/packaging/copyright ${doc}/copyright COPYONLY)
    file(WRITE ${doc}/changelog.Debian "${package} (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium

  * Release ${CPACK_PACKAGE_VERSION}; see CHANGELOG.md of the package myohorizon.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
    file(GLOB long ${root}/usr/share/man/man*/* ${doc}/changelog.Debian)
    if(long)
        execute_process(COMMAND gzip -9 -n -f ${long} COMMAND_ERROR_IS_FATAL ANY)
    endif()
    execute_process(COMMAND chmod -R u=rwX,go=rX ${root} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
