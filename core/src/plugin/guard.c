/* SPDX-License-Identifier: Apache-2.0 */
#include "plugin/guard.h"

#include <dlfcn.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

typedef void (*terminate_handler)(void);

/* What is used of one C++ runtime (Itanium C++ ABI, the same for libstdc++ and libc++). */
typedef struct runtime {
    terminate_handler (*set_terminate)(terminate_handler handler);
    void *(*current_type)(void); /* type_info of the exception in flight, or NULL */
    void (*end_catch)(void);     /* gives that exception back */
    char *(*demangle)(const char *name, char *buffer, size_t *size, int *status);
    terminate_handler previous;
} runtime;

/* A process rarely holds more than one runtime; two are libstdc++ and libc++ side by side. */
#define RUNTIMES 4
static runtime runtimes[RUNTIMES];
static int n_runtimes;
static pthread_mutex_t runtimes_lock = PTHREAD_MUTEX_INITIALIZER;

/* A guarded call in progress on this thread. */
typedef struct guard {
    sigjmp_buf back;
    char type[160]; /* of the exception */
    struct guard *outer;
} guard;

static _Thread_local guard *innermost;

/* The type's name, readable where the runtime can make it so. type_info starts with its vtable and
 * then the mangled name. */
static void describe_type(const runtime *r, const void *type, char *out, size_t size) {
    const char *name = ((const char *const *)type)[1];
    name += name[0] == '*'; /* a type with internal linkage */
    int status = -1;
    char *readable = r->demangle != NULL ? r->demangle(name, NULL, NULL, &status) : NULL;
    (void)snprintf(out, size, "%s", status == 0 && readable != NULL ? readable : name);
    free(readable);
}

static void on_terminate(void) {
    guard *g = innermost;
    if (g == NULL) {
        (void)pthread_mutex_lock(&runtimes_lock);
        terminate_handler previous = n_runtimes > 0 ? runtimes[0].previous : NULL;
        (void)pthread_mutex_unlock(&runtimes_lock);
        if (previous != NULL) {
            previous();
        }
        abort();
    }
    (void)pthread_mutex_lock(&runtimes_lock);
    g->type[0] = '\0';
    for (int i = 0; i < n_runtimes; i++) {
        const runtime *r = &runtimes[i];
        const void *type = r->current_type != NULL ? r->current_type() : NULL;
        if (type != NULL) {
            describe_type(r, type, g->type, sizeof g->type);
            if (r->end_catch != NULL) {
                r->end_catch();
            }
            break;
        }
    }
    (void)pthread_mutex_unlock(&runtimes_lock);
    siglongjmp(g->back, 1);
}

/* dlsym gives void *; POSIX promises that it holds a function's address. */
static void look_up(void *library, const char *name, void *function, size_t size) {
    void *symbol = dlsym(library, name);
    memcpy(function, &symbol, size);
}

void mhi_guard_watch(void *library) {
    runtime r = {0};
    look_up(library, "_ZSt13set_terminatePFvvE", &r.set_terminate, sizeof r.set_terminate);
    if (r.set_terminate == NULL) {
        return;
    }
    look_up(library, "__cxa_current_exception_type", &r.current_type, sizeof r.current_type);
    look_up(library, "__cxa_end_catch", &r.end_catch, sizeof r.end_catch);
    look_up(library, "__cxa_demangle", &r.demangle, sizeof r.demangle);
    (void)pthread_mutex_lock(&runtimes_lock);
    int known = n_runtimes == RUNTIMES;
    for (int i = 0; i < n_runtimes; i++) {
        known |= runtimes[i].set_terminate == r.set_terminate;
    }
    if (!known) {
        r.previous = r.set_terminate(on_terminate);
        runtimes[n_runtimes++] = r;
    }
    (void)pthread_mutex_unlock(&runtimes_lock);
}

mhe_status mhi_guard(mhe_status (*call)(void *data), void *data, mhe_error *err) {
    guard g = {.outer = innermost};
    if (sigsetjmp(g.back, 0) != 0) {
        innermost = g.outer;
        /* The second is what stands there where the first takes memory that there is not. */
        if (strcmp(g.type, "std::bad_alloc") == 0 || strcmp(g.type, "St9bad_alloc") == 0) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory (std::bad_alloc)");
        }
        return g.type[0] != '\0' ? mhe_fail(err, MHE_E_PLUGIN, "threw a C++ exception (%s)", g.type)
                                 : mhe_fail(err, MHE_E_PLUGIN, "called std::terminate");
    }
    innermost = &g;
    mhe_status status = call(data);
    innermost = g.outer;
    return status;
}
