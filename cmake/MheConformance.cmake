# SPDX-License-Identifier: Apache-2.0
# mhe_conformance_test(<target> <kind>)
#
# Registers the conformance checks of a plugin's target as the test conformance_<target>. Works inside this tree and,
# after find_package(mhe CONFIG), outside it; mhe_add_plugin() calls it.
function(mhe_conformance_test target kind)
    if(DEFINED MHE_BUILD_TESTS AND NOT MHE_BUILD_TESTS)
        return()
    endif()
    add_test(NAME conformance_${target} COMMAND $<TARGET_FILE:mhe::conformance> $<TARGET_FILE:${target}>)
    set_tests_properties(conformance_${target} PROPERTIES LABELS "conformance;${kind}" SKIP_RETURN_CODE 77 TIMEOUT 600)
    if(COMMAND mhe_test_environment)
        mhe_test_environment(conformance_${target})
    endif()
endfunction()
