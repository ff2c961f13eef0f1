/* SPDX-License-Identifier: Apache-2.0 */
/* connection.c: the socket to QTM, and packets of it. */
#include "qualisys.h"

#include <errno.h>
#include <math.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

double qualisys_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void qualisys_disconnect(qualisys *s) {
    if (s->socket >= 0) {
        (void)close(s->socket);
    }
    s->socket = -1;
    s->n_bytes = 0;
}

static int wait_for(int fd, short what, double deadline) {
    const double seconds = deadline - qualisys_now();
    struct pollfd p = {.fd = fd, .events = what};
    return poll(&p, 1, seconds <= 0 ? 0 : (int)ceil(1000 * fmin(seconds, 60))) > 0;
}

mhe_status qualisys_connect(qualisys *s, double deadline, mhe_error *err) {
    char port[16];
    struct addrinfo *list = NULL;
    const struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM};
    (void)snprintf(port, sizeof port, "%d", (int)s->config.port);
    if (getaddrinfo(s->config.host, port, &hints, &list) != 0) {
        return mhe_fail(err, MHE_RETRY, "the host '%s' is not known", s->config.host);
    }
    for (const struct addrinfo *a = list; a != NULL && s->socket < 0; a = a->ai_next) {
        s->socket = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        if (s->socket < 0) {
            continue;
        }
        int code = 0;
        socklen_t size = sizeof code;
        if (connect(s->socket, a->ai_addr, a->ai_addrlen) != 0 &&
            (errno != EINPROGRESS || !wait_for(s->socket, POLLOUT, deadline) ||
             getsockopt(s->socket, SOL_SOCKET, SO_ERROR, &code, &size) != 0 || code != 0)) {
            qualisys_disconnect(s);
        }
    }
    freeaddrinfo(list);
    return s->socket >= 0 ? MHE_OK
                          : mhe_fail(err, MHE_RETRY, "no QTM at %s, port %d", s->config.host,
                                     (int)s->config.port);
}

mhe_status qualisys_send(qualisys *s, const char *text, mhe_error *err) {
    uint8_t packet[256];
    const size_t size = rt_write_command(text, packet, sizeof packet);
    size_t done = 0;
    while (done < size) {
        const ssize_t n = send(s->socket, packet + done, size - done, MSG_NOSIGNAL);
        if (n < 0 && (errno != EAGAIN || !wait_for(s->socket, POLLOUT, qualisys_now() + ANSWER))) {
            return mhe_fail(err, MHE_RETRY, "QTM takes no commands");
        }
        done += n > 0 ? (size_t)n : 0;
    }
    return MHE_OK;
}

/* A sender may wait with a small packet until the one before is acknowledged (Nagle), and the
 * system with that for 40 ms: frames would come in clumps. It is acknowledged at once; the system
 * forgets that wish, so it is told each time. */
static void acknowledge(int fd) {
#ifdef TCP_QUICKACK
    const int yes = 1;
    (void)setsockopt(fd, IPPROTO_TCP, TCP_QUICKACK, &yes, sizeof yes);
#else
    (void)fd;
#endif
}

mhe_status qualisys_receive(qualisys *s, double deadline, mhe_error *err) {
    if (s->n_bytes == s->room) {
        uint8_t *grown = s->room >= RT_LARGEST ? NULL : realloc(s->bytes, 2 * s->room);
        if (grown == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        s->bytes = grown;
        s->room *= 2;
    }
    if (!wait_for(s->socket, POLLIN, deadline)) {
        return MHE_OK;
    }
    const ssize_t n = recv(s->socket, s->bytes + s->n_bytes, s->room - s->n_bytes, 0);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
        return mhe_fail(err, MHE_RETRY, "QTM has closed the connection");
    }
    s->n_bytes += n > 0 ? (size_t)n : 0;
    s->received = qualisys_now();
    acknowledge(s->socket);
    return MHE_OK;
}

void qualisys_drop(qualisys *s, size_t used) {
    memmove(s->bytes, s->bytes + used, s->n_bytes - used);
    s->n_bytes -= used;
}

mhe_status qualisys_says(const rt_packet *packet, mhe_status status, mhe_error *err) {
    char text[200];
    size_t n = 0;
    for (; n < packet->length && n + 1 < sizeof text && packet->body[n] != '\0'; n++) {
        const uint8_t c = packet->body[n];
        text[n] = (char)(c < ' ' || c == 127 ? '?' : c);
    }
    text[n] = '\0';
    return mhe_fail(err, status, "QTM says: %s", text);
}

/* Waits for a packet of a type; others are passed over. Its body is valid until
 * qualisys_drop(*used). */
mhe_status qualisys_await(qualisys *s, uint32_t type, double deadline, rt_packet *packet,
                          size_t *used, mhe_error *err) {
    for (;;) {
        mhe_status status = rt_take_packet(s->bytes, s->n_bytes, packet, used, err);
        if (status == MHE_OK && packet->type == type) {
            return MHE_OK;
        }
        if (status == MHE_OK && packet->type == RT_ERROR) {
            return qualisys_says(packet, MHE_RETRY, err);
        }
        if (status == MHE_OK) {
            qualisys_drop(s, *used);
            continue;
        }
        if (status < 0) {
            return status;
        }
        if (qualisys_now() >= deadline) {
            return mhe_fail(err, MHE_RETRY, "QTM does not answer");
        }
        status = qualisys_receive(s, deadline, err);
        if (status != MHE_OK) {
            return status;
        }
    }
}

mhe_status qualisys_ask(qualisys *s, const char *command, uint32_t type, rt_packet *packet,
                        size_t *used, mhe_error *err) {
    const mhe_status status = qualisys_send(s, command, err);
    return status == MHE_OK ? qualisys_await(s, type, qualisys_now() + ANSWER, packet, used, err)
                            : status;
}
