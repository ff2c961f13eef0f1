/* SPDX-License-Identifier: Apache-2.0 */
/* biomod_muscle.c: muscle groups, muscles and via points of a .bioMod file. */
#include "base/text.h"
#include "io/biomod.h"

#include <string.h>

typedef struct group {
    const char *name, *origin_parent, *insertion_parent;
} group;

typedef struct muscle {
    mhi_muscle_draft *draft; /* lives in the builder */
    const char *group;
    double origin[3], insertion[3];
    int32_t has_origin, has_insertion;
    int32_t line;
} muscle;

typedef struct via {
    const char *name, *parent, *muscle, *group;
    double position[3];
    int32_t line, used;
} via;

static int32_t group_property(mhi_biomod *m, void *item, mhi_word tag) {
    group *g = item;
    if (mhi_same_word(tag.text, "originparent")) {
        g->origin_parent = mhi_biomod_parent(m, tag);
    } else if (mhi_same_word(tag.text, "insertionparent")) {
        g->insertion_parent = mhi_biomod_parent(m, tag);
    } else {
        return 0;
    }
    return 1;
}

static void read_type(mhi_biomod *m, mhe_muscle *out) {
    static const struct {
        const char *word;
        int32_t type;
    } types[] = {{"hill", MHE_MUSCLE_HILL},
                 {"hillthelen", MHE_MUSCLE_HILL_THELEN},
                 {"thelen", MHE_MUSCLE_HILL_THELEN},
                 {"hilldegroote", MHE_MUSCLE_HILL_DEGROOTE},
                 {"degroote", MHE_MUSCLE_HILL_DEGROOTE},
                 {"hillthelenfatigable", MHE_MUSCLE_HILL_THELEN},
                 {"thelenfatigable", MHE_MUSCLE_HILL_THELEN},
                 {"hilldegrootefatigable", MHE_MUSCLE_HILL_DEGROOTE},
                 {"degrootefatigable", MHE_MUSCLE_HILL_DEGROOTE}};
    mhi_word word = mhi_lex_next(&m->lex);
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (mhi_same_word(word.text, types[i].word)) {
            out->type = types[i].type;
            if (strstr(types[i].word, "fatigable") != NULL) {
                mhi_build_unsupported(&m->b, word.line, "fatigue of muscle '%s'", out->name);
            }
            return;
        }
    }
    mhi_build_unsupported(&m->b, word.line, "muscle type '%s' of muscle '%s'", word.text,
                          out->name);
}

static int32_t muscle_property(mhi_biomod *m, void *item, mhi_word tag) {
    static const char *const silent[] = {"statetype",     "pcsa",        "maxexcitation",
                                         "maxactivation", "shapefactor", "maximalexcitation"};
    muscle *u = item;
    mhe_muscle *p = &u->draft->muscle;
    const struct {
        const char *tag;
        double *out;
    } numbers[] = {{"optimallength", &p->optimal_fiber_length},
                   {"maximalforce", &p->max_isometric_force},
                   {"tendonslacklength", &p->tendon_slack_length},
                   {"pennationangle", &p->pennation_angle},
                   {"maxvelocity", &p->max_contraction_velocity}};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        if (mhi_same_word(tag.text, numbers[i].tag)) {
            (void)mhi_lex_numbers(&m->lex, tag.text, numbers[i].out, 1);
            return 1;
        }
    }
    for (size_t i = 0; i < sizeof silent / sizeof *silent; i++) {
        if (mhi_same_word(tag.text, silent[i])) {
            mhi_biomod_skip(m, tag);
            return 1;
        }
    }
    double damping = 0;
    if (mhi_same_word(tag.text, "type")) {
        read_type(m, p);
    } else if (mhi_same_word(tag.text, "musclegroup")) {
        u->group = mhi_biomod_name(m, tag);
    } else if (mhi_same_word(tag.text, "originposition")) {
        u->has_origin = mhi_lex_numbers(&m->lex, tag.text, u->origin, 3);
    } else if (mhi_same_word(tag.text, "insertionposition")) {
        u->has_insertion = mhi_lex_numbers(&m->lex, tag.text, u->insertion, 3);
    } else if (mhi_same_word(tag.text, "usedamping")) {
        if (mhi_lex_numbers(&m->lex, tag.text, &damping, 1) && damping != 0) {
            mhi_build_unsupported(&m->b, tag.line, "useDamping of muscle '%s'", p->name);
        }
    } else {
        return 0;
    }
    return 1;
}

static int32_t via_property(mhi_biomod *m, void *item, mhi_word tag) {
    via *v = item;
    if (mhi_same_word(tag.text, "parent")) {
        v->parent = mhi_biomod_parent(m, tag);
    } else if (mhi_same_word(tag.text, "muscle")) {
        v->muscle = mhi_biomod_name(m, tag);
    } else if (mhi_same_word(tag.text, "musclegroup")) {
        v->group = mhi_biomod_name(m, tag);
    } else if (mhi_same_word(tag.text, "position")) {
        (void)mhi_lex_numbers(&m->lex, tag.text, v->position, 3);
    } else {
        return 0;
    }
    return 1;
}

static void read_muscle(mhi_biomod *m, mhi_word tag) {
    muscle *u = mhi_build_push(&m->b, &m->muscles, sizeof *u);
    mhi_muscle_draft *draft = mhi_build_muscle(&m->b, mhi_biomod_name(m, tag), tag.line);
    if (u != NULL && draft != NULL) {
        u->draft = draft;
        u->line = tag.line;
        draft->muscle.tendon_slack_length = 0;
        draft->muscle.pennation_angle = 0;
        mhi_biomod_block(m, "muscle", draft->muscle.name, tag, muscle_property, u);
    }
}

int32_t mhi_biomod_muscle_block(mhi_biomod *m, mhi_word tag) {
    if (mhi_same_word(tag.text, "musclegroup")) {
        group *g = mhi_build_push(&m->b, &m->groups, sizeof *g);
        if (g != NULL) {
            g->name = mhi_biomod_name(m, tag);
            mhi_biomod_block(m, "musclegroup", g->name, tag, group_property, g);
        }
    } else if (mhi_same_word(tag.text, "muscle")) {
        read_muscle(m, tag);
    } else if (mhi_same_word(tag.text, "viapoint")) {
        via *v = mhi_build_push(&m->b, &m->vias, sizeof *v);
        if (v != NULL) {
            v->name = mhi_biomod_name(m, tag);
            v->line = tag.line;
            mhi_biomod_block(m, "viapoint", v->name, tag, via_property, v);
        }
    } else {
        return 0;
    }
    return 1;
}

/* The group of a muscle; NULL after an error. */
static const group *find_group(mhi_biomod *m, const muscle *u) {
    const char *muscle_name = u->draft->muscle.name;
    const char **names = MHI_TAKE(&m->b.arena, const char *, m->groups.n);
    if (u->group == NULL || names == NULL) {
        mhi_build_fail(&m->b, u->line, "muscle '%s' names no musclegroup", muscle_name);
        return NULL;
    }
    for (int32_t i = 0; i < m->groups.n; i++) {
        const group *g = m->groups.items[i];
        names[i] = g->name;
        if (strcmp(g->name, u->group) == 0) {
            return g;
        }
    }
    char hint[256];
    mhi_build_fail(&m->b, u->line, "muscle '%s' is in an unknown musclegroup '%s'%s", muscle_name,
                   u->group, mhi_suggest(hint, sizeof hint, u->group, names, m->groups.n));
    return NULL;
}

static void build_path(mhi_biomod *m, muscle *u, const group *g) {
    mhi_builder *b = &m->b;
    if (!u->has_origin || !u->has_insertion) {
        mhi_build_fail(b, u->line, "muscle '%s' has no %s", u->draft->muscle.name,
                       u->has_origin ? "InsertionPosition" : "OriginPosition");
        return;
    }
    mhi_build_point(b, u->draft, g->origin_parent, u->origin, u->line);
    for (int32_t i = 0; i < m->vias.n; i++) {
        via *v = m->vias.items[i];
        if (v->muscle != NULL && strcmp(v->muscle, u->draft->muscle.name) == 0 &&
            (v->group == NULL || strcmp(v->group, u->group) == 0)) {
            mhi_build_point(b, u->draft, v->parent, v->position, v->line);
            v->used = 1;
        }
    }
    mhi_build_point(b, u->draft, g->insertion_parent, u->insertion, u->line);
}

void mhi_biomod_muscles_finish(mhi_biomod *m) {
    const char **names = MHI_TAKE(&m->b.arena, const char *, m->muscles.n);
    for (int32_t i = 0; i < m->muscles.n && names != NULL && m->b.status == MHE_OK; i++) {
        muscle *u = m->muscles.items[i];
        const group *g = find_group(m, u);
        names[i] = u->draft->muscle.name;
        if (g != NULL) {
            build_path(m, u, g);
        }
    }
    for (int32_t i = 0; i < m->vias.n && names != NULL && m->b.status == MHE_OK; i++) {
        const via *v = m->vias.items[i];
        const char *muscle_name = v->muscle != NULL ? v->muscle : "";
        char hint[256];
        if (!v->used) {
            mhi_build_fail(&m->b, v->line, "via point '%s' is of an unknown muscle '%s'%s", v->name,
                           muscle_name,
                           mhi_suggest(hint, sizeof hint, muscle_name, names, m->muscles.n));
        }
    }
}
