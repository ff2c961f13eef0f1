/* SPDX-License-Identifier: Apache-2.0 */
/* test_guard.c: a plugin that throws ends its call, not the process. */
#include "plugin/guard.h"
#include "plugin/registry.h"

#include "support.h"
#include <mhe/cost.h>

#include <pthread.h>
#include <stdlib.h>

typedef struct call {
    const mhe_cost_ops *ops;
    const void *config;
    double r;
} call;

static mhe_status call_create(void *data) {
    call *c = data;
    void *self = NULL;
    return c->ops->create(NULL, NULL, c->config, &self, NULL);
}

static mhe_status call_layout(void *data) {
    mhe_cost_layout layout = {0};
    return ((call *)data)->ops->layout(NULL, NULL, &layout, NULL);
}

static mhe_status call_residual(void *data) {
    call *c = data;
    return c->ops->residual(NULL, NULL, &c->r, NULL);
}

static mhe_status call_nested(void *data) {
    mhe_error err = {0};
    if (mhi_guard(call_create, data, &err) != MHE_E_PLUGIN) {
        return mhe_fail(&err, MHE_E_INTERNAL, "the inner guard did not hold");
    }
    return call_create(data);
}

static int open_plugin(void **state) {
    static call c;
    static mhi_registry *registry;
    const mhe_plugin *plugin = NULL;
    if (setenv("MHE_PLUGIN_PATH", PLUGIN_DIR, 1) != 0 ||
        mhi_registry_create(NULL, &registry, NULL) != MHE_OK ||
        mhi_registry_find(registry, "test.cost.throws", MHE_COST_IFACE, &plugin, NULL) != MHE_OK) {
        return -1;
    }
    c.ops = plugin->ops;
    static void *both[2];
    both[0] = &c;
    both[1] = registry;
    *state = both;
    return 0;
}

static int close_plugin(void **state) {
    mhi_registry_free(((void **)*state)[1]);
    return 0;
}

static call *the_call(void **state) {
    return ((void **)*state)[0];
}

static void an_exception_becomes_a_status(void **state) {
    call *c = the_call(state);
    mhe_error err = {0};
    for (int i = 0; i < 100; i++) {
        c->config = NULL;
        assert_int_equal(mhi_guard(call_create, c, &err), MHE_E_PLUGIN);
        assert_string_equal(err.text, "threw a C++ exception (std::out_of_range)");
        c->config = "own type";
        assert_int_equal(mhi_guard(call_create, c, &err), MHE_E_PLUGIN);
        assert_string_equal(err.text, "threw a C++ exception ((anonymous namespace)::local_type)");
    }
}

static void a_throw_out_of_noexcept_too(void **state) {
    mhe_error err = {0};
    assert_int_equal(mhi_guard(call_layout, the_call(state), &err), MHE_E_PLUGIN);
    assert_string_equal(err.text, "threw a C++ exception (std::logic_error)");
}

static void an_exception_that_stays_inside_is_left_alone(void **state) {
    call *c = the_call(state);
    assert_int_equal(mhi_guard(call_residual, c, NULL), MHE_OK);
    assert_true(c->r == 6.0); /* length of "inside" */
}

static void guards_nest(void **state) {
    the_call(state)->config = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_guard(call_nested, the_call(state), &err), MHE_E_PLUGIN);
    assert_string_equal(err.text, "threw a C++ exception (std::out_of_range)");
}

static void *many_guarded_calls(void *data) {
    intptr_t held = 0;
    for (int i = 0; i < 200; i++) {
        held += mhi_guard(call_create, data, NULL) == MHE_E_PLUGIN;
    }
    return (void *)held;
}

static void each_thread_has_its_own(void **state) {
    the_call(state)->config = NULL;
    pthread_t threads[4];
    for (int i = 0; i < 4; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, many_guarded_calls, the_call(state)), 0);
    }
    for (int i = 0; i < 4; i++) {
        void *held = NULL;
        assert_int_equal(pthread_join(threads[i], &held), 0);
        assert_int_equal((intptr_t)held, 200);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_exception_becomes_a_status),
        cmocka_unit_test(a_throw_out_of_noexcept_too),
        cmocka_unit_test(an_exception_that_stays_inside_is_left_alone),
        cmocka_unit_test(guards_nest),
        cmocka_unit_test(each_thread_has_its_own),
    };
    return cmocka_run_group_tests(tests, open_plugin, close_plugin);
}
