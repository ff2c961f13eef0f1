/* SPDX-License-Identifier: Apache-2.0 */
/* clones.h: loops that are worth it are compiled twice on x86-64, for any processor and for those
 * with AVX2; the loader of shared objects chooses. Other architectures have their vectors anyway.
 * For static functions: the compiler would export others. Without contraction to fused operations
 * (ISO C) both give the same bits. */
#ifndef MHI_CLONES_H
#define MHI_CLONES_H

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define CLONES_SANITIZED 1 /* the choice would fall before the sanitizer is there */
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define CLONES_SANITIZED 1
#endif
#endif

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(CLONES_SANITIZED)
#define CLONES __attribute__((target_clones("avx2", "default")))
#else
#define CLONES
#endif

#endif
