/* SPDX-License-Identifier: Apache-2.0 */
/* address.c: where to listen. libwebsockets listens everywhere where it does not find the address
 * that it is told, so it is looked at before, and what came of it after. */
#include "web.h"

#include <errno.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* 0, or why nothing can listen there. */
static int try_to_listen(const struct addrinfo *at) {
    const int yes = 1;
    const int fd = socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    int code = fd < 0 ? errno : 0;
    if (fd >= 0) { /* as libwebsockets: a connection that was closed just now is in nobody's way */
        (void)setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        code = bind(fd, at->ai_addr, at->ai_addrlen) != 0 || listen(fd, 1) != 0 ? errno : 0;
        (void)close(fd);
    }
    return code;
}

mhe_status web_find_address(const char *address, int port, char *numeric, size_t room,
                            mhe_error *err) {
    char service[16];
    struct addrinfo *list = NULL;
    const struct addrinfo hints = {
        .ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE};
    if (if_nametoindex(address) != 0) {
        (void)snprintf(numeric, room, "%s", address);
        return MHE_OK;
    }
    (void)snprintf(service, sizeof service, "%d", port);
    if (getaddrinfo(address, service, &hints, &list) != 0 || list == NULL) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "address: '%.100s' is no address, no interface and no host (127.0.0.1: "
                        "this machine alone; 0.0.0.0: all that can reach it)",
                        address);
    }
    const int code = try_to_listen(list);
    const int named = getnameinfo(list->ai_addr, list->ai_addrlen, numeric, (socklen_t)room, NULL,
                                  0, NI_NUMERICHOST);
    freeaddrinfo(list);
    if (code == EADDRNOTAVAIL) {
        return mhe_fail(err, MHE_E_IO, "address: '%.100s' is none of this machine's", address);
    }
    if (code == EACCES) {
        return mhe_fail(err, MHE_E_IO,
                        "%.100s, port %d: cannot be listened on: ports below 1024 need a right",
                        address, port);
    }
    return code == 0 && named == 0
               ? MHE_OK
               : mhe_fail(err, MHE_E_IO, "%.100s, port %d: cannot be listened on%s%s", address,
                          port, code == EADDRINUSE ? "; is it in use?" : ": ",
                          code == EADDRINUSE ? "" : strerror(code));
}

/* Where one address alone is listened on, another of loopback has the port free. */
int web_is_everywhere(int port) {
    struct sockaddr_in other = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    other.sin_addr.s_addr = htonl(INADDR_LOOPBACK + 0x7f00); /* 127.0.127.1 */
    const struct addrinfo at = {
        .ai_family = AF_INET, .ai_addr = (struct sockaddr *)&other, .ai_addrlen = sizeof other};
    return try_to_listen(&at) == EADDRINUSE;
}
