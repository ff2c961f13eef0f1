/* SPDX-License-Identifier: Apache-2.0 */
/* biomod.h: shared between the parts of the .bioMod reader. */
#ifndef MHI_BIOMOD_H
#define MHI_BIOMOD_H

#include "io/biomod_lex.h"

typedef struct mhi_biomod {
    mhi_builder b;
    mhi_biomod_lex lex;
    int32_t version;
    mhi_list groups, muscles, vias; /* of biomod_muscle.c */
} mhi_biomod;

/* Reads one property of `item`, its tag already taken; 0: the tag is unknown. */
typedef int32_t mhi_biomod_property(mhi_biomod *m, void *item, mhi_word tag);

/* Reads properties of what is called `name` until "end<kind>". Unknown words are skipped with a
 * warning; an unknown block, of which "end<word>" follows, is unsupported. */
void mhi_biomod_block(mhi_biomod *m, const char *kind, const char *name, mhi_word opened,
                      mhi_biomod_property *property, void *item);
/* A word that follows a tag, "root" and "base" turned into ground where no segment has that name.
 */
const char *mhi_biomod_name(mhi_biomod *m, mhi_word tag);
const char *mhi_biomod_parent(mhi_biomod *m, mhi_word tag);
/* Skips what follows a tag that has no mechanical meaning: the rest of the line, then numbers. */
void mhi_biomod_skip(mhi_biomod *m, mhi_word tag);

/* The blocks about muscles; 0: `tag` opens none of them. */
int32_t mhi_biomod_muscle_block(mhi_biomod *m, mhi_word tag);
/* After the last block: puts groups, muscles and via points together. */
void mhi_biomod_muscles_finish(mhi_biomod *m);

#endif
