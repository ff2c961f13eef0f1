/* SPDX-License-Identifier: Apache-2.0 */
/* biomod.c: .bioMod reader (biorbd, versions 1 to 4): header, segments, markers. */
#include "io/biomod.h"
#include "base/number.h"
#include "base/pi.h"
#include "io/model_file.h"

#include <ctype.h>
#include <math.h>
#include <string.h>
#include <strings.h>

#define MAX_SEQUENCE 3
#define RANGES (2 * 2 * MAX_SEQUENCE)

typedef struct segment {
    mhi_body_draft *draft;
    mhi_word opened;
    const char *translations, *rotations; /* NULL: none */
    int32_t in_matrix;
    double ranges[RANGES];
    int32_t n_ranges, ranges_line; /* line 0: none given */
} segment;

static int32_t one_of(const char *word, const char *const *words, size_t n) {
    for (size_t i = 0; i < n; i++) {
        if (mhi_same_word(word, words[i])) {
            return 1;
        }
    }
    return 0;
}
#define ONE_OF(word, words) one_of((word), (words), sizeof(words) / sizeof *(words))

const char *mhi_biomod_name(mhi_biomod *m, mhi_word tag) {
    mhi_word word = mhi_lex_next(&m->lex);
    if (*word.text == '\0') {
        mhi_build_fail(&m->b, tag.line, "'%s' needs a name", tag.text);
    }
    return word.text;
}

const char *mhi_biomod_parent(mhi_biomod *m, mhi_word tag) {
    const char *name = mhi_biomod_name(m, tag);
    static const char *const grounds[] = {"root", "base"};
    if (!ONE_OF(name, grounds)) {
        return name;
    }
    for (int32_t i = 0; i < m->b.bodies.n; i++) {
        if (strcmp(((mhi_body_draft *)m->b.bodies.items[i])->body.name, name) == 0) {
            return name;
        }
    }
    return NULL;
}

void mhi_biomod_skip(mhi_biomod *m, mhi_word tag) {
    while (mhi_lex_peek(&m->lex).line == tag.line && *mhi_lex_peek(&m->lex).text != '\0') {
        (void)mhi_lex_next(&m->lex);
    }
    (void)mhi_lex_all_numbers(&m->lex, NULL, 0);
}

/* Steps behind "end<kind>", which is there. */
static void skip_to_end(mhi_biomod *m, const char *kind) {
    while (!mhi_lex_ends(mhi_lex_next(&m->lex).text, kind)) {
    }
}

/* A word that means nothing here: it opens a block, or numbers follow. */
static void skip_unknown(mhi_biomod *m, mhi_word word, const char *kind, const char *name) {
    if (mhi_lex_has_end(&m->lex, word.text, kind)) {
        mhi_build_unsupported(&m->b, word.line, "%s of %s '%s'", word.text, kind, name);
        skip_to_end(m, word.text);
        return;
    }
    mhi_build_warn(&m->b, word.line, "unknown word '%s' skipped", word.text);
    (void)mhi_lex_all_numbers(&m->lex, NULL, 0);
}

void mhi_biomod_block(mhi_biomod *m, const char *kind, const char *name, mhi_word opened,
                      mhi_biomod_property *property, void *item) {
    while (m->b.status == MHE_OK) {
        mhi_word word = mhi_lex_next(&m->lex);
        if (mhi_lex_ends(word.text, kind)) {
            return;
        }
        if (*word.text == '\0' || mhi_same_word(word.text, "segment") ||
            strncasecmp(word.text, "end", 3) == 0) {
            mhi_build_fail(&m->b, word.line, "the %s of line %d has no end%s", kind,
                           (int)opened.line, kind);
        } else if (!property(m, item, word)) {
            skip_unknown(m, word, kind, name);
        }
    }
}

/* "rt": angles, sequence and translation, or 4 rows (3 will do) of a matrix. */
static void read_transform(mhi_biomod *m, segment *s, mhi_word tag) {
    mhe_body *body = &s->draft->body;
    double numbers[12], last_row[4];
    if (s->in_matrix) {
        if (!mhi_lex_numbers(&m->lex, tag.text, numbers, 12)) {
            return;
        }
        for (int i = 0; i < 3; i++) {
            memcpy(&body->joint_r[3 * i], &numbers[4 * i], 3 * sizeof *numbers);
            body->joint_p[i] = numbers[4 * i + 3];
        }
        int32_t rest = mhi_lex_all_numbers(&m->lex, last_row, 4);
        if ((rest != 0 && rest != 4) || (rest == 4 && (last_row[0] != 0 || last_row[1] != 0 ||
                                                       last_row[2] != 0 || last_row[3] != 1))) {
            mhi_build_fail(&m->b, tag.line, "the matrix of '%s' does not end with 0 0 0 1",
                           body->name);
        }
        return;
    }
    if (!mhi_lex_numbers(&m->lex, tag.text, numbers, 3)) {
        return;
    }
    mhi_word word = mhi_lex_next(&m->lex);
    char sequence[4] = "";
    for (size_t i = 0; i < 3 && strlen(word.text) == 3; i++) {
        sequence[i] = (char)tolower((unsigned char)word.text[i]);
    }
    if (strspn(sequence, "xyz") != 3) {
        mhi_build_fail(&m->b, word.line, "'%s' is no sequence of three axes such as xyz",
                       word.text);
        return;
    }
    mhi_rotation_sequence(sequence, numbers, body->joint_r);
    (void)mhi_lex_numbers(&m->lex, tag.text, body->joint_p, 3);
}

/* "translations xyz", "rotations yxy": lower case copy; NULL after an error. */
static const char *read_axes(mhi_biomod *m, const segment *s, mhi_word tag) {
    mhi_word word = mhi_lex_next(&m->lex);
    char *axes = mhi_arena_text(&m->b.arena, word.text);
    for (char *c = axes; c != NULL && *c != '\0'; c++) {
        *c = (char)tolower((unsigned char)*c);
    }
    if (axes != NULL && strcmp(axes, "q") == 0) {
        mhi_build_unsupported(&m->b, tag.line, "quaternion rotations of segment '%s'",
                              s->draft->body.name);
        return NULL;
    }
    if (axes != NULL && (axes[strspn(axes, "xyz")] != '\0' || strlen(axes) > MAX_SEQUENCE)) {
        mhi_build_fail(&m->b, word.line, "'%s %s': up to %d of the axes x, y, z are possible",
                       tag.text, word.text, MAX_SEQUENCE);
        return NULL;
    }
    return axes;
}

static int32_t segment_number(mhi_biomod *m, segment *s, mhi_word tag) {
    mhe_body *body = &s->draft->body;
    double diagonal[3] = {0};
    if (mhi_same_word(tag.text, "mass")) {
        (void)mhi_lex_numbers(&m->lex, tag.text, &body->mass, 1);
    } else if (mhi_same_word(tag.text, "com") || mhi_same_word(tag.text, "centerofmass")) {
        (void)mhi_lex_numbers(&m->lex, tag.text, body->com, 3);
    } else if (mhi_same_word(tag.text, "inertia") || mhi_same_word(tag.text, "inertiamatrix")) {
        (void)mhi_lex_numbers(&m->lex, tag.text, body->inertia, 9);
    } else if (mhi_same_word(tag.text, "inertia_xxyyzz")) {
        (void)mhi_lex_numbers(&m->lex, tag.text, diagonal, 3);
        for (int i = 0; i < 3; i++) {
            body->inertia[4 * i] = diagonal[i];
        }
    } else {
        return 0;
    }
    return 1;
}

static int32_t segment_property(mhi_biomod *m, void *item, mhi_word tag) {
    static const char *const silent[] = {
        "mesh",  "meshfile",   "meshcolor",          "meshscale",  "meshrt",
        "patch", "forceplate", "externalforceindex", "rangesqdot", "rangesqddot"};
    segment *s = item;
    double in_matrix;
    if (mhi_same_word(tag.text, "parent")) {
        s->draft->parent = mhi_biomod_parent(m, tag);
    } else if (mhi_same_word(tag.text, "rtinmatrix")) {
        if (mhi_lex_numbers(&m->lex, tag.text, &in_matrix, 1)) {
            s->in_matrix = in_matrix != 0;
        }
    } else if (mhi_same_word(tag.text, "rt")) {
        read_transform(m, s, tag);
    } else if (mhi_same_word(tag.text, "translations")) {
        s->translations = read_axes(m, s, tag);
    } else if (mhi_same_word(tag.text, "rotations")) {
        s->rotations = read_axes(m, s, tag);
    } else if (mhi_same_word(tag.text, "ranges") || mhi_same_word(tag.text, "rangesq")) {
        s->n_ranges = mhi_lex_all_numbers(&m->lex, s->ranges, RANGES);
        s->ranges_line = tag.line;
    } else if (mhi_same_word(tag.text, "jointdampings")) {
        mhi_build_unsupported(&m->b, tag.line, "joint damping of segment '%s'",
                              s->draft->body.name);
        mhi_biomod_skip(m, tag);
    } else if (ONE_OF(tag.text, silent)) {
        mhi_biomod_skip(m, tag);
    } else {
        return segment_number(m, s, tag);
    }
    return 1;
}

/* One coordinate a letter, named "Arm_RotY", "Arm_RotY2" when the letter comes again. */
static void add_coordinates(mhi_biomod *m, segment *s, int32_t kind, const char *axes) {
    mhi_builder *b = &m->b;
    for (int32_t i = 0; axes != NULL && axes[i] != '\0'; i++) {
        int32_t again = 1;
        for (int32_t k = 0; k < i; k++) {
            again += axes[k] == axes[i];
        }
        const char *what = kind == MHE_MOTION_ROTATION ? "Rot" : "Trans";
        char number[16] = "";
        if (again > 1) {
            (void)snprintf(number, sizeof number, "%d", (int)again);
        }
        const char *name = mhi_arena_format(&b->arena, "%s_%s%c%s", s->draft->body.name, what,
                                            toupper((unsigned char)axes[i]), number);
        int32_t at = b->coordinates.n;
        mhi_coordinate_draft *draft = mhi_build_coordinate(b, name, s->opened.line);
        if (name == NULL || draft == NULL) {
            b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
            return;
        }
        if (kind == MHE_MOTION_ROTATION) {
            draft->coordinate.rotational = 1;
            draft->coordinate.lower = -MHI_PI;
            draft->coordinate.upper = MHI_PI;
        }
        const double axis[3] = {axes[i] == 'x', axes[i] == 'y', axes[i] == 'z'};
        mhi_build_motion(b, s->draft, kind, at, axis, mhi_function_identity(b), s->opened.line);
    }
}

static void set_ranges(mhi_biomod *m, const segment *s, int32_t first) {
    mhi_builder *b = &m->b;
    int32_t n = b->coordinates.n - first;
    if (s->ranges_line == 0 || b->status != MHE_OK) {
        return;
    }
    if (s->n_ranges < 2 * n) {
        mhi_build_fail(b, s->ranges_line,
                       "segment '%s' has %d degrees of freedom: %d numbers, "
                       "not %d",
                       s->draft->body.name, (int)n, (int)(2 * n), (int)s->n_ranges);
        return;
    }
    if (s->n_ranges > 2 * n) {
        mhi_build_warn(b, s->ranges_line,
                       "segment '%s' has %d degrees of freedom: %d ranges too "
                       "many",
                       s->draft->body.name, (int)n, (int)(s->n_ranges + 1) / 2 - (int)n);
    }
    for (int32_t i = 0; i < n; i++) {
        mhi_coordinate_draft *draft = b->coordinates.items[first + i];
        draft->coordinate.lower = s->ranges[2 * i];
        draft->coordinate.upper = s->ranges[2 * i + 1];
    }
}

static void read_segment(mhi_biomod *m, mhi_word tag) {
    segment s = {.opened = tag, .in_matrix = m->version < 3};
    s.draft = mhi_build_body(&m->b, mhi_biomod_name(m, tag), NULL, tag.line);
    if (s.draft == NULL) {
        return;
    }
    s.draft->body.mass = 1e-5;
    mhi_biomod_block(m, "segment", s.draft->body.name, tag, segment_property, &s);
    int32_t first = m->b.coordinates.n;
    add_coordinates(m, &s, MHE_MOTION_TRANSLATION, s.translations);
    add_coordinates(m, &s, MHE_MOTION_ROTATION, s.rotations);
    set_ranges(m, &s, first);
}

typedef struct marker {
    const char *name, *parent;
    double position[3];
} marker;

static int32_t marker_property(mhi_biomod *m, void *item, mhi_word tag) {
    static const char *const silent[] = {"technical", "anatomical"};
    marker *k = item;
    if (mhi_same_word(tag.text, "parent")) {
        k->parent = mhi_biomod_parent(m, tag);
    } else if (mhi_same_word(tag.text, "position")) {
        (void)mhi_lex_numbers(&m->lex, tag.text, k->position, 3);
    } else if (mhi_same_word(tag.text, "axestoremove")) {
        mhi_build_warn(&m->b, tag.line,
                       "axestoremove of marker '%s' is not followed: all three axes are tracked",
                       k->name);
        mhi_biomod_skip(m, tag);
    } else if (ONE_OF(tag.text, silent)) {
        mhi_biomod_skip(m, tag);
    } else {
        return 0;
    }
    return 1;
}

static void read_marker(mhi_biomod *m, mhi_word tag) {
    marker k = {0};
    const char *name = mhi_biomod_name(m, tag);
    k.name = name;
    mhi_biomod_block(m, "marker", name, tag, marker_property, &k);
    mhi_build_marker(&m->b, name, k.parent, k.position, tag.line);
}

static void read_variables(mhi_biomod *m, mhi_word tag) {
    while (m->b.status == MHE_OK) {
        mhi_word word = mhi_lex_next(&m->lex);
        if (mhi_same_word(word.text, "endvariables")) {
            return;
        }
        mhi_variable *v = NULL;
        if (*word.text == '$') {
            v = mhi_build_push(&m->b, &m->lex.variables, sizeof *v);
        } else {
            mhi_build_fail(&m->b, word.line, "variables of line %d: '%s' is no $name",
                           (int)tag.line, word.text);
        }
        if (v != NULL) {
            v->name = "$"; /* not its own name while its value is read */
            (void)mhi_lex_numbers(&m->lex, word.text, &v->value, 1);
            v->name = word.text;
        }
    }
}

/* A block of the top level that a description cannot carry: any word whose end follows. */
static int32_t skip_unsupported(mhi_biomod *m, mhi_word tag) {
    static const char *const blocks[] = {"wrapping",       "imu",      "mimu",          "contact",
                                         "softcontact",    "ligament", "passivetorque", "actuator",
                                         "loopconstraint", "customrt"};
    const int32_t ended = mhi_lex_has_end(&m->lex, tag.text, "");
    if (!ended && !ONE_OF(tag.text, blocks)) {
        return 0;
    }
    const char *name = mhi_biomod_name(m, tag);
    if (!ended) {
        mhi_build_fail(&m->b, tag.line, "the %s of line %d has no end%s", tag.text, (int)tag.line,
                       tag.text);
        return 1;
    }
    if (!mhi_lex_ends(name, tag.text)) {
        skip_to_end(m, tag.text);
    }
    if (mhi_same_word(tag.text, "customrt")) { /* a named frame: nothing moves by it */
        mhi_build_warn(&m->b, tag.line, "customrt '%s' is passed over: nothing moves by it", name);
    } else {
        mhi_build_unsupported(&m->b, tag.line, "%s '%s'", tag.text, name);
    }
    return 1;
}

static void read_all(mhi_biomod *m) {
    static const char *const silent[] = {"root_actuated", "external_forces", "externalforces"};
    mhi_word tag = mhi_lex_next(&m->lex);
    double version = 0;
    if (!mhi_same_word(tag.text, "version") || !mhi_lex_numbers(&m->lex, tag.text, &version, 1) ||
        version < 1 || version > 4) {
        mhi_build_fail(
            &m->b, tag.line,
            "neither an .osim (XML) nor a .bioMod, which begins with 'version 1' to 'version 4'");
    }
    m->version = m->b.status == MHE_OK ? (int32_t)version : 0;
    while (m->b.status == MHE_OK && *(tag = mhi_lex_next(&m->lex)).text != '\0') {
        if (mhi_same_word(tag.text, "segment")) {
            read_segment(m, tag);
        } else if (mhi_same_word(tag.text, "marker")) {
            read_marker(m, tag);
        } else if (mhi_same_word(tag.text, "gravity")) {
            (void)mhi_lex_numbers(&m->lex, tag.text, m->b.gravity, 3);
        } else if (mhi_same_word(tag.text, "variables")) {
            read_variables(m, tag);
        } else if (ONE_OF(tag.text, silent)) {
            mhi_biomod_skip(m, tag);
        } else if (!mhi_biomod_muscle_block(m, tag) && !skip_unsupported(m, tag)) {
            mhi_build_warn(&m->b, tag.line, "unknown word '%s' skipped", tag.text);
            (void)mhi_lex_all_numbers(&m->lex, NULL, 0);
        }
    }
}

mhe_status mhi_biomod_parse(const char *name, const char *text, size_t length,
                            mhe_description **description, mhe_error *err) {
    mhi_biomod m = {0};
    mhi_c_locale saved = mhi_c_locale_begin();
    mhi_build_start(&m.b, name, err);
    m.b.gravity[2] = -9.81;
    mhi_lex_start(&m.lex, &m.b, text, length);
    if (m.b.status == MHE_OK) {
        read_all(&m);
    }
    if (m.b.status == MHE_OK) {
        mhi_biomod_muscles_finish(&m);
    }
    mhi_c_locale_end(saved);
    return mhi_build_finish(&m.b, description);
}
