/* SPDX-License-Identifier: Apache-2.0 */
#include "lsl_rig.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

double lsl_rig_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void lsl_rig_rest(double seconds) {
    const struct timespec t = {(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))};
    (void)nanosleep(&t, NULL);
}

/* Loopback alone; a session of its own keeps apart what else runs on this machine. Version 1.12
 * looks for the file in the working directory, newer ones where LSLAPICFG says. */
static int write_config(const char *folder) {
    char path[512];
    (void)snprintf(path, sizeof path, "%s/lsl_api.cfg", folder);
    if (access(path, F_OK) != 0) { /* else it is of the process that started this one */
        FILE *file = fopen(path, "w");
        if (file == NULL) {
            return 0;
        }
        (void)fprintf(file,
                      "[ports]\nIPv6 = disable\n[multicast]\nResolveScope = machine\n"
                      "ListenAddress = 127.0.0.1\nAddressesOverride = {127.0.0.1}\n"
                      "[lab]\nKnownPeers = {127.0.0.1}\nSessionID = mhe-test-%d\n",
                      (int)getpid());
        if (fclose(file) != 0) {
            return 0;
        }
    }
    return setenv("LSLAPICFG", path, 1) == 0 && chdir(folder) == 0;
}

int lsl_rig_open(const char *folder, lsl_rig *rig) {
    static const char beside[] = MHE_TEST_PLUGIN_DIR "/lib/liblsl64.so";
    mhe_error err = {0};
    if (!write_config(folder) || (lsl_load(NULL, &rig->lsl, &err) != MHE_OK &&
                                  lsl_load(beside, &rig->lsl, &err) != MHE_OK)) {
        return 0;
    }
    static const char *const names[] = {"liblsl.so.2", "liblsl.so", "liblsl64.so", beside};
    void *library = NULL;
    for (size_t i = 0; i < 4 && library == NULL; i++) {
        library = dlopen(names[i], RTLD_NOW | RTLD_LOCAL);
    }
    void *symbols[3] = {dlsym(library, "lsl_push_sample_stp"),
                        dlsym(library, "lsl_push_sample_strtp"),
                        dlsym(library, "lsl_have_consumers")};
    memcpy(&rig->push_int16, &symbols[0], sizeof symbols[0]);
    memcpy(&rig->push_text, &symbols[1], sizeof symbols[1]);
    memcpy(&rig->have_consumers, &symbols[2], sizeof symbols[2]);
    return symbols[0] != NULL && symbols[1] != NULL && symbols[2] != NULL;
}

lsl_outlet lsl_rig_send(const lsl_rig *rig, const char *name, const char *type, int32_t format,
                        double rate, const lsl_channel *channels, int32_t n) {
    const lsl_library *l = &rig->lsl;
    char id[128];
    (void)snprintf(id, sizeof id, "%s-id", name);
    lsl_streaminfo info = l->create_streaminfo(name, type, n, rate, format, id);
    if (info == NULL) {
        return NULL;
    }
    lsl_xml_ptr list = l->append_child(l->get_desc(info), "channels");
    for (int32_t i = 0; i < n && channels != NULL; i++) {
        lsl_xml_ptr channel = l->append_child(list, "channel");
        (void)l->append_child_value(channel, "label", channels[i].label);
        (void)l->append_child_value(channel, "unit",
                                    channels[i].unit == NULL ? "" : channels[i].unit);
        (void)l->append_child_value(channel, "type",
                                    channels[i].type == NULL ? "" : channels[i].type);
    }
    lsl_outlet outlet = l->create_outlet(info, 0, 60);
    l->destroy_streaminfo(info);
    return outlet;
}
