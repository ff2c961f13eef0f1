/* SPDX-License-Identifier: Apache-2.0 */
/* Streams as they come: what mhe-live does. */
#include "gateway.h"

#include <mhe/live.h>
#include <string.h>

#define GATEWAY_LIVES 16 /* at once */

typedef struct running {
    uint64_t id; /* 0: free */
    mhe_config *config;
    mhe_live *live;
} running;

static running table[GATEWAY_LIVES];

static void close_one(running *r) {
    mhe_live_close(r->live);
    mhe_config_close(r->config);
    memset(r, 0, sizeof *r);
}

void gateway_close_lives(void) {
    for (int i = 0; i < GATEWAY_LIVES; i++) {
        if (table[i].id != 0) {
            close_one(&table[i]);
        }
    }
}

static running *running_of(int nrhs, const mxArray *prhs[]) {
    const uint64_t id = gateway_handle_of(gateway_argument(nrhs, prhs, 1));
    for (int i = 0; i < GATEWAY_LIVES && id != 0; i++) {
        if (table[i].id == id) {
            return &table[i];
        }
    }
    mexErrMsgIdAndTxt("myohorizon:closed", "it is closed");
    return NULL;
}

mxArray *gateway_live_open(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    running *r = NULL;
    mhe_live_setup setup = {
        .size = sizeof setup,
        .folder = gateway_optional_text_of(gateway_argument(nrhs, prhs, 5), "folder"),
        .record = gateway_optional_text_of(gateway_argument(nrhs, prhs, 6), "record"),
        .wait = gateway_number_of(gateway_argument(nrhs, prhs, 7), "wait")};
    for (int i = 0; i < GATEWAY_LIVES && r == NULL; i++) {
        r = table[i].id == 0 ? &table[i] : NULL;
    }
    if (r == NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%d are open; close some", GATEWAY_LIVES);
        return NULL;
    }
    mhe_status status = gateway_config_of(nrhs, prhs, &r->config, &err);
    status = status == MHE_OK ? mhe_live_open(r->config, &setup, &r->live, &err) : status;
    if (status != MHE_OK) {
        close_one(r);
        gateway_refuse(status, &err);
    }
    r->id = gateway_new_handle();
    mexLock();
    return gateway_handle_out(r->id);
}

mxArray *gateway_live_run(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    running *r = running_of(nrhs, prhs);
    const double seconds = gateway_number_of(gateway_argument(nrhs, prhs, 2), "seconds");
    const mhe_status status = mhe_live_run(r->live, seconds, &err);
    if (status != MHE_OK) {
        gateway_refuse(status, &err);
    }
    return NULL;
}

mxArray *gateway_live_command(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    running *r = running_of(nrhs, prhs);
    const mhe_status status =
        mhe_live_command(r->live, gateway_text_of(gateway_argument(nrhs, prhs, 2), "line"), &err);
    if (status != MHE_OK) {
        gateway_refuse(status, &err);
    }
    return NULL;
}

mxArray *gateway_live_state(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL;
    const mhe_status status = mhe_live_state(running_of(nrhs, prhs)->live, &text, &err);
    return gateway_text_out(status, text, &err);
}

mxArray *gateway_live_summary(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL;
    const mhe_status status = mhe_live_summary(running_of(nrhs, prhs)->live, &text, &err);
    return gateway_text_out(status, text, &err);
}

mxArray *gateway_live_close(int nrhs, const mxArray *prhs[]) {
    close_one(running_of(nrhs, prhs));
    mexUnlock();
    return NULL;
}
