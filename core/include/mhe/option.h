/* SPDX-License-Identifier: Apache-2.0 */
/* option.h: typed option tables.
 *
 * A plugin declares what its config struct holds; the core parses the YAML, checks type, range and
 * spelling, converts, and fills the struct before any function of the plugin runs. Plugins never
 * parse strings. Values are SI and radians.
 *
 *     struct effort { double rest; const char *signal; };
 *     static const mhe_option effort_options[] = {
 *         MHE_OPT_REAL(struct effort, rest, 0.0, 0.0, 1.0, "1", "Activation that costs nothing."),
 *         MHE_OPT_TEXT(struct effort, signal, 0, "activation", "Model signal to penalise."),
 *     };
 *
 * The macros check the field's type at compile time. */
#ifndef MHE_OPTION_H
#define MHE_OPTION_H

#include <mhe/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Types of an option, with the C type of the field it fills. */
#define MHE_TYPE_REAL 1 /* double */
#define MHE_TYPE_INT 2  /* int32_t */
#define MHE_TYPE_BOOL 3 /* int32_t, 0 or 1; YAML true/false/yes/no/on/off */
#define MHE_TYPE_TEXT 4 /* const char * */
#define MHE_TYPE_ENUM 5 /* int32_t: position in `choices` */
#define MHE_TYPE_PATH \
    6 /* const char *: resolved against the folder of the config file; NULL if absent */
#define MHE_TYPE_REAL_LIST 7 /* mhe_real_list */
#define MHE_TYPE_TEXT_LIST 8 /* mhe_text_list */
#define MHE_TYPE_TEXT_MAP 9  /* mhe_text_map: key -> text, in the order of the file */

/* Flags of an option. */
#define MHE_OPT_REQUIRED 1u   /* no default: the config must hold the key */
#define MHE_OPT_ADVANCED 2u   /* left out of short descriptions */
#define MHE_OPT_DEPRECATED 4u /* still works; `replaced_by` names the new key */

/* Lists are owned by the core and live as long as the config struct. n may be 0. */
typedef struct mhe_real_list {
    const double *values;
    int32_t n;
} mhe_real_list;

typedef struct mhe_text_list {
    const char *const *values;
    int32_t n;
} mhe_text_list;

typedef struct mhe_text_map {
    const char *const *keys;
    const char *const *values;
    int32_t n;
} mhe_text_map;

typedef struct mhe_option {
    const char *key;          /* as written in YAML: lower case, words joined by '_' */
    const char *help;         /* one sentence */
    const char *unit;         /* "1" means dimensionless; NULL for types without a unit */
    const char *choices;      /* enum: "gauss|rk4"; else NULL */
    const char *text_default; /* text, path, enum (the choice); NULL = empty */
    const char *replaced_by;  /* deprecated options; else NULL */
    double real_default;      /* real, int, bool */
    double min, max;          /* inclusive; real, int, and each value of a real list */
    uint32_t type;            /* MHE_TYPE_* */
    uint32_t flags;           /* MHE_OPT_* */
    uint32_t offset;          /* of the field in the config struct [bytes] */
} mhe_option;

#ifndef __cplusplus
/* Position of `field`, refused by the compiler unless the field has exactly the type `ctype`. */
#define MHE_OPT_OFFSET(T, field, ctype) \
    ((uint32_t)(offsetof(T, field) + 0u * sizeof(_Generic(&((T *)0)->field, ctype * : 1))))

#define MHE_OPT_REAL(T, field, dflt, lo, hi, unit_, help_)                                       \
    {                                                                                            \
        .key = #field, .help = help_, .unit = unit_, .real_default = dflt, .min = lo, .max = hi, \
        .type = MHE_TYPE_REAL, .offset = MHE_OPT_OFFSET(T, field, double)                        \
    }
#define MHE_OPT_INT(T, field, dflt, lo, hi, unit_, help_)                                        \
    {                                                                                            \
        .key = #field, .help = help_, .unit = unit_, .real_default = dflt, .min = lo, .max = hi, \
        .type = MHE_TYPE_INT, .offset = MHE_OPT_OFFSET(T, field, int32_t)                        \
    }
#define MHE_OPT_BOOL(T, field, dflt, help_)                                     \
    {                                                                           \
        .key = #field, .help = help_, .real_default = dflt, .min = 0, .max = 1, \
        .type = MHE_TYPE_BOOL, .offset = MHE_OPT_OFFSET(T, field, int32_t)      \
    }
#define MHE_OPT_TEXT(T, field, flags_, dflt, help_)                                \
    {                                                                              \
        .key = #field, .help = help_, .text_default = dflt, .type = MHE_TYPE_TEXT, \
        .flags = flags_, .offset = MHE_OPT_OFFSET(T, field, const char *)          \
    }
#define MHE_OPT_ENUM(T, field, dflt, choices_, help_)                            \
    {                                                                            \
        .key = #field, .help = help_, .choices = choices_, .text_default = dflt, \
        .type = MHE_TYPE_ENUM, .offset = MHE_OPT_OFFSET(T, field, int32_t)       \
    }
#define MHE_OPT_PATH(T, field, flags_, help_)                                 \
    {                                                                         \
        .key = #field, .help = help_, .type = MHE_TYPE_PATH, .flags = flags_, \
        .offset = MHE_OPT_OFFSET(T, field, const char *)                      \
    }
#define MHE_OPT_REALS(T, field, flags_, lo, hi, unit_, help_)              \
    {                                                                      \
        .key = #field, .help = help_, .unit = unit_, .min = lo, .max = hi, \
        .type = MHE_TYPE_REAL_LIST, .flags = flags_,                       \
        .offset = MHE_OPT_OFFSET(T, field, mhe_real_list)                  \
    }
#define MHE_OPT_TEXTS(T, field, flags_, help_)                                     \
    {                                                                              \
        .key = #field, .help = help_, .type = MHE_TYPE_TEXT_LIST, .flags = flags_, \
        .offset = MHE_OPT_OFFSET(T, field, mhe_text_list)                          \
    }
#define MHE_OPT_MAP(T, field, flags_, help_)                                      \
    {                                                                             \
        .key = #field, .help = help_, .type = MHE_TYPE_TEXT_MAP, .flags = flags_, \
        .offset = MHE_OPT_OFFSET(T, field, mhe_text_map)                          \
    }
#endif

#ifdef __cplusplus
}
#endif
#endif
