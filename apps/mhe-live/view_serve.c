/* SPDX-License-Identifier: Apache-2.0 */
#include "view_serve.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <unistd.h>

#define CLIENTS 16   /* at once; one more takes the place of the oldest */
#define REQUEST 4096 /* bytes of a request at most */
#define LOOK 200     /* ms between two looks at `stop` */

typedef struct client {
    int socket; /* -1: none */
    char request[REQUEST], head[400];
    size_t n, n_head, sent; /* sent: of head and page together */
    const char *page;
    size_t size;
} client;

static void drop(client *c) {
    (void)close(c->socket);
    c->socket = -1;
}

/* "GET / HTTP/1.1" with a Host that is this machine. */
static int is_for_us(const char *request) {
    const char *end = strstr(request, "\r\n");
    const char *host = request;
    while (host != NULL && strncasecmp(host, "\r\nhost:", 7) != 0) {
        host = strstr(host + 1, "\r\n");
    }
    if (end == NULL || host == NULL) {
        return 0;
    }
    host += 7;
    host += strspn(host, " ");
    const size_t n = strcspn(host, ":\r\n");
    return (n == 9 && strncmp(host, "127.0.0.1", n) == 0) ||
           (n == 9 && strncasecmp(host, "localhost", n) == 0);
}

static void answer(client *c, const char *page, size_t size) {
    const int is_page =
        strncmp(c->request, "GET / ", 6) == 0 || strncmp(c->request, "GET /index.html ", 16) == 0;
    const int ours = is_for_us(c->request);
    c->page = ours && is_page ? page : "";
    c->size = ours && is_page ? size : 0;
    const int n = snprintf(
        c->head, sizeof c->head,
        "HTTP/1.1 %s\r\ncontent-type: text/html; charset=utf-8\r\ncontent-length: %zu\r\n"
        "content-security-policy: default-src 'none'; script-src 'unsafe-inline'; style-src "
        "'unsafe-inline'; img-src data:\r\nconnection: close\r\n\r\n",
        !ours     ? "403 Forbidden"
        : is_page ? "200 OK"
                  : "404 Not Found",
        c->size);
    c->n_head = n > 0 ? (size_t)n : 0;
}

static void take_request(client *c, const char *page, size_t size) {
    const ssize_t n = recv(c->socket, c->request + c->n, sizeof c->request - 1 - c->n, 0);
    if (n <= 0) {
        if (n == 0 || (errno != EAGAIN && errno != EINTR)) {
            drop(c);
        }
        return;
    }
    c->n += (size_t)n;
    c->request[c->n] = '\0';
    const int is_text = strlen(c->request) == c->n;
    if (is_text && strstr(c->request, "\r\n\r\n") != NULL) {
        answer(c, page, size);
    } else if (!is_text || c->n == sizeof c->request - 1) { /* no browser asks for so much */
        drop(c);
    }
}

static void send_more(client *c) {
    const char *at = c->sent < c->n_head ? c->head + c->sent : c->page + (c->sent - c->n_head);
    const size_t left = c->sent < c->n_head ? c->n_head - c->sent : c->n_head + c->size - c->sent;
    const ssize_t n = send(c->socket, at, left, MSG_NOSIGNAL);
    if (n < 0 && errno != EAGAIN && errno != EINTR) {
        drop(c);
        return;
    }
    c->sent += n > 0 ? (size_t)n : 0;
    if (c->sent == c->n_head + c->size) {
        drop(c);
    }
}

static void take_client(int listener, client *clients, int *oldest) {
    const int socket = accept(listener, NULL, NULL);
    if (socket < 0) {
        return;
    }
    int at = -1;
    for (int i = 0; i < CLIENTS && at < 0; i++) {
        at = clients[i].socket < 0 ? i : -1;
    }
    if (at < 0) {
        at = *oldest;
        *oldest = (*oldest + 1) % CLIENTS;
        drop(&clients[at]);
    }
    (void)fcntl(socket, F_SETFL, O_NONBLOCK);
    (void)fcntl(socket, F_SETFD, FD_CLOEXEC);
    clients[at].socket = socket;
    clients[at].n = clients[at].n_head = clients[at].sent = 0;
}

static void serve(int listener, const char *page, size_t size, const volatile sig_atomic_t *stop) {
    static client clients[CLIENTS];
    struct pollfd all[CLIENTS + 1];
    int oldest = 0;
    for (int i = 0; i < CLIENTS; i++) {
        clients[i].socket = -1;
    }
    while (!*stop) {
        all[CLIENTS] = (struct pollfd){.fd = listener, .events = POLLIN};
        for (int i = 0; i < CLIENTS; i++) { /* a negative one is passed over */
            all[i] = (struct pollfd){.fd = clients[i].socket,
                                     .events = clients[i].n_head > 0 ? POLLOUT : POLLIN};
        }
        if (poll(all, CLIENTS + 1, LOOK) <= 0) {
            continue;
        }
        for (int i = 0; i < CLIENTS; i++) {
            if (clients[i].socket >= 0 && all[i].revents != 0) {
                if (clients[i].n_head > 0) {
                    send_more(&clients[i]);
                } else {
                    take_request(&clients[i], page, size);
                }
            }
        }
        if (all[CLIENTS].revents != 0) {
            take_client(listener, clients, &oldest);
        }
    }
    for (int i = 0; i < CLIENTS; i++) {
        if (clients[i].socket >= 0) {
            drop(&clients[i]);
        }
    }
}

mhe_status view_serve(const char *page, size_t size, void (*ready)(const char *address),
                      const volatile sig_atomic_t *stop, mhe_error *err) {
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t length = sizeof here;
    char address[64];
    const int listener = socket(AF_INET, SOCK_STREAM, 0);
    if (listener < 0 || bind(listener, (struct sockaddr *)&here, sizeof here) != 0 ||
        listen(listener, CLIENTS) != 0 ||
        getsockname(listener, (struct sockaddr *)&here, &length) != 0) {
        const mhe_status status =
            mhe_fail(err, MHE_E_IO, "no port of 127.0.0.1 can be listened on: %s", strerror(errno));
        if (listener >= 0) {
            (void)close(listener);
        }
        return status;
    }
    (void)fcntl(listener, F_SETFL, O_NONBLOCK);
    (void)fcntl(listener, F_SETFD, FD_CLOEXEC);
    (void)snprintf(address, sizeof address, "http://127.0.0.1:%d/", (int)ntohs(here.sin_port));
    ready(address);
    serve(listener, page, size, stop);
    (void)close(listener);
    return MHE_OK;
}
