/* SPDX-License-Identifier: Apache-2.0 */
/* mhe_gateway: libmhe.so for MATLAB and Octave, one function with a word in front; the classes and
 * functions of +myohorizon call it and are what users see. CONFIG stands for the arguments config,
 * {"key=value", ...}, folder, trust; h for a handle, a uint64.
 *
 *     h = mhe_gateway("open", CONFIG)                       estimator
 *     e = mhe_gateway("push", h, t, markers, emg, angles)   [] or a struct
 *     mhe_gateway("prepare" | "close", h)
 *     mhe_gateway("measure", h, channel, t, values)
 *     mhe_gateway("open_emg", h, {column, ...}, rate)       mhe_gateway("push_emg", h, t, raw)
 *     s = mhe_gateway("tracked", h)                         struct, a field a channel
 *     mhe_gateway("set_start", h, q, qdot)
 *     mhe_gateway("set_node" | "set_deadline", h, number)
 *     i = mhe_gateway("info", h)                            names, window, channels, config, ...
 *     r = mhe_gateway("run" | "check", CONFIG)              a whole recording; its findings
 *     s = mhe_gateway("model_info", file)                   JSON
 *     s = mhe_gateway("model_evaluate", file, json, paths)  JSON
 *     t = mhe_gateway("read", "markers" | "signals", file)  struct time, values, labels
 *     s = mhe_gateway("plugins")                            JSON
 *     s = mhe_gateway("describe", id)                       JSON
 *     h = mhe_gateway("live_open", CONFIG, folder, record, wait)
 *     mhe_gateway("live_run", h, seconds)                   mhe_gateway("live_command", h, line)
 *     s = mhe_gateway("live_state" | "live_summary", h)     JSON
 *     mhe_gateway("live_close", h)
 *     s = mhe_gateway("version")                            s = mhe_gateway("programs"): a folder
 */
#include "gateway.h"

#include <string.h>

static const struct {
    const char *word;
    gateway_function *function;
} words[] = {
    {"push", gateway_push}, /* the one that is in a hurry */
    {"prepare", gateway_prepare},
    {"open", gateway_open},
    {"close", gateway_close},
    {"info", gateway_info},
    {"measure", gateway_measure},
    {"open_emg", gateway_open_emg},
    {"push_emg", gateway_push_emg},
    {"tracked", gateway_tracked},
    {"set_start", gateway_set_start},
    {"set_node", gateway_set_node},
    {"set_deadline", gateway_set_deadline},
    {"run", gateway_run_recording},
    {"check", gateway_check_config},
    {"model_info", gateway_model_info},
    {"model_evaluate", gateway_model_evaluate},
    {"read", gateway_read},
    {"plugins", gateway_plugins},
    {"describe", gateway_describe},
    {"live_open", gateway_live_open},
    {"live_run", gateway_live_run},
    {"live_command", gateway_live_command},
    {"live_state", gateway_live_state},
    {"live_summary", gateway_live_summary},
    {"live_close", gateway_live_close},
    {"version", gateway_version},
    {"programs", gateway_programs},
};

static void close_all(void) {
    gateway_close_lives();
    gateway_close_estimators();
}

void mexFunction(int nlhs, mxArray *plhs[], int nrhs, const mxArray *prhs[]) {
    static int registered;
    (void)nlhs;
    if (!registered) {
        (void)mexAtExit(close_all);
        registered = 1;
    }
    char *word = gateway_text_of(gateway_argument(nrhs, prhs, 0), "the first argument");
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strcmp(word, words[i].word) == 0) {
            mxArray *out = words[i].function(nrhs, prhs);
            if (out != NULL) {
                plhs[0] = out;
            }
            mxFree(word);
            return;
        }
    }
    mexErrMsgIdAndTxt("myohorizon:argument", "mhe_gateway knows no '%s'", word);
}
