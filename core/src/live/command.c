/* SPDX-License-Identifier: Apache-2.0 */
/* command.c: the line protocol: a name of MHE_CONTROL_NAMES, a blank, and what it is about. */
#include "live/live_private.h"

#include <string.h>

static const char *const names[] = MHE_CONTROL_NAMES;
#define N_NAMES ((int32_t)(sizeof names / sizeof *names))

static mhe_status no_name(const char *line, size_t length, mhe_error *err) {
    char all[160] = "";
    for (int32_t i = 0; i < N_NAMES; i++) {
        const size_t n = strlen(all);
        (void)snprintf(all + n, sizeof all - n, "%s%s", i == 0 ? "" : ", ", names[i]);
    }
    return mhe_fail(err, MHE_E_ARGUMENT, "'%.*s' is none of %s", length < 80 ? (int)length : 80,
                    line, all);
}

mhe_status mhi_live_parse(const char *line, mhi_live_request *out, mhe_error *err) {
    static const char blanks[] = " \t\r\n";
    line += strspn(line, blanks);
    const size_t length = strcspn(line, blanks);
    const char *about = line + length + strspn(line + length, blanks);
    size_t n = strlen(about);
    while (n > 0 && strchr(blanks, about[n - 1]) != NULL) {
        n--;
    }
    *out = (mhi_live_request){.what = -1};
    for (int32_t i = 0; i < N_NAMES; i++) {
        out->what =
            strlen(names[i]) == length && strncmp(names[i], line, length) == 0 ? i : out->what;
    }
    if (out->what < 0) {
        return no_name(line, length, err);
    }
    if (n >= sizeof out->text) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s: %zu bytes are too many, at most %zu",
                        names[out->what], n, sizeof out->text - 1);
    }
    const int about_something =
        out->what == MHE_CONTROL_MVC_START || out->what == MHE_CONTROL_LABEL;
    if (about_something != (n > 0)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s: %s", names[out->what],
                        out->what == MHE_CONTROL_LABEL       ? "write label CAME=MODEL"
                        : out->what == MHE_CONTROL_MVC_START ? "write mvc-start ELECTRODE"
                                                             : "nothing may follow it");
    }
    for (size_t i = 0; i < n; i++) { /* it ends in lines of a log and in names */
        out->text[i] = about[i];
        if ((unsigned char)about[i] < ' ') {
            out->text[i] = ' ';
        }
    }
    return MHE_OK;
}
