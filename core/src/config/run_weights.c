/* SPDX-License-Identifier: Apache-2.0 */
/* run_weights.c: data.marker_weights, a mapping or the path of a file alone. */
#include "config/options_value.h"
#include "config/run_sections.h"

mhe_status mhi_run_flatten_weights(mhi_run *run, mhe_error *err) {
    const mhi_node *data = mhi_node_find(mhi_tree_root(run->tree), "data");
    mhi_node *weights =
        data == NULL || data->kind != MHI_MAPPING ? NULL : mhi_node_find(data, "marker_weights");
    if (weights == NULL) {
        return MHE_OK;
    }
    mhe_status status = mhi_node_expand(run->tree, weights, MHI_MARKER_TASK_FILE, err);
    mhi_node *file = status == MHE_OK && weights->kind == MHI_MAPPING
                         ? mhi_node_find(weights, MHI_MARKER_TASK_FILE)
                         : NULL;
    if (file != NULL && file->kind == MHI_SCALAR && !mhi_node_is_null(file)) {
        file->text = mhi_path_absolute(run->dir, file->text, &run->arena);
        status = file->text == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    return status;
}
