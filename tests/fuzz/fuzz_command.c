/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_command.c: any bytes as lines of the line protocol of a live run. */
#include "fuzz.h"
#include "live/live_private.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char *line = malloc(size + 1);
    memcpy(line, data, size);
    line[size] = '\0';
    for (char *at = line; at != NULL;) {
        char *end = strchr(at, '\n');
        mhi_live_request request;
        mhe_error err = {0};
        if (end != NULL) {
            *end = '\0';
        }
        const mhe_status status = mhi_live_parse(at, &request, &err);
        if (status != MHE_OK && err.text[0] == '\0') {
            abort(); /* refused without a reason */
        }
        if (status == MHE_OK) {
            if (request.what < MHE_CONTROL_STOP || request.what > MHE_CONTROL_LABEL ||
                memchr(request.text, '\0', sizeof request.text) == NULL) {
                abort();
            }
            for (const char *c = request.text; *c != '\0'; c++) {
                if ((unsigned char)*c < ' ') {
                    abort(); /* it would end in a log */
                }
            }
        }
        at = end == NULL ? NULL : end + 1;
    }
    free(line);
    return 0;
}
