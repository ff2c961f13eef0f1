/* SPDX-License-Identifier: Apache-2.0 */
/* syscalls.h: a program whose k-th system call of a kind fails. Linux: the calls of the program are
 * handed to this process, which answers them (seccomp user notification). Counted are calls on
 * files, not those on the first three descriptors, from the moment on when the program opens a file
 * that ends in ".yaml". */
#ifndef SYSCALLS_H
#define SYSCALLS_H

#include <sys/types.h>

/* Kinds: "open", "read", "write", "rename", "fsync". */
typedef struct syscalls_plan {
    const char *kind;
    long k;      /* from 1; 0: none fails */
    int onwards; /* and all behind it */
    int error;   /* errno that they fail with */
} syscalls_plan;

/* Starts the program: in the child `begin(data)` is called before exec. -> its process, -1: cannot.
 * `listener`: the descriptor for syscalls_serve. */
pid_t syscalls_start(char *const argv[], void (*begin)(const void *), const void *data,
                     const syscalls_plan *plan, int *listener);
/* Answers until the program has ended or `seconds` are over. -> how many calls were counted. */
long syscalls_serve(int listener, const syscalls_plan *plan, double seconds);

#endif
