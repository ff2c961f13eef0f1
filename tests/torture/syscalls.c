/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "syscalls.h"

#include <errno.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

static const struct call {
    const char *kind;
    int number;
    int on_descriptor; /* its first argument is one */
} calls[] = {
    {"open", SYS_openat, 0},      {"read", SYS_read, 1},       {"read", SYS_pread64, 1},
    {"write", SYS_write, 1},      {"write", SYS_pwrite64, 1},  {"write", SYS_writev, 1},
    {"rename", SYS_renameat2, 0}, {"rename", SYS_renameat, 0}, {"fsync", SYS_fsync, 1},
    {"fsync", SYS_fdatasync, 1},
};
#define N_CALLS ((int)(sizeof calls / sizeof calls[0]))

/* Hands all calls of the table over. -> listener */
static int install(void) {
    struct sock_filter code[2 * N_CALLS + 2];
    unsigned short n = 0;
    code[n++] =
        (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr));
    for (int i = 0; i < N_CALLS; i++) {
        code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K,
                                                 (uint32_t)calls[i].number, 0, 1);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_USER_NOTIF);
    }
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    const struct sock_fprog program = {.len = n, .filter = code};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) {
        return -1;
    }
    return (int)syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER,
                        &program);
}

union message {
    struct cmsghdr align;
    char bytes[CMSG_SPACE(sizeof(int))];
};

static int send_descriptor(int to, int descriptor) {
    union message control = {.bytes = {0}};
    char byte = 0;
    struct iovec part = {&byte, 1};
    struct msghdr m = {.msg_iov = &part,
                       .msg_iovlen = 1,
                       .msg_control = control.bytes,
                       .msg_controllen = sizeof control.bytes};
    struct cmsghdr *head = CMSG_FIRSTHDR(&m);
    head->cmsg_level = SOL_SOCKET;
    head->cmsg_type = SCM_RIGHTS;
    head->cmsg_len = CMSG_LEN(sizeof(int));
    memcpy(CMSG_DATA(head), &descriptor, sizeof descriptor);
    return sendmsg(to, &m, 0) == 1 ? 0 : -1;
}

static int receive_descriptor(int from) {
    union message control = {.bytes = {0}};
    char byte = 0;
    struct iovec part = {&byte, 1};
    struct msghdr m = {.msg_iov = &part,
                       .msg_iovlen = 1,
                       .msg_control = control.bytes,
                       .msg_controllen = sizeof control.bytes};
    int descriptor = -1;
    if (recvmsg(from, &m, MSG_CMSG_CLOEXEC) == 1 && CMSG_FIRSTHDR(&m) != NULL) {
        memcpy(&descriptor, CMSG_DATA(CMSG_FIRSTHDR(&m)), sizeof descriptor);
    }
    return descriptor;
}

pid_t syscalls_start(char *const argv[], void (*begin)(const void *), const void *data,
                     const syscalls_plan *plan, int *listener) {
    int pair[2];
    *listener = -1;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) {
        return -1;
    }
    const pid_t child = fork();
    if (child == 0) {
        begin(data);
        if (plan->kind != NULL) {
            const int own = install();
            if (own < 0 || send_descriptor(pair[1], own) != 0) {
                _exit(126);
            }
            (void)close(own);
        }
        (void)execv(argv[0], argv);
        _exit(127);
    }
    (void)close(pair[1]);
    if (plan->kind != NULL) {
        *listener = receive_descriptor(pair[0]);
    }
    (void)close(pair[0]);
    return child;
}

static int opens_config(const struct seccomp_notif *call) {
    char path[4096];
    const struct iovec here = {path, sizeof path - 1};
    const long page = sysconf(_SC_PAGESIZE);
    size_t length =
        (size_t)(page - (long)(call->data.args[1] % (uint64_t)page)); /* up to its end */
    length = length < sizeof path - 1 ? length : sizeof path - 1;
    const struct iovec there = {(void *)(uintptr_t)call->data.args[1], length};
    const ssize_t n = process_vm_readv((pid_t)call->pid, &here, 1, &there, 1, 0);
    path[n < 0 ? 0 : n] = '\0';
    const size_t end = strlen(path);
    return end > 5 && strcmp(path + end - 5, ".yaml") == 0;
}

static const struct call *find(const struct seccomp_notif *request) {
    for (int i = 0; i < N_CALLS; i++) {
        if (calls[i].number == request->data.nr) {
            return &calls[i];
        }
    }
    return NULL;
}

static double seconds_now(void) {
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

long syscalls_serve(int listener, const syscalls_plan *plan, double seconds) {
    const double end = seconds_now() + seconds;
    long count = 0;
    int begun = 0;
    for (;;) {
        struct pollfd ready = {.fd = listener, .events = POLLIN};
        const double left = end - seconds_now();
        if (left <= 0 ||
            (poll(&ready, 1, (int)(1e3 * left) + 1) > 0 && !(ready.revents & POLLIN))) {
            return count; /* timed out, or the last one of the program has gone */
        }
        struct seccomp_notif request;
        memset(&request, 0, sizeof request);
        if (!(ready.revents & POLLIN) || ioctl(listener, SECCOMP_IOCTL_NOTIF_RECV, &request) != 0) {
            continue;
        }
        const struct call *call = find(&request);
        begun = begun || (call != NULL && request.data.nr == SYS_openat && opens_config(&request));
        int counted = begun && call != NULL && strcmp(call->kind, plan->kind) == 0 &&
                      !(call->on_descriptor && request.data.args[0] < 3);
        count += counted;
        const int failing =
            counted && plan->k > 0 && (plan->onwards ? count >= plan->k : count == plan->k);
        struct seccomp_notif_resp answer = {.id = request.id};
        answer.error = failing ? -plan->error : 0;
        answer.flags = failing ? 0 : (uint32_t)SECCOMP_USER_NOTIF_FLAG_CONTINUE;
        (void)ioctl(listener, SECCOMP_IOCTL_NOTIF_SEND, &answer);
    }
}
