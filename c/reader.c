/* reader.c: reads the ports of boards in a thread of its own, for py/contactfpga/driver/native.py.
 *
 * One thread reads all ports of a process. A caller that waits for a port reads that port itself, which saves a change of
 * threads. The reader notes when bytes came, decodes packets that are whole frames of a known sheet, and keeps both in
 * rings, of which the oldest reads are overwritten. Packets that only Python decodes wait in the system's buffer instead
 * (held_back). The meaning of a packet is left to the Python driver, which takes what came when it likes. Meanwhile the
 * newest frame can be read as long as every packet since continues the frame before it, as the driver would find (struct
 * base).
 *
 * C99 and POSIX threads. All memory is allocated in cfpga_open. Every function may be called by several threads.
 */
#define _GNU_SOURCE /* ppoll */
#define _DARWIN_C_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#define CONTACTFPGA_FAST
#include "contactfpga.h"
#include "clockfit.h"

enum {
    MOST_PORTS = 1024,
    CHUNK = 16384,         /* bytes of a read, at most */
    BYTES = 1 << 19,       /* of a ring, as are these */
    PACKETS = 1 << 14,
    RECORDS = 1 << 14,
    MOST_COLUMNS = 8, /* of a record */
    READS = 1 << 13,
    HELD = 4096,           /* bytes that wait at most of packets that only Python decodes, as in a port's own buffer */
    MANY_PORTS = 8,        /* from here on a turn begins at most every PAUSE_NS */
    PAUSE_NS = 200000
};
enum {
    PAUSED = 1, /* nobody read for PAUSED_S before */
    NOISE = 2   /* more came without a delimiter than a packet has */
};
#define PAUSED_S 8.0 /* as contactfpga.driver.clock.MOST_S */

/* The same as contactfpga.wire.many.FIELDS. */
typedef struct {
    uint8_t valid;
    int64_t time_us, sequence, heard, cells, zones, overwritten, flags, items;
} fields;

typedef struct {
    fields frame;
    uint64_t records_end;
    int64_t size; /* bytes between the delimiters */
} packet;

/* Bytes that came at once, and what there was by then since the port was opened. */
typedef struct {
    double at_s;
    uint64_t bytes, packets, records;
    uint64_t odd; /* PAUSED, NOISE */
} read_;

/* What the Python driver knows after ``packets``; all words have eight bytes. */
typedef struct {
    int64_t steady; /* whether frames that continue the last one may be shown */
    uint64_t packets;
    int64_t time_us, heard; /* of the last frame, since power-up */
    double at_s, byte_s;    /* when it came; what a byte takes on the wire */
} base;

/* What sheets are made of. */
typedef struct {
    uint32_t known, rows, columns, connectivity, report, fraction_bits, closed, extent, levels, zone_capacity, prefix;
} sheet;

/* The newest frame; its fields, those of the one before it, and the records of both follow. */
typedef struct {
    uint64_t packets; /* this frame's number, from 1 */
    int64_t time_us, before; /* before: whether the one before it follows */
    double at_s;             /* when it came */
    host_line line;          /* of the read that brought it */
} newest;

typedef struct {
    uint64_t reads, packets, records, bytes, partial, gap, first_packet, first_byte;
} taken;

typedef struct {
    int descriptor;
    int failure; /* errno, or -1 at the end of the port */
    bool closing;
    pthread_mutex_t lock;
    pthread_cond_t came, full; /* a packet came; much came */
    int waiting, patient;      /* threads that wait for either */
    bool polling, left_out;    /* a thread that waits reads; so the hub does not */
    int wake[2];               /* ends the poll of that thread */
    uint8_t *data;             /* of its reads */
    contactfpga_reader decoder;
    bool known;
    unsigned columns; /* of a record */
    read_ head, tail; /* by now, and what was taken or overwritten */
    uint64_t reads_head, reads_tail;
    uint64_t begun; /* where the packet begins that is not whole */
    bool paused, gap;
    double noticed_s;
    base base;
    bool clean;      /* all packets since the base continue; what follows is of the last one */
    int64_t time_us;
    double at_s;
    host_line line;  /* of its read */
    fit fit;         /* after it */
    uint8_t *bytes;
    packet *packets;
    int64_t *records; /* MOST_COLUMNS for each */
    read_ *reads;
} port;

static struct {
    pthread_mutex_t lock;
    pthread_cond_t turned;
    bool running;
    int wake[2];
    uint64_t turns, changes;
    int count;
    port *ports[MOST_PORTS];
    /* What the thread alone uses. */
    struct pollfd polled[MOST_PORTS + 1];
    uint8_t data[CHUNK];
} hub = {.lock = PTHREAD_MUTEX_INITIALIZER};

/* time.monotonic() */
static double now_s(void) {
    struct timespec moment;
#ifdef __APPLE__
    clock_gettime(CLOCK_UPTIME_RAW, &moment);
#else
    clock_gettime(CLOCK_MONOTONIC, &moment);
#endif
    return (double)moment.tv_sec + (double)moment.tv_nsec * 1e-9;
}

static void make_condition(pthread_cond_t *made) {
#ifdef __APPLE__
    pthread_cond_init(made, NULL);
#else
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(made, &monotonic);
    pthread_condattr_destroy(&monotonic);
#endif
}

static void wait_until(pthread_cond_t *condition, pthread_mutex_t *lock, double until_s) {
#ifdef __APPLE__
    double left_s = until_s - now_s();
    if (left_s < 0) left_s = 0;
    struct timespec left = {(time_t)left_s, (long)((left_s - floor(left_s)) * 1e9)};
    pthread_cond_timedwait_relative_np(condition, lock, &left);
#else
    struct timespec until = {(time_t)until_s, (long)((until_s - floor(until_s)) * 1e9)};
    pthread_cond_timedwait(condition, lock, &until);
#endif
}

/* ---- rings; the port's lock is held ---- */

static bool drop_oldest(port *p) {
    if (p->reads_tail == p->reads_head) return false;
    p->tail = p->reads[p->reads_tail++ % READS];
    p->gap = true;
    return true;
}

static void copy_bytes(const port *p, uint64_t from, size_t count, uint8_t *out) {
    size_t place = from % BYTES, first = count < BYTES - place ? count : BYTES - place;
    memcpy(out, p->bytes + place, first);
    memcpy(out + first, p->bytes, count - first);
}

/* Fields of the decoder's packet, if it is a whole frame of its sheet. */
static bool read_frame(contactfpga_reader *decoder, size_t length, fields *out) {
    if (length < CONTACTFPGA__CHECK_BYTES + 2) return false;
    size_t stuffed = length - CONTACTFPGA__CHECK_BYTES;
    uint8_t check[CONTACTFPGA__CHECK_BYTES], last = decoder->packet[stuffed - 1];
    if (last >> 4 != CONTACTFPGA__KIND_ZONES + decoder->hello.report) return false;
    uint16_t crc = contactfpga__crc16(0xFFFF, decoder->hello.fingerprint, 2);
    contactfpga__check_bytes(contactfpga__crc16(crc, decoder->packet, stuffed), check);
    if (memcmp(check, decoder->packet + stuffed, sizeof check)) return false;
    contactfpga_frame frame;
    uint32_t time_us;
    length = contactfpga__unstuff(decoder->packet, stuffed);
    if (!length || decoder->packet[length - 1] != last
        || contactfpga__read_frame(decoder, length, &frame, &time_us) != CONTACTFPGA__FINE) return false;
    *out = (fields){1, time_us, frame.sequence, frame.heard, frame.cells, frame.zones, frame.overwritten, frame.flags,
        frame.items};
    return true;
}

/* Words of a record. */
static unsigned columns_of(const sheet *told) {
    return 3 + told->closed + 4 * told->extent;
}

/* A record of the frame that was read, in these words. */
static void read_record(const contactfpga_reader *decoder, uint16_t index, int64_t *out) {
    contactfpga_zone zone;
    contactfpga__read_zone(decoder, index, &zone);
    bool divided = decoder->hello.report == CONTACTFPGA_BARYCENTER;
    out[0] = zone.area;
    out[1] = divided ? zone.x : zone.sum_x;
    out[2] = divided ? zone.y : zone.sum_y;
    out += 3;
    if (decoder->hello.closed) *out++ = zone.turned;
    if (decoder->hello.extent) out[0] = zone.left, out[1] = zone.right, out[2] = zone.top, out[3] = zone.bottom;
}

/* The packet that ends before ``end``. */
static packet decode(port *p, uint64_t end) {
    packet found;
    memset(&found, 0, sizeof found);
    found.size = (int64_t)(end - p->begun);
    if (p->known && found.size <= CONTACTFPGA_PACKET_BYTES) {
        copy_bytes(p, p->begun, (size_t)found.size, p->decoder.packet);
        bool room = read_frame(&p->decoder, (size_t)found.size, &found.frame);
        uint16_t items = (uint16_t)found.frame.items;
        while (room && p->head.records + items - p->tail.records > RECORDS) room = drop_oldest(p);
        for (uint16_t i = 0; room && i < items; i++)
            read_record(&p->decoder, i, p->records + MOST_COLUMNS * (p->head.records++ % RECORDS));
        if (!room) memset(&found.frame, 0, sizeof found.frame);
    }
    found.records_end = p->head.records;
    return found;
}

/* Whether the frames of the newest read continue those before them; and what their arrival says of the clocks. */
static void judge(port *p, uint64_t first, const read_ *came) {
    p->clean = p->clean && !came->odd;
    if (!p->clean || first == came->packets) return;
    p->clean = came->at_s - p->at_s <= PAUSED_S;
    for (uint64_t i = first; p->clean && i < came->packets; i++) {
        const fields *frame = &p->packets[i % PACKETS].frame;
        int64_t step = (frame->time_us - p->time_us) & ((int64_t)CONTACTFPGA__WRAP_US - 1);
        /* A board that has heard no request begins again at 0 in a restart, and when its time wraps. */
        bool begins = !frame->heard && frame->time_us < (p->time_us & ((int64_t)CONTACTFPGA__WRAP_US - 1));
        p->clean = frame->valid && frame->heard == p->base.heard && !begins && step > 0
            && step <= (int64_t)CONTACTFPGA__EPOCH_US;
        p->time_us += step;
    }
    if (!p->clean) return;
    double wire_s = (double)(p->packets[(came->packets - 1) % PACKETS].size + 1) * p->base.byte_s;
    p->line = fit_line(&p->fit);
    fit_arrived(&p->fit, p->time_us, came->at_s, wire_s);
    p->at_s = came->at_s;
}

/* Whether nothing more is read before Python took what waits. It decodes some packets one by one, and while it does a
 * ring of them would only grow old. */
static bool held_back(const port *p) {
    return !p->known && p->head.packets > p->tail.packets && p->head.bytes - p->tail.bytes >= HELD;
}

/* How full the fullest ring is, of 4. */
static int quarters(const port *p) {
    if (held_back(p)) return 4;
    uint64_t most = 4 * (p->head.bytes - p->tail.bytes) / BYTES, found[] = {
        4 * (p->head.packets - p->tail.packets) / PACKETS, 4 * (p->head.records - p->tail.records) / RECORDS,
        4 * (p->reads_head - p->reads_tail) / READS};
    for (int i = 0; i < 3; i++) most = found[i] > most ? found[i] : most;
    return (int)most;
}

static void notice(port *p, double at_s) {
    if (at_s - p->noticed_s > PAUSED_S) p->paused = true;
    p->noticed_s = at_s;
}

/* Take at most CHUNK bytes. */
static void feed(port *p, const uint8_t *data, size_t count, double at_s) {
    notice(p, at_s);
    while (p->reads_head - p->reads_tail == READS
        || p->head.bytes + 2 * CHUNK + CONTACTFPGA_PACKET_BYTES - p->tail.bytes > BYTES)
        if (!drop_oldest(p)) break;
    uint64_t first = p->head.packets, start = p->head.bytes;
    for (size_t i = 0; i < count; i++) p->bytes[(start + i) % BYTES] = data[i];
    p->head.bytes += count;
    const uint8_t *next = data, *end = data + count;
    for (const uint8_t *zero; next < end && (zero = memchr(next, 0, (size_t)(end - next))); next = zero + 1) {
        uint64_t place = start + (uint64_t)(zero - data);
        if (place > p->begun) {
            while (p->head.packets - p->tail.packets == PACKETS && drop_oldest(p)) continue;
            packet found = decode(p, place);
            p->packets[p->head.packets++ % PACKETS] = found;
        }
        p->begun = place + 1;
    }
    p->head.at_s = at_s;
    p->head.odd = p->paused ? PAUSED : 0;
    p->paused = false;
    if (p->head.bytes - p->begun > CONTACTFPGA_PACKET_BYTES) {
        p->begun = p->head.bytes; /* as the conversation does */
        p->head.odd |= NOISE;
    }
    p->reads[p->reads_head++ % READS] = p->head;
    judge(p, first, &p->head);
    if (p->waiting && p->head.packets > first) pthread_cond_broadcast(&p->came);
    if (p->patient && quarters(p)) pthread_cond_broadcast(&p->full);
}

static void wake_all(port *p) {
    pthread_cond_broadcast(&p->came);
    pthread_cond_broadcast(&p->full);
}

/* ---- the thread ---- */

/* Read once; the port's lock is held. */
static void read_port(port *p, uint8_t *data) {
    ssize_t count = read(p->descriptor, data, CHUNK);
    if (count > 0) {
        feed(p, data, (size_t)count, now_s());
    } else if (!count || (errno != EAGAIN && errno != EINTR)) {
        p->failure = count ? errno : -1;
        wake_all(p);
    }
}

static void serve(int count) {
    double at_s = now_s();
    for (int i = 0; i < count; i++) {
        port *p = hub.ports[i];
        pthread_mutex_lock(&p->lock);
        if (!hub.polled[i + 1].revents) notice(p, at_s);
        else if (p->polling) p->left_out = true;
        else read_port(p, hub.data);
        pthread_mutex_unlock(&p->lock);
    }
}

static void *run(void *nothing) {
    uint8_t ignored[64];
    for (;;) {
        pthread_mutex_lock(&hub.lock);
        int count = hub.count;
        uint64_t changes = hub.changes;
        hub.polled[0] = (struct pollfd){hub.wake[0], POLLIN, 0};
        for (int i = 0; i < count; i++) {
            port *p = hub.ports[i];
            pthread_mutex_lock(&p->lock);
            bool rests = p->failure || p->left_out || held_back(p);
            hub.polled[i + 1] = (struct pollfd){rests ? -1 : p->descriptor, POLLIN, 0};
            pthread_mutex_unlock(&p->lock);
        }
        pthread_mutex_unlock(&hub.lock);
        int ready = poll(hub.polled, (nfds_t)count + 1, count ? 1000 : -1);
        /* Before the turn: a byte that comes after it is for the next one. */
        ssize_t woken = ready > 0 && hub.polled[0].revents ? read(hub.wake[0], ignored, sizeof ignored) : 0;
        (void)woken;
        pthread_mutex_lock(&hub.lock);
        hub.turns++;
        pthread_cond_broadcast(&hub.turned);
        if (ready >= 0 && hub.changes == changes) serve(count);
        pthread_mutex_unlock(&hub.lock);
        if (count >= MANY_PORTS) nanosleep(&(struct timespec){0, PAUSE_NS}, NULL);
    }
    return nothing;
}

static void wake_thread(void) {
    ssize_t ignored = write(hub.wake[1], "", 1);
    (void)ignored; /* where there is no room, it is woken already */
}

static int make_pipe(int ends[2]) {
    if (pipe(ends)) return errno;
    for (int i = 0; i < 2; i++) {
        fcntl(ends[i], F_SETFD, FD_CLOEXEC);
        fcntl(ends[i], F_SETFL, O_NONBLOCK);
    }
    return 0;
}

static int start(void) {
    pthread_t thread;
    sigset_t all, before;
    int failure = make_pipe(hub.wake);
    if (failure) return failure;
    make_condition(&hub.turned);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    failure = pthread_create(&thread, NULL, run, NULL);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (failure) {
        close(hub.wake[0]);
        close(hub.wake[1]);
        return failure;
    }
    pthread_detach(thread);
    hub.running = true;
    return 0;
}

static int add(port *p) {
    pthread_mutex_lock(&hub.lock);
    int failure = hub.count == MOST_PORTS ? EMFILE : hub.running ? 0 : start();
    if (!failure) {
        hub.ports[hub.count++] = p;
        hub.changes++;
        wake_thread();
    }
    pthread_mutex_unlock(&hub.lock);
    return failure;
}

/* ---- what Python calls ---- */

void cfpga_free(port *p) {
    for (int i = 0; i < 2 && p->descriptor >= 0; i++) close(p->wake[i]);
    pthread_mutex_destroy(&p->lock);
    pthread_cond_destroy(&p->came);
    pthread_cond_destroy(&p->full);
    free(p->data);
    free(p->bytes);
    free(p->packets);
    free(p->records);
    free(p->reads);
    free(p);
}

/* Begin to read a port that is open; with -1 only what cfpga_feed gives. NULL, and errno: it cannot. */
port *cfpga_open(int descriptor, double at_s) {
    port *p = calloc(1, sizeof *p);
    if (!p) return NULL;
    pthread_mutex_init(&p->lock, NULL);
    make_condition(&p->came);
    make_condition(&p->full);
    p->data = malloc(CHUNK);
    p->bytes = malloc(BYTES);
    p->packets = malloc(PACKETS * sizeof *p->packets);
    p->records = malloc(RECORDS * MOST_COLUMNS * sizeof *p->records);
    p->reads = malloc(READS * sizeof *p->reads);
    p->descriptor = -1;
    p->noticed_s = at_s;
    int failure = p->data && p->bytes && p->packets && p->records && p->reads ? 0 : ENOMEM;
    if (!failure && descriptor >= 0 && !(failure = make_pipe(p->wake))) {
        p->descriptor = descriptor;
        failure = add(p);
    }
    if (!failure) return p;
    cfpga_free(p);
    errno = failure;
    return NULL;
}

static void end_waits(port *p) {
    p->closing = true;
    wake_all(p);
    ssize_t ignored = p->descriptor < 0 ? 0 : write(p->wake[1], "", 1);
    (void)ignored; /* where there is no room, it is woken already */
}

/* Read no more: the descriptor may be closed when this returns. Whoever waits goes on. May be called twice. */
void cfpga_close(port *p) {
    pthread_mutex_lock(&p->lock);
    end_waits(p);
    while (p->polling) pthread_cond_wait(&p->came, &p->lock);
    pthread_mutex_unlock(&p->lock);
    pthread_mutex_lock(&hub.lock);
    for (int i = 0; i < hub.count; i++) {
        if (hub.ports[i] != p) continue;
        hub.ports[i] = hub.ports[--hub.count];
        hub.changes++;
        wake_thread();
        for (uint64_t turn = hub.turns; turn == hub.turns;) pthread_cond_wait(&hub.turned, &hub.lock);
    }
    pthread_mutex_unlock(&hub.lock);
}

/* In a child of fork there is no thread, and no port is this process's. */
void cfpga_forked(void) {
    pthread_mutex_init(&hub.lock, NULL);
    if (hub.running) {
        close(hub.wake[0]);
        close(hub.wake[1]);
    }
    hub.running = false;
    hub.count = 0;
}

/* In the place of the thread, for tests: at most CHUNK bytes. */
void cfpga_feed(port *p, const uint8_t *data, size_t count, double at_s) {
    pthread_mutex_lock(&p->lock);
    feed(p, data, count, at_s);
    pthread_mutex_unlock(&p->lock);
}

static void set_sheet(contactfpga_reader *decoder, const sheet *told) {
    contactfpga_hello *hello = &decoder->hello;
    memset(hello, 0, sizeof *hello);
    hello->rows = (uint8_t)told->rows, hello->columns = (uint8_t)told->columns;
    hello->connectivity = (uint8_t)told->connectivity, hello->report = (uint8_t)told->report;
    hello->fraction_bits = (uint8_t)told->fraction_bits, hello->closed = told->closed;
    hello->extent = told->extent, hello->levels = (uint8_t)told->levels;
    hello->zone_capacity = (uint16_t)told->zone_capacity;
    hello->fingerprint[0] = (uint8_t)told->prefix, hello->fingerprint[1] = (uint8_t)(told->prefix >> 8);
    decoder->widths = contactfpga__widths(hello);
}

/* Packets without a port, each with its delimiter: the fields of each, where the records of each begin and the last one's
 * end, and the records. */
void cfpga_decode(const sheet *told, const uint8_t *data, size_t count, fields *found, int64_t *starts, int64_t *records) {
    contactfpga_reader decoder;
    set_sheet(&decoder, told);
    const uint8_t *zero, *end = data + count;
    for (*starts = 0; data < end && (zero = memchr(data, 0, (size_t)(end - data))); data = zero + 1, starts++, found++) {
        size_t length = (size_t)(zero - data);
        memset(found, 0, sizeof *found);
        if (length > CONTACTFPGA_PACKET_BYTES) length = 0;
        memcpy(decoder.packet, data, length);
        read_frame(&decoder, length, found);
        for (uint16_t i = 0; i < found->items; i++, records += columns_of(told)) read_record(&decoder, i, records);
        starts[1] = *starts + found->items;
    }
}

/* What frames are from now on, and those that were not taken yet. */
void cfpga_sheet(port *p, const sheet *told) {
    pthread_mutex_lock(&p->lock);
    if (told->known) set_sheet(&p->decoder, told);
    bool held = held_back(p);
    p->known = told->known;
    if (held && p->descriptor >= 0) wake_thread();
    p->columns = columns_of(told);
    p->clean = false;
    /* What waits is decoded again where it is read as bytes: see native.py. */
    for (uint64_t i = p->tail.packets; i < p->head.packets; i++) p->packets[i % PACKETS].frame.valid = 0;
    pthread_mutex_unlock(&p->lock);
}

static void poll_until(struct pollfd *polled, nfds_t count, double until_s) {
    double left_s = until_s - now_s();
    if (left_s < 0) left_s = 0;
#ifdef __linux__
    struct timespec left = {(time_t)left_s, (long)((left_s - floor(left_s)) * 1e9)};
    ppoll(polled, count, &left, NULL);
#else
    poll(polled, count, (int)ceil(left_s * 1e3));
#endif
}

/* Read until there are more packets than these, in the place of the hub. The port's lock is held, but not while it
 * waits. */
static void read_until(port *p, uint64_t packets, double until_s) {
    p->polling = true;
    while (!p->closing && !p->failure && p->head.packets <= packets && now_s() < until_s) {
        struct pollfd polled[] = {{p->descriptor, POLLIN, 0}, {p->wake[0], POLLIN, 0}};
        pthread_mutex_unlock(&p->lock);
        poll_until(polled, 2, until_s);
        pthread_mutex_lock(&p->lock);
        if (polled[0].revents && !p->closing) read_port(p, p->data);
        else notice(p, now_s());
    }
    p->polling = false;
    if (p->left_out) wake_thread();
    p->left_out = false;
    pthread_cond_broadcast(&p->came); /* another thread may wait, or have to close */
}

/* Wait until there are more packets than these, or with ``patient`` until much has come; at most so long, and not where
 * the port is closed or lost. */
void cfpga_wait(port *p, uint64_t packets, int patient, double seconds) {
    double until_s = now_s() + seconds;
    pthread_mutex_lock(&p->lock);
    int *count = patient ? &p->patient : &p->waiting;
    ++*count;
    while (!p->closing && !p->failure && now_s() < until_s
        && !(patient ? quarters(p) : p->head.packets > packets)) {
        if (!patient && p->descriptor >= 0 && !p->polling) read_until(p, packets, until_s);
        else wait_until(patient ? &p->full : &p->came, &p->lock, until_s);
    }
    --*count;
    pthread_mutex_unlock(&p->lock);
}

/* Whoever waits goes on, now and later. */
void cfpga_wake(port *p) {
    pthread_mutex_lock(&p->lock);
    end_waits(p);
    pthread_mutex_unlock(&p->lock);
}

static size_t size_of(const port *p, const read_ *from, uint64_t reads, const read_ *to) {
    uint64_t packets = to->packets - from->packets, partial = p->gap ? CONTACTFPGA_PACKET_BYTES : 0;
    return sizeof(taken) + reads * sizeof(read_) + packets * (sizeof(fields) + 16) + 8
        + (to->records - from->records) * p->columns * 8 + (to->bytes - from->bytes) + partial;
}

/* Bytes that cfpga_take needs for all that waits; 0: nothing waits. */
size_t cfpga_waiting(port *p) {
    pthread_mutex_lock(&p->lock);
    size_t found = p->reads_head == p->reads_tail ? 0
        : size_of(p, &p->tail, p->reads_head - p->reads_tail, &p->head);
    pthread_mutex_unlock(&p->lock);
    return found;
}

/* It is now this late; whether nobody had read for PAUSED_S, which no read will say then. */
int cfpga_notice(port *p, double at_s) {
    pthread_mutex_lock(&p->lock);
    notice(p, at_s);
    int found = p->paused;
    p->paused = false;
    p->clean = p->clean && !found;
    pthread_mutex_unlock(&p->lock);
    return found;
}

/* Why nothing more comes: errno, or -1 at the end of the port. 0: it goes on. */
int cfpga_failure(port *p) {
    pthread_mutex_lock(&p->lock);
    int found = p->failure;
    pthread_mutex_unlock(&p->lock);
    return found;
}

/* Where the first packet begins that was not taken: after a gap some of its bytes may have come before. */
static uint64_t partial_bytes(const port *p) {
    uint64_t from = p->tail.bytes, least = from > CONTACTFPGA_PACKET_BYTES ? from - CONTACTFPGA_PACKET_BYTES : 0;
    while (from > least && p->bytes[(from - 1) % BYTES]) from--;
    return p->tail.bytes - from;
}

/* Take as many reads as there is room for: a struct taken, then for each read its read_, for each packet its fields, then
 * where each one's records begin and the last one's end, for each packet its size, the records, and all bytes. */
void cfpga_take(port *p, uint8_t *out, size_t room) {
    pthread_mutex_lock(&p->lock);
    read_ from = p->tail, to = from;
    taken told = {0, 0, 0, 0, p->gap ? partial_bytes(p) : 0, p->gap, from.packets, from.bytes};
    for (; p->reads_tail + told.reads < p->reads_head; told.reads++) {
        const read_ *next = &p->reads[(p->reads_tail + told.reads) % READS];
        if (size_of(p, &from, told.reads + 1, next) > room) break;
        to = *next;
    }
    if (!told.reads) { /* reads were overwritten since cfpga_waiting, and it says more now */
        told.partial = told.gap = 0;
        memcpy(out, &told, sizeof told);
        pthread_mutex_unlock(&p->lock);
        return;
    }
    told.packets = to.packets - from.packets;
    told.records = to.records - from.records;
    told.bytes = to.bytes - from.bytes;
    memcpy(out, &told, sizeof told), out += sizeof told;
    for (uint64_t i = 0; i < told.reads; i++, out += sizeof(read_))
        memcpy(out, &p->reads[(p->reads_tail + i) % READS], sizeof(read_));
    for (uint64_t i = from.packets; i < to.packets; i++, out += sizeof(fields))
        memcpy(out, &p->packets[i % PACKETS].frame, sizeof(fields));
    int64_t start = 0;
    memcpy(out, &start, 8), out += 8;
    for (uint64_t i = from.packets; i < to.packets; i++, out += 8) {
        start = (int64_t)(p->packets[i % PACKETS].records_end - from.records);
        memcpy(out, &start, 8);
    }
    for (uint64_t i = from.packets; i < to.packets; i++, out += 8) memcpy(out, &p->packets[i % PACKETS].size, 8);
    for (uint64_t i = from.records; i < to.records; i++, out += 8 * p->columns)
        memcpy(out, p->records + MOST_COLUMNS * (i % RECORDS), 8 * p->columns);
    copy_bytes(p, from.bytes - told.partial, (size_t)(told.partial + told.bytes), out);
    if (held_back(p) && p->descriptor >= 0) wake_thread();
    p->tail = to;
    p->reads_tail += told.reads;
    p->clean = p->clean && !p->gap;
    p->gap = false;
    pthread_mutex_unlock(&p->lock);
}

/* What Python found after it took what came, and its fit of clocks where that is steady: from here on frames may be
 * shown. */
void cfpga_settle(port *p, const base *known, const fit *clocks) {
    pthread_mutex_lock(&p->lock);
    p->base = *known;
    p->clean = known->steady && p->tail.packets == known->packets && !p->gap;
    p->time_us = known->time_us;
    p->at_s = known->at_s;
    if (p->clean) p->fit = *clocks;
    uint64_t first = p->tail.packets;
    for (uint64_t i = p->reads_tail; i < p->reads_head; i++) {
        const read_ *came = &p->reads[i % READS];
        judge(p, first, came);
        first = came->packets;
    }
    pthread_mutex_unlock(&p->lock);
}

static uint8_t *put_frame(const port *p, uint64_t index, uint8_t *out) {
    memcpy(out, &p->packets[index % PACKETS].frame, sizeof(fields));
    return out + sizeof(fields);
}

static uint8_t *put_records(const port *p, uint64_t index, uint8_t *out) {
    const packet *of = &p->packets[index % PACKETS];
    for (uint64_t i = of->records_end - (uint64_t)of->frame.items; i < of->records_end; i++, out += 8 * p->columns)
        memcpy(out, p->records + MOST_COLUMNS * (i % RECORDS), 8 * p->columns);
    return out;
}

/* The newest frame, if it is newer than ``packets``, which is not below the base's: 1. 0: there is none yet. -1: Python has to look for itself.
 * ``out`` has room for a struct newest, two frames and the records of both. */
int cfpga_newest(port *p, uint64_t packets, uint8_t *out) {
    pthread_mutex_lock(&p->lock);
    int found = !p->clean || p->failure || p->closing ? -1 : p->head.packets > packets;
    if (found == 1) {
        uint64_t index = p->head.packets - 1;
        newest told = {index + 1, p->time_us, index > p->base.packets, p->at_s, p->line};
        memcpy(out, &told, sizeof told);
        uint8_t *end = put_frame(p, index, out + sizeof told);
        end = put_frame(p, told.before ? index - 1 : index, end);
        end = put_records(p, index, end);
        if (told.before) put_records(p, index - 1, end);
    }
    pthread_mutex_unlock(&p->lock);
    return found;
}

/* ---- a fit of clocks for the Python driver alone, in memory of its own; not for several threads at once ---- */

size_t cfpga_fit_size(void) {
    return sizeof(fit);
}

void cfpga_fit_begin(fit *f) {
    fit_begin(f);
}

void cfpga_fit_forget(fit *f) {
    fit_forget(f);
}

/* Of the frames one after the other; before each its line goes to ``before``, where there is room and one came before. */
void cfpga_fit_arrived(fit *f, size_t count, const int64_t *times_us, const double *arrived_s, const double *wire_s,
    host_line *before) {
    for (size_t i = 0; i < count; i++) {
        if (before) before[i] = fit_line(f);
        fit_arrived(f, times_us[i], arrived_s[i], wire_s[i]);
    }
}

void cfpga_fit_answered(fit *f, int64_t time_us, double asked_s) {
    fit_answered(f, time_us, asked_s);
}

/* Whether a frame came, and the line of those that come next. */
int cfpga_fit_line(const fit *f, host_line *out) {
    *out = fit_line(f);
    return f->pieces.count > 0;
}
