/* SPDX-License-Identifier: Apache-2.0 */
/* description_builder.c: collects what a model file says. description_check.c makes the
 * description of it. */
#include "io/description_builder.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

void mhi_build_start(mhi_builder *b, const char *source, mhe_error *err) {
    *b = (mhi_builder){.err = err};
    b->source = mhi_arena_text(&b->arena, source);
    if (b->source == NULL) {
        b->source = "";
        b->status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
}

mhe_status mhi_build_abandon(mhi_builder *b) {
    if (b->arena.failed) { /* whatever else was found wrong came of it */
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "%s: out of memory", b->source);
    }
    mhi_arena_free(&b->arena);
    return b->status;
}

void *mhi_build_push(mhi_builder *b, mhi_list *list, size_t bytes) {
    if (list->n == list->capacity) {
        int32_t capacity = list->capacity == 0 ? 8 : 2 * list->capacity;
        void **items = MHI_TAKE(&b->arena, void *, capacity);
        if (items != NULL && list->n > 0) {
            memcpy(items, list->items, sizeof *items * (size_t)list->n);
        }
        list->items = items != NULL ? items : list->items;
        list->capacity = items != NULL ? capacity : list->capacity;
    }
    void *item = list->n < list->capacity ? mhi_arena_take(&b->arena, bytes) : NULL;
    if (item == NULL) {
        if (b->status == MHE_OK) {
            b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        }
        return NULL;
    }
    list->items[list->n++] = item;
    return item;
}

void *mhi_build_take(mhi_builder *b, int32_t n, size_t bytes) {
    void *memory = mhi_arena_take(&b->arena, bytes * (size_t)n);
    if (memory == NULL && b->status == MHE_OK) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
    }
    return memory;
}

MHE_PRINTF(4, 0)
static void place_text(const mhi_builder *b, int32_t line, char out[MHE_ERROR_TEXT],
                       const char *format, va_list args) {
    int n = line > 0 ? snprintf(out, MHE_ERROR_TEXT, "%s:%d: ", b->source, (int)line)
                     : snprintf(out, MHE_ERROR_TEXT, "%s: ", b->source);
    if (n > 0 && n < MHE_ERROR_TEXT) {
        (void)vsnprintf(out + n, (size_t)(MHE_ERROR_TEXT - n), format, args);
    }
}

void mhi_build_fail(mhi_builder *b, int32_t line, const char *format, ...) {
    if (b->status != MHE_OK) {
        return;
    }
    char text[MHE_ERROR_TEXT];
    va_list args;
    va_start(args, format);
    place_text(b, line, text, format, args);
    va_end(args);
    b->status = mhe_fail(b->err, MHE_E_INPUT, "%s", text);
}

static void note(mhi_builder *b, mhi_list *list, const char *text) {
    char *copy = mhi_build_push(b, list, strlen(text) + 1);
    if (copy != NULL) {
        memcpy(copy, text, strlen(text) + 1);
    }
}

void mhi_build_warn(mhi_builder *b, int32_t line, const char *format, ...) {
    char text[MHE_ERROR_TEXT];
    if (!mhi_kinds_count(&b->kinds, format, line, b->warnings.n)) {
        return;
    }
    va_list args;
    va_start(args, format);
    place_text(b, line, text, format, args);
    va_end(args);
    note(b, &b->warnings, text);
}

void mhi_build_count_kinds(mhi_builder *b) {
    for (int32_t i = 0; i < b->kinds.n; i++) {
        const mhi_kind *kind = &b->kinds.of[i];
        char rest[128];
        if (*mhi_kinds_rest(kind, rest, sizeof rest) != '\0' && kind->place < b->warnings.n) {
            char *line = mhi_arena_format(&b->arena, "%s%s",
                                          (const char *)b->warnings.items[kind->place], rest);
            b->warnings.items[kind->place] = line != NULL ? line : b->warnings.items[kind->place];
        }
    }
}

void mhi_build_unsupported(mhi_builder *b, int32_t line, const char *format, ...) {
    char text[MHE_ERROR_TEXT];
    va_list args;
    va_start(args, format);
    place_text(b, line, text, format, args);
    va_end(args);
    note(b, &b->unsupported, text);
}

void mhi_build_dropped(mhi_builder *b, int32_t line, const char *format, ...) {
    char text[MHE_ERROR_TEXT];
    va_list args;
    va_start(args, format);
    place_text(b, line, text, format, args);
    va_end(args);
    note(b, &b->dropped, text);
}

mhi_body_draft *mhi_build_body(mhi_builder *b, const char *name, const char *parent, int32_t line) {
    mhi_body_draft *draft = mhi_build_push(b, &b->bodies, sizeof *draft);
    if (draft != NULL) {
        const mhi_transform identity = mhi_transform_identity();
        draft->body.name = name;
        draft->parent = parent;
        draft->line = line;
        memcpy(draft->body.joint_r, identity.r, sizeof identity.r);
        memcpy(draft->body.body_r, identity.r, sizeof identity.r);
    }
    return draft;
}

mhi_coordinate_draft *mhi_build_coordinate(mhi_builder *b, const char *name, int32_t line) {
    mhi_coordinate_draft *draft = mhi_build_push(b, &b->coordinates, sizeof *draft);
    if (draft != NULL) {
        draft->coordinate = (mhe_coordinate){.name = name, .lower = -INFINITY, .upper = INFINITY};
        draft->line = line;
    }
    return draft;
}

static void set_point(mhi_point_draft *point, const char *body, const double location[3],
                      int32_t line) {
    point->body = body;
    point->line = line;
    point->point = (mhe_path_point){.coordinate = {-1, -1, -1}};
    memcpy(point->point.location, location, sizeof point->point.location);
}

void mhi_build_marker(mhi_builder *b, const char *name, const char *body, const double location[3],
                      int32_t line) {
    mhi_marker_draft *draft = mhi_build_push(b, &b->markers, sizeof *draft);
    if (draft != NULL) {
        draft->name = name;
        set_point(&draft->point, body, location, line);
    }
}

mhi_muscle_draft *mhi_build_muscle(mhi_builder *b, const char *name, int32_t line) {
    mhi_muscle_draft *draft = mhi_build_push(b, &b->muscles, sizeof *draft);
    if (draft != NULL) {
        draft->line = draft->path.line = line;
        draft->path.what = "muscle";
        draft->path.name = name;
        draft->muscle = mhe_muscle_unstated(name);
    }
    return draft;
}

void mhi_build_point(mhi_builder *b, mhi_muscle_draft *muscle, const char *body,
                     const double location[3], int32_t line) {
    mhi_point_draft *point = mhi_build_push(b, &muscle->path.points, sizeof *point);
    if (point != NULL) {
        set_point(point, body, location, line);
    }
}

void mhi_build_motion(mhi_builder *b, mhi_body_draft *body, int32_t kind, int32_t coordinate,
                      const double axis[3], mhe_function function, int32_t line) {
    if (function.n_pieces == 0) {
        return; /* memory is out */
    }
    if (coordinate < 0 && mhi_function_value(&function, 0.0) == 0.0) {
        return;
    }
    double norm = hypot(hypot(axis[0], axis[1]), axis[2]);
    if (norm < 1e-12) {
        mhi_build_fail(b, line, "the axis of a motion of '%s' has no length", body->body.name);
        return;
    }
    mhe_motion *motion = mhi_build_push(b, &body->motions, sizeof *motion);
    if (motion != NULL) {
        motion->kind = kind;
        motion->coordinate = coordinate;
        motion->function = function;
        for (int i = 0; i < 3; i++) {
            motion->axis[i] = axis[i] / norm;
        }
    }
}

int32_t mhi_same_word(const char *a, const char *b) {
    while (*a != '\0' && tolower((unsigned char)*a) == tolower((unsigned char)*b)) {
        a++;
        b++;
    }
    return *a == '\0' && *b == '\0';
}
