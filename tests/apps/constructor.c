/* SPDX-License-Identifier: Apache-2.0 */
/* constructor.c: a library that runs code as soon as it is loaded, as any can. */
#include <unistd.h>

__attribute__((constructor)) static void run(void) {
    static const char text[] = "CODE OF THE CONFIG RUNS\n";
    (void)!write(STDOUT_FILENO, text, sizeof text - 1);
}
