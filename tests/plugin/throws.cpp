/* SPDX-License-Identifier: Apache-2.0 */
/* throws.cpp: a cost plugin whose create() lets a C++ exception out. */
#include <mhe/cost.h>

#include <stdexcept>
#include <string>

namespace {

struct local_type {};

/* config selects how: NULL throws a std::exception, else a type of its own. */
mhe_status create(const mhe_host *, const mhe_problem *, const void *config, void **, mhe_error *) {
    if (config == nullptr) {
        throw std::out_of_range("a vector was too short");
    }
    throw local_type();
}

void destroy(void *) {}

mhe_status throw_logic_error() {
    throw std::logic_error("noexcept makes it std::terminate");
}

mhe_status layout(const void *, const mhe_problem *, mhe_cost_layout *, mhe_error *) noexcept {
    return throw_logic_error();
}

mhe_status residual(const void *, const mhe_stage *, double *r, mhe_error *) {
    try { // an exception that stays inside is nobody's business
        throw std::runtime_error("inside");
    } catch (const std::exception &e) {
        r[0] = static_cast<double>(std::string(e.what()).size());
    }
    return MHE_OK;
}

const mhe_cost_ops ops = {sizeof(mhe_cost_ops), create, destroy, layout, residual, nullptr};
const mhe_plugin plugin = {sizeof(mhe_plugin),
                           0,
                           "test.cost.throws",
                           "1.0.0",
                           "Throws.",
                           nullptr,
                           MHE_COST_IFACE,
                           &ops,
                           0,
                           sizeof(mhe_option),
                           0,
                           nullptr,
                           nullptr};
const mhe_plugin *const list[] = {&plugin};
const mhe_library library = {MHE_MAGIC, MHE_ABI_MAJOR, MHE_ABI_MINOR, sizeof(mhe_library), 1, list};

} // namespace

extern "C" MHE_EXPORT const mhe_library *mhe_plugin_entry(void);
const mhe_library *mhe_plugin_entry(void) {
    return &library;
}
