/* SPDX-License-Identifier: Apache-2.0 */
/* run_output.c: what the output section asks for that no option table can check. */
#include "config/run_sections.h"

#include <string.h>

mhe_status mhi_run_check_formats(const mhi_run *run, mhe_error *err) {
    static const char *const known[] = {"sto", "csv", "mat"};
    const int32_t n_known = sizeof known / sizeof known[0];
    for (int32_t i = 0; i < run->output.formats.n; i++) {
        const char *name = run->output.formats.values[i];
        int32_t k = 0;
        while (k < n_known && strcmp(known[k], name) != 0) {
            k++;
        }
        if (k == n_known) {
            char hint[128];
            const mhi_node *section = mhi_node_find(mhi_tree_root(run->tree), "output");
            return mhi_fail_at(err, MHE_E_CONFIG, run->tree, mhi_node_find(section, "formats"),
                               "output: 'formats' cannot hold '%.40s'%s", name,
                               mhi_suggest(hint, sizeof hint, name, known, n_known));
        }
    }
    return MHE_OK;
}
