/* SPDX-License-Identifier: Apache-2.0 */
/* compat.h: the C interface of Ipopt under one set of names, for 3.11 (Debian 12) to 3.14. */
#ifndef COMPAT_H
#define COMPAT_H

#include <IpStdCInterface.h>
#include <IpoptConfig.h>

/* 3.14 renamed the types and made the truth value a bool. */
#if IPOPT_VERSION_MAJOR > 3 || (IPOPT_VERSION_MAJOR == 3 && IPOPT_VERSION_MINOR >= 14)
typedef ipindex compat_index;
typedef ipnumber compat_number;
typedef bool compat_bool;
#else
typedef Index compat_index;
typedef Number compat_number;
typedef Bool compat_bool;
#define Maximum_WallTime_Exceeded (-5)
#endif

#endif
