/* SPDX-License-Identifier: Apache-2.0 */
#include "qtm_server.h"

#include <arpa/inet.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define CLIENTS 4
#define FRAME_TIME 2000000 /* ns between two frames */

typedef struct client {
    int fd, streaming, announced, analog;
    int64_t frame;
} client;

struct qtm_server {
    int listener;
    int32_t port;
    atomic_int what, stop;
    pthread_t thread;
    client clients[CLIENTS];
};

float qtm_marker(int64_t k, int32_t i, int32_t a) {
    return i == 1 && k % 7 == 0 ? NAN : (float)(100 * (i + 1) + 10 * a) + 0.25F * (float)(k % 100);
}

float qtm_analog(int64_t n, int32_t c) {
    return 0.5F * (float)(c + 1) + 0.001953125F * (float)(n % 512);
}

/* ---- packets ---- */

typedef struct packet {
    uint8_t bytes[8192];
    size_t n;
} packet;

static void put(packet *p, uint64_t value, size_t bytes) {
    for (size_t i = 0; i < bytes; i++) {
        p->bytes[p->n++] = (uint8_t)(value >> (8 * i));
    }
}

static void put_float(packet *p, float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put(p, bits, 4);
}

static void set_size(packet *p, size_t at, size_t size) {
    for (size_t i = 0; i < 4; i++) {
        p->bytes[at + i] = (uint8_t)(size >> (8 * i));
    }
}

static void send_all(client *c, const packet *p) {
    if (send(c->fd, p->bytes, p->n, MSG_NOSIGNAL) != (ssize_t)p->n) {
        (void)shutdown(c->fd, SHUT_RDWR); /* a client that does not read is left alone */
    }
}

static void send_text(client *c, uint32_t type, const char *text) {
    packet p = {.n = 0};
    const size_t n = strlen(text) + 1;
    put(&p, 8 + n, 4);
    put(&p, type, 4);
    memcpy(p.bytes + p.n, text, n);
    p.n += n;
    send_all(c, &p);
}

static void send_parameters(client *c, int what) {
    const char *second = what == QTM_OTHER ? "C" : "B";
    char xml[2048], label[256] = "";
    if (what != QTM_FEWER && what != QTM_BARE) {
        (void)snprintf(label, sizeof label,
                       "<Label><Name>%s</Name><RGBColor>255</RGBColor></Label>", second);
    }
    (void)snprintf(
        xml, sizeof xml,
        "<QTM_Parameters_Ver_1.22><General><Frequency>100</Frequency></General>"
        "<The_3D><AxisUpwards>+Z</AxisUpwards><Labels>%d</Labels>%s%s</The_3D>"
        "<Analog><Device><Device_ID>1</Device_ID><Device_Name>EMG box</Device_Name>"
        "<Channels>2</Channels><Frequency>%d</Frequency><Unit>V</Unit><Range><Min>-5</Min><Max>5"
        "</Max></Range><Channel><Label>Biceps</Label><Unit>V</Unit></Channel><Channel><Label>"
        "Triceps</Label><Unit>V</Unit></Channel></Device></Analog></QTM_Parameters_Ver_1.22>",
        what == QTM_FEWER ? 1 : 2,
        what == QTM_BARE ? "" : "<Label><Name>A</Name><RGBColor>255</RGBColor></Label>", label,
        what == QTM_SPEED ? 1000 : 500);
    send_text(c, 2, what == QTM_BAD_XML ? "<QTM_Parameters" : xml);
}

static void send_frame(client *c, int what) {
    packet p = {.n = 0};
    if (what == QTM_BACK && c->frame >= 20) {
        c->frame = 0; /* again and again */
    }
    const int64_t k = c->frame++;
    const int32_t n_markers = what == QTM_FEWER ? 1 : what == QTM_UNLIKE ? 3 : 2;
    const int32_t samples = what == QTM_SPEED ? 2 * QTM_SAMPLES : QTM_SAMPLES;
    const int analog = c->analog && !(what == QTM_LOSE && k % 2 == 1);
    put(&p, 0, 4);
    put(&p, 3, 4);
    put(&p, (uint64_t)(10000 * k), 8);
    put(&p, (uint64_t)k, 4);
    put(&p, analog ? 2 : 1, 4);
    put(&p, (uint64_t)(16 + 12 * n_markers) + (what == QTM_SIZE ? 1 << 20 : 0), 4);
    put(&p, what == QTM_2D ? 7 : 1, 4);
    put(&p, (uint64_t)n_markers + (what == QTM_CUT ? 1000 : 0), 4);
    put(&p, 0, 4);
    for (int32_t i = 0; i < 3 * n_markers; i++) {
        put_float(&p, qtm_marker(k, i / 3, i % 3));
    }
    if (analog) {
        put(&p, (uint64_t)(28 + 8 * samples), 4);
        put(&p, 3, 4);
        put(&p, 1, 4);
        put(&p, 1, 4);
        put(&p, 2, 4);
        put(&p, (uint64_t)samples, 4);
        put(&p, (uint64_t)(k * samples), 4);
        for (int32_t i = 0; i < 2 * samples; i++) {
            put_float(&p, qtm_analog(k * samples + i % samples, i / samples));
        }
    }
    set_size(&p, 0, p.n);
    if (what == QTM_AMID) {
        p.n /= 2;
    }
    send_all(c, &p);
}

static void send_once(client *c, int what) {
    packet p = {.n = 0};
    if (what == QTM_GARBAGE) {
        send_text(c, 77, "HTTP/1.1 400 Bad Request");
    } else if (what == QTM_HUGE) {
        put(&p, 0xffffffffu, 4);
        put(&p, 3, 4);
        send_all(c, &p);
    } else if (what == QTM_SAYS) {
        send_text(c, 0, "Out of\nlicences");
    } else if (what == QTM_AMID) {
        send_frame(c, what);
    } else if (what == QTM_OTHER || what == QTM_SPEED || what == QTM_BARE) {
        put(&p, 9, 4);
        put(&p, 6, 4);
        put(&p, 11, 1);
        send_all(c, &p);
    } else if (what == QTM_END) {
        put(&p, 8, 4);
        put(&p, 4, 4);
        send_all(c, &p);
    }
}

/* ---- clients ---- */

static void answer(client *c, const char *command, int what) {
    if (strncmp(command, "Version", 7) == 0) {
        send_text(c, 1, what == QTM_OLD ? "Version NOT supported" : "Version set to 1.22");
    } else if (strncmp(command, "GetParameters", 13) == 0) {
        send_parameters(c, what);
    } else if (strncmp(command, "StreamFrames Stop", 17) == 0) {
        c->streaming = 0;
    } else if (strncmp(command, "StreamFrames", 12) == 0) {
        c->streaming = 1;
        c->analog = strstr(command, "Analog") != NULL;
    } else {
        send_text(c, 0, "Parse error");
    }
}

static void drop(client *c) {
    (void)close(c->fd);
    *c = (client){.fd = -1};
}

static void listen_to(client *c, int what) {
    char bytes[1024] = "";
    const ssize_t n = recv(c->fd, bytes, sizeof bytes - 1, MSG_DONTWAIT);
    if (n == 0) {
        drop(c);
    }
    for (ssize_t at = 0; at + 8 < n;) { /* commands are short and come whole, over loopback */
        uint32_t size;
        memcpy(&size, bytes + at, 4);
        if (size < 8 || size > (size_t)(n - at)) {
            break;
        }
        char command[256] = "";
        memcpy(command, bytes + at + 8, size - 8 < 255 ? size - 8 : 255);
        answer(c, command, what);
        at += size;
    }
}

static void send_welcome(client *c, int what) {
    static const char text[] = "QTM RT Interface connected";
    packet p = {.n = 0};
    if (what != QTM_TURNED) {
        send_text(c, 1, text);
        return;
    }
    for (size_t i = 0; i < 8; i++) { /* size and type, the high byte first */
        put(&p, i == 3 ? 8 + sizeof text : i == 7, 1);
    }
    memcpy(p.bytes + p.n, text, sizeof text);
    p.n += sizeof text;
    send_all(c, &p);
}

static void accept_client(qtm_server *s, int what) {
    const int fd = accept(s->listener, NULL, NULL);
    for (int32_t i = 0; i < CLIENTS && fd >= 0; i++) {
        if (s->clients[i].fd < 0) {
            s->clients[i] = (client){.fd = fd, .announced = QTM_STREAM};
            send_welcome(&s->clients[i], what);
            return;
        }
    }
    if (fd >= 0) {
        (void)close(fd);
    }
}

static void serve(qtm_server *s, client *c, int what) {
    if (what == QTM_CLOSE) {
        drop(c);
        return;
    }
    listen_to(c, what);
    if (c->fd < 0 || !c->streaming || what == QTM_PAUSE) {
        return;
    }
    if (c->announced != what) {
        c->announced = what;
        send_once(c, what);
    } else if (what != QTM_GARBAGE && what != QTM_HUGE && what != QTM_END && what != QTM_AMID) {
        send_frame(c, what);
    }
    (void)s;
}

static void *work(void *data) {
    qtm_server *s = data;
    const struct timespec pause = {0, FRAME_TIME};
    while (!atomic_load(&s->stop)) {
        const int what = atomic_load(&s->what);
        struct pollfd p = {.fd = s->listener, .events = POLLIN};
        if (what != QTM_CLOSE && poll(&p, 1, 0) > 0) {
            accept_client(s, what);
        }
        for (int32_t i = 0; i < CLIENTS; i++) {
            if (s->clients[i].fd >= 0) {
                serve(s, &s->clients[i], what);
            }
        }
        (void)nanosleep(&pause, NULL);
    }
    return NULL;
}

qtm_server *qtm_server_start(int32_t port) {
    qtm_server *s = calloc(1, sizeof *s);
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    socklen_t size = sizeof at;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (s == NULL) {
        return NULL;
    }
    const int yes = 1;
    s->listener = socket(AF_INET, SOCK_STREAM, 0);
    (void)setsockopt(s->listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    for (int32_t i = 0; i < CLIENTS; i++) {
        s->clients[i].fd = -1;
    }
    if (bind(s->listener, (struct sockaddr *)&at, size) != 0 || listen(s->listener, 4) != 0 ||
        getsockname(s->listener, (struct sockaddr *)&at, &size) != 0) {
        (void)close(s->listener);
        free(s);
        return NULL;
    }
    s->port = ntohs(at.sin_port);
    if (pthread_create(&s->thread, NULL, work, s) != 0) {
        (void)close(s->listener);
        free(s);
        return NULL;
    }
    return s;
}

int32_t qtm_server_port(const qtm_server *s) {
    return s->port;
}

void qtm_server_set(qtm_server *s, int what) {
    atomic_store(&s->what, what);
}

void qtm_server_stop(qtm_server *s) {
    if (s == NULL) {
        return;
    }
    atomic_store(&s->stop, 1);
    (void)pthread_join(s->thread, NULL);
    for (int32_t i = 0; i < CLIENTS; i++) {
        if (s->clients[i].fd >= 0) {
            (void)close(s->clients[i].fd);
        }
    }
    (void)close(s->listener);
    free(s);
}
