/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* realpath, secure_getenv */
#include "plugin/registry.h"

#include "base/arena.h"
#include "plugin/loader.h"
#include "plugin/place.h"
#include "plugin/trust.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* One shared object, or a folder that could not be searched. */
typedef struct library {
    const char *file;
    const mhe_plugin *const *plugins;
    int32_t n_plugins;
    const char *refused; /* "path: reason"; NULL: good */
    struct library *next;
} library;

typedef struct folder {
    const char *path;
    int32_t own; /* of the caller */
    int32_t scanned;
    library *first, **end;
    struct folder *next;
} folder;

/* A plugin that look-ups can see. */
typedef struct entry {
    const mhe_plugin *plugin;
    const char *file;
    const char *hidden; /* warning of another file with the same id, not told yet; or NULL */
} entry;

struct mhi_registry {
    const mhe_host *host;
    mhi_arena arena;
    folder *own;                    /* of the caller, searched first ... */
    folder *standard;               /* ... then these */
    const char *absent[MHI_PLACES]; /* folders of an installation that are not there */
    int32_t n_absent;
    int32_t trusts_files;
    int32_t current; /* the two lists below are up to date */
    entry *entries;  /* sorted by id */
    const char **refused;
    int32_t n_entries, n_refused;
};

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

/* ---- folders ---- */

static folder *find_folder(folder *list, const char *path) {
    while (list != NULL && strcmp(list->path, path) != 0) {
        list = list->next;
    }
    return list;
}

/* The folder searched after `f` (NULL: the first). A standard one that the caller named too was
 * already searched at its earlier place. */
static folder *after(const mhi_registry *r, const folder *f) {
    int own = f == NULL || f->own;
    folder *next = f == NULL ? r->own : f->next;
    if (next == NULL && own) {
        next = r->standard;
        own = 0;
    }
    while (next != NULL && !own && find_folder(r->own, next->path) != NULL) {
        next = next->next;
    }
    return next;
}

/* Appends `path` (absolute) to one of the lists. */
static mhe_status append_folder(mhi_registry *r, folder **list, const char *path, mhe_error *err) {
    folder *f = MHI_TAKE(&r->arena, folder, 1);
    const char *copy = mhi_arena_text(&r->arena, path);
    if (f == NULL || copy == NULL) {
        return no_memory(err);
    }
    *f = (folder){.path = copy, .own = list == &r->own, .end = &f->first};
    while (*list != NULL) {
        list = &(*list)->next;
    }
    *list = f;
    r->current = 0;
    return MHE_OK;
}

mhe_status mhi_registry_add_folder(mhi_registry *r, const char *path, mhe_error *err) {
    char resolved[PATH_MAX];
    struct stat info;
    if (realpath(path, resolved) == NULL || stat(resolved, &info) != 0) {
        return mhe_fail(err, errno == ENOMEM ? MHE_E_MEMORY : MHE_E_CONFIG,
                        "plugin folder '%s': %s", path, strerror(errno));
    }
    if (!S_ISDIR(info.st_mode)) {
        return mhe_fail(err, MHE_E_CONFIG, "plugin folder '%s' is not a folder", path);
    }
    mhe_error why = {0};
    if (mhi_trust_folder(resolved, &why) != MHE_OK) {
        return mhe_fail(err, MHE_E_CONFIG, "plugin folder '%s': %s", path, why.text);
    }
    return find_folder(r->own, resolved) != NULL ? MHE_OK
                                                 : append_folder(r, &r->own, resolved, err);
}

/* A folder of the installation or the build tree: absent is fine, though it is told where a plugin
 * is missing; a second mention is fine too. */
static mhe_status add_standard(mhi_registry *r, const char *path, mhe_error *err) {
    char resolved[PATH_MAX];
    const int known = realpath(path, resolved) != NULL;
    if (!known && errno == ENOMEM) {
        return no_memory(err);
    }
    if (!known) {
        r->absent[r->n_absent++] = path;
        return MHE_OK;
    }
    return find_folder(r->standard, resolved) != NULL
               ? MHE_OK
               : append_folder(r, &r->standard, resolved, err);
}

/* MHE_PLUGIN_PATH. An empty entry would be the working directory: passed over. */
static mhe_status add_from_environment(mhi_registry *r, mhe_error *err) {
    const char *at = secure_getenv("MHE_PLUGIN_PATH");
    while (at != NULL && *at != '\0') {
        size_t n = strcspn(at, ":");
        char *path = mhi_arena_text_n(&r->arena, at, n);
        at += n + (at[n] == ':');
        if (path == NULL) {
            return no_memory(err);
        }
        char resolved[PATH_MAX];
        /* One that cannot be searched is kept as it is, so that its refusal is told. */
        const char *use = path[0] == '/' && realpath(path, resolved) != NULL ? resolved : path;
        if (n > 0 && find_folder(r->standard, use) == NULL) {
            mhe_status status = append_folder(r, &r->standard, use, err);
            if (status != MHE_OK) {
                return status;
            }
        }
    }
    return MHE_OK;
}

static mhe_status add_installed(mhi_registry *r, mhe_error *err) {
    mhi_places places;
    mhe_status status = mhi_places_of_plugins(&r->arena, &places, err);
    for (int32_t i = 0; i < places.n && status == MHE_OK; i++) {
        status = add_standard(r, places.path[i], err);
    }
    return status;
}

mhe_status mhi_registry_create(const mhe_host *host, mhi_registry **registry, mhe_error *err) {
    mhi_registry *r = calloc(1, sizeof *r);
    if (r == NULL) {
        return no_memory(err);
    }
    r->host = host;
    mhe_status status = add_from_environment(r, err);
    if (status == MHE_OK) {
        status = add_installed(r, err);
    }
    if (status != MHE_OK) {
        mhi_registry_free(r);
        r = NULL;
    }
    *registry = r;
    return status;
}

void mhi_registry_trust_files(mhi_registry *r, int32_t trusted) {
    r->trusts_files = trusted;
}

int32_t mhi_registry_trusts_files(const mhi_registry *r) {
    return r->trusts_files;
}

void mhi_registry_free(mhi_registry *r) {
    if (r != NULL) {
        mhi_arena_free(&r->arena);
        free(r);
    }
}

/* ---- scan ---- */

static int is_shared_object(const struct dirent *file) {
    size_t n = strlen(file->d_name);
    return n > 3 && file->d_name[0] != '.' && strcmp(file->d_name + n - 3, ".so") == 0;
}

/* By bytes: the same order in every locale. */
static int by_name(const struct dirent **a, const struct dirent **b) {
    return strcmp((*a)->d_name, (*b)->d_name);
}

static library *append_library(mhi_registry *r, folder *f) {
    library *l = MHI_TAKE(&r->arena, library, 1);
    if (l != NULL) {
        *f->end = l;
        f->end = &l->next;
    }
    return l;
}

static mhe_status load_library(mhi_registry *r, folder *f, const char *name, mhe_error *err) {
    library *l = append_library(r, f);
    char *path = mhi_arena_format(&r->arena, "%s/%s", f->path, name);
    if (l == NULL || path == NULL) {
        return no_memory(err);
    }
    l->file = path;
    mhe_error why = {0};
    mhe_status status = mhi_trust_file(path, &why);
    if (status == MHE_OK) {
        status = mhi_loader_open(path, &r->arena, &l->plugins, &l->n_plugins, &why);
    }
    if (status == MHE_OK) {
        return MHE_OK;
    }
    l->refused = mhi_arena_format(&r->arena, "%s: %s", path, why.text);
    return status == MHE_E_MEMORY || l->refused == NULL ? no_memory(err) : MHE_OK;
}

static mhe_status scan_folder(mhi_registry *r, folder *f, mhe_error *err) {
    struct dirent **files = NULL;
    mhe_error why = {0};
    int n = -1;
    if (mhi_trust_folder(f->path, &why) == MHE_OK) {
        n = scandir(f->path, &files, is_shared_object, by_name);
        if (n < 0 && errno == ENOMEM) {
            return no_memory(err);
        }
        (void)mhe_fail(&why, MHE_E_PLUGIN, "%s", n < 0 ? strerror(errno) : "");
    }
    mhe_status status = MHE_OK;
    if (n < 0) {
        library *l = append_library(r, f);
        char *line = mhi_arena_format(&r->arena, "%s: %s", f->path, why.text);
        if (l == NULL || line == NULL) {
            return no_memory(err);
        }
        *l = (library){.file = f->path, .refused = line};
    }
    for (int i = 0; i < n; i++) {
        if (status == MHE_OK) {
            status = load_library(r, f, files[i]->d_name, err);
        }
        free(files[i]);
    }
    free(files);
    f->scanned = status == MHE_OK;
    return status;
}

/* ---- the lists that look-ups see ---- */

static int by_id(const void *a, const void *b) {
    return strcmp(((const entry *)a)->plugin->id, ((const entry *)b)->plugin->id);
}

/* Adds a plugin unless its id was met before: the first in search order wins, and the other one is
 * listed among the refused. */
static mhe_status enter(mhi_registry *r, const mhe_plugin *plugin, const char *file,
                        mhe_error *err) {
    for (int32_t i = 0; i < r->n_entries; i++) {
        entry *first = &r->entries[i];
        if (strcmp(first->plugin->id, plugin->id) == 0) {
            const char *line = mhi_arena_format(&r->arena, "%s: '%s' is taken from %s", file,
                                                plugin->id, first->file);
            first->hidden = mhi_arena_format(&r->arena, "plugin '%s': %s is used, %s is not",
                                             plugin->id, first->file, file);
            if (line == NULL || first->hidden == NULL) {
                return no_memory(err);
            }
            r->refused[r->n_refused++] = line;
            return MHE_OK;
        }
    }
    r->entries[r->n_entries++] = (entry){.plugin = plugin, .file = file};
    return MHE_OK;
}

static mhe_status build_lists(mhi_registry *r, mhe_error *err) {
    int32_t n_plugins = 0, n_libraries = 0;
    for (const folder *f = after(r, NULL); f != NULL; f = after(r, f)) {
        for (const library *l = f->first; l != NULL; l = l->next) {
            n_plugins += l->n_plugins;
            n_libraries++;
        }
    }
    r->n_entries = r->n_refused = 0;
    r->entries = MHI_TAKE(&r->arena, entry, n_plugins);
    r->refused = MHI_TAKE(&r->arena, const char *, n_libraries + n_plugins);
    if (r->entries == NULL || r->refused == NULL) {
        return no_memory(err);
    }
    for (const folder *f = after(r, NULL); f != NULL; f = after(r, f)) {
        for (const library *l = f->first; l != NULL; l = l->next) {
            if (l->refused != NULL) {
                r->refused[r->n_refused++] = l->refused;
            }
            for (int32_t k = 0; k < l->n_plugins; k++) {
                mhe_status status = enter(r, l->plugins[k], l->file, err);
                if (status != MHE_OK) {
                    return status;
                }
            }
        }
    }
    qsort(r->entries, (size_t)r->n_entries, sizeof *r->entries, by_id);
    return MHE_OK;
}

/* Scans what was not scanned yet and brings the lists up to date. */
static mhe_status refresh(mhi_registry *r, mhe_error *err) {
    if (r->current) {
        return MHE_OK;
    }
    mhe_status status = MHE_OK;
    for (folder *f = after(r, NULL); f != NULL && status == MHE_OK; f = after(r, f)) {
        status = f->scanned ? MHE_OK : scan_folder(r, f, err);
    }
    if (status == MHE_OK) {
        status = build_lists(r, err);
    }
    r->current = status == MHE_OK;
    if (!r->current) {
        r->n_entries = r->n_refused = 0;
    }
    return status;
}

/* ---- look-ups ---- */

static mhe_status not_found(mhi_registry *r, const char *id, const char *iface, mhe_error *err) {
    const char **ids = calloc((size_t)r->n_entries + 1, sizeof *ids);
    if (ids == NULL) {
        return no_memory(err);
    }
    for (int32_t i = 0; i < r->n_entries; i++) {
        const mhe_plugin *p = r->entries[i].plugin;
        ids[i] = iface == NULL || strcmp(p->iface, iface) == 0 ? p->id : NULL;
    }
    char near[256];
    mhi_text text = {0};
    mhi_text_add(&text, "no plugin '%s'%s", id,
                 mhi_suggest(near, sizeof near, id, ids, r->n_entries));
    const char *lead = "; searched: ";
    for (const folder *f = after(r, NULL); f != NULL; f = after(r, f)) {
        mhi_text_add(&text, "%s%s", lead, f->path);
        lead = ", ";
    }
    for (int32_t i = 0; i < r->n_absent; i++) {
        mhi_text_add(&text, "%s%s (absent)", lead, r->absent[i]);
        lead = ", ";
    }
    for (int32_t i = 0; i < r->n_refused; i++) {
        mhi_text_add(&text, "%s%s", i == 0 ? "; refused: " : ", ", r->refused[i]);
    }
    mhe_status status = text.failed ? no_memory(err) : mhe_fail(err, MHE_E_PLUGIN, "%s", text.data);
    mhi_text_free(&text);
    free(ids);
    return status;
}

/* A plugin that takes the id of another is what the user wanted, or an attack. */
static void warn_once(const mhi_registry *r, entry *found) {
    if (found->hidden != NULL && r->host != NULL && r->host->log != NULL) {
        r->host->log(r->host, MHE_LOG_WARNING, found->hidden);
    }
    found->hidden = NULL;
}

mhe_status mhi_registry_find(mhi_registry *r, const char *id, const char *iface,
                             const mhe_plugin **plugin, mhe_error *err) {
    *plugin = NULL;
    mhe_status status = refresh(r, err);
    if (status != MHE_OK) {
        return status;
    }
    for (int32_t i = 0; i < r->n_entries; i++) {
        const mhe_plugin *p = r->entries[i].plugin;
        if (strcmp(p->id, id) == 0) {
            if (iface != NULL && strcmp(p->iface, iface) != 0) {
                return mhe_fail(err, MHE_E_PLUGIN,
                                "plugin '%s' is of the kind %s, here %s is wanted", id, p->iface,
                                iface);
            }
            *plugin = p;
            warn_once(r, &r->entries[i]);
            return MHE_OK;
        }
    }
    return not_found(r, id, iface, err);
}

int32_t mhi_registry_count(mhi_registry *r) {
    (void)refresh(r, NULL);
    return r->n_entries;
}

const mhe_plugin *mhi_registry_at(mhi_registry *r, int32_t i) {
    return i >= 0 && i < mhi_registry_count(r) ? r->entries[i].plugin : NULL;
}

const char *mhi_registry_file(mhi_registry *r, int32_t i) {
    return i >= 0 && i < mhi_registry_count(r) ? r->entries[i].file : NULL;
}

int32_t mhi_registry_refused_count(mhi_registry *r) {
    (void)refresh(r, NULL);
    return r->n_refused;
}

const char *mhi_registry_refused(mhi_registry *r, int32_t i) {
    return i >= 0 && i < mhi_registry_refused_count(r) ? r->refused[i] : NULL;
}
