/* SPDX-License-Identifier: Apache-2.0 */
/* pi.h: pi, and what follows from it. */
#ifndef MHI_PI_H
#define MHI_PI_H

#define MHI_PI 3.14159265358979323846
#define MHI_DEGREES (180 / MHI_PI) /* degrees a radian */

#endif
