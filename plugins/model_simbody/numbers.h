/* SPDX-License-Identifier: Apache-2.0 */
/* numbers.h: coordinates by their numbers, free and dependent alike.
 *
 * A dependent coordinate is a function of one coordinate before it, and so of one free one, its
 * root. Whatever is a function f of a number x(q) is one of the root q:
 *     (f o x)' = f' x',  '' = f'' x'^2 + f' x'',  ''' = f''' x'^3 + 3 f'' x' x'' + f' x'''. */
#ifndef SIMBODY_NUMBERS_H
#define SIMBODY_NUMBERS_H

#include <mhe/description.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Number of the free coordinate that `number` is a function of. */
int32_t number_root(const mhe_description *description, int32_t number);

/* values [4 (n_coordinates + n_dependents)]: of each number, and its three derivatives by its
 * root. */
void numbers_evaluate(const mhe_description *description, const double *q, double *values);

/* out [4] = f(t), f'(t), f''(t), f'''(t) */
void function_evaluate(const mhe_function *function, double t, double *out);

/* out [4] = f o x and its derivatives, of x [4]. */
void function_compose(const mhe_function *function, const double *x, double *out);

#ifdef __cplusplus
}
#endif
#endif
