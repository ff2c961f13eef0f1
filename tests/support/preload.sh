# SPDX-License-Identifier: Apache-2.0
# For scripts that start an interpreter which loads our library: under the address sanitizer (MHE_SANITIZE, MHE_C_COMPILER) its run
# time has to be there before the interpreter. What that itself leaks is not ours; what it allocates is watched as well.
case ${MHE_SANITIZE:-} in
*address*)
    LD_PRELOAD=$("$MHE_C_COMPILER" -print-file-name=libasan.so):$("$MHE_C_COMPILER" -print-file-name=libubsan.so)
    export LD_PRELOAD PYTHONMALLOC=malloc
    export ASAN_OPTIONS=detect_leaks=0
    ;;
esac
