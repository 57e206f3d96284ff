/* Threads that read, take, wait and close at the same time: run it with a sanitizer.
 *
 *     reader_stress BYTES
 *
 * Bytes of a known sequence go over a pseudo-terminal while other ports come and go. Every byte is taken once, in order.
 */
#define _XOPEN_SOURCE 700
#define _DEFAULT_SOURCE
#include "../../c/reader.c"

#include <stdatomic.h>
#include <stdio.h>
#include <termios.h>

static size_t count;
static int master;
static port *line;
static atomic_bool done;
static atomic_size_t came; /* bytes that were taken */

static uint8_t next(uint32_t *state) {
    *state ^= *state << 13, *state ^= *state >> 17, *state ^= *state << 5;
    return *state % 11 ? (uint8_t)(*state >> 8) : 0;
}

static int open_pair(int *other) {
    struct termios raw;
    *other = posix_openpt(O_RDWR | O_NOCTTY);
    if (*other < 0 || grantpt(*other) || unlockpt(*other)) return -1;
    int descriptor = open(ptsname(*other), O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (descriptor < 0 || tcgetattr(descriptor, &raw)) return -1;
    cfmakeraw(&raw);
    return tcsetattr(descriptor, TCSANOW, &raw) ? -1 : descriptor;
}

/* Nothing is overwritten however seldom the taker gets its turn: less is on its way than there are reads in a ring. */
static void *feed_line(void *nothing) {
    uint32_t state = 1;
    uint8_t data[3000];
    for (size_t sent = 0; sent < count;) {
        size_t some = 1 + sent % sizeof data, written = 0;
        some = some < count - sent ? some : count - sent;
        while (sent + some - came >= READS) nanosleep(&(struct timespec){0, 50000}, NULL);
        for (size_t i = 0; i < some; i++) data[i] = next(&state);
        while (written < some) {
            ssize_t found = write(master, data + written, some - written);
            if (found > 0) written += (size_t)found;
        }
        sent += some;
    }
    return nothing;
}

static void *look(void *nothing) {
    static uint8_t out[1 << 17];
    sheet told = {1, 16, 16, 8, 0, 0, 0, 0, 1, 64, 0x1234};
    base known = {1, 0, 0, 0, 0.0, 1e-6};
    static fit clocks;
    int64_t time_us = 1;
    double arrived_s = 2.0, wire_s = 1e-3;
    cfpga_fit_begin(&clocks);
    cfpga_fit_arrived(&clocks, 1, &time_us, &arrived_s, &wire_s, NULL);
    while (!done) {
        cfpga_newest(line, 0, out);
        cfpga_notice(line, now_s());
        cfpga_settle(line, &known, &clocks);
        cfpga_sheet(line, &told);
        cfpga_wait(line, 1000000000, 1, 0.001);
    }
    return nothing;
}

/* Every array is as long as what it is for, so that the sanitizer sees what is written after it. */
static void decode_alone(const uint8_t *data, size_t length) {
    sheet told = {1, 16, 16, 8, 0, 0, 0, 0, 1, 64, 0x1234};
    size_t packets = 0;
    for (size_t i = 0; i < length; i++) packets += !data[i];
    fields *found = malloc(packets * sizeof *found);
    int64_t *starts = malloc((packets + 1) * sizeof *starts), *records = malloc(length * 3 * sizeof *records);
    cfpga_decode(&told, data, length, found, starts, records);
    for (size_t i = 0; i < packets; i++)
        if (found[i].valid > 1 || starts[i] > starts[i + 1]) _exit(4);
    free(found);
    free(starts);
    free(records);
}

static void *open_and_close(void *nothing) {
    while (!done) {
        int other, descriptor = open_pair(&other);
        port *p = descriptor < 0 ? NULL : cfpga_open(descriptor, now_s());
        if (!p || write(other, "abc", 4) != 4) abort();
        cfpga_wait(p, 0, 0, 0.01);
        cfpga_wake(p);
        cfpga_close(p);
        cfpga_free(p);
        close(descriptor);
        close(other);
    }
    return nothing;
}

int main(int words, char **word) {
    pthread_t threads[4];
    int descriptor = open_pair(&master);
    count = words > 1 ? strtoul(word[1], NULL, 10) : 0;
    if (descriptor < 0) return 1;
    for (int i = 0; i < 5000; i++) { /* the only port, closed as the thread is woken for it */
        if (!(line = cfpga_open(descriptor, now_s()))) return 1;
        cfpga_close(line);
        cfpga_free(line);
    }
    if (!(line = cfpga_open(descriptor, now_s()))) return 1;
    void *(*work[])(void *) = {feed_line, look, open_and_close, open_and_close};
    for (int i = 0; i < 4; i++)
        if (pthread_create(&threads[i], NULL, work[i], NULL)) return 1;
    uint32_t state = 1;
    uint64_t packets = 0;
    while (came < count) {
        cfpga_wait(line, packets, 0, 0.01);
        size_t size = cfpga_waiting(line);
        if (!size) continue;
        uint8_t *out = malloc(size);
        taken told;
        cfpga_take(line, out, size);
        memcpy(&told, out, sizeof told);
        if (told.gap || told.first_byte != came) _exit(2); /* not return: leaks would hide the status */
        const uint8_t *data = out + sizeof told + told.reads * sizeof(read_) + told.packets * (sizeof(fields) + 16) + 8
            + told.records * 8 * 3;
        for (uint64_t i = 0; i < told.bytes; i++)
            if (data[i] != next(&state)) _exit(3);
        decode_alone(data, told.bytes);
        came += told.bytes;
        packets = told.first_packet + told.packets;
        free(out);
    }
    done = true;
    for (int i = 0; i < 4; i++) pthread_join(threads[i], NULL);
    cfpga_close(line);
    cfpga_free(line);
    printf("%zu bytes, %llu packets\n", came, (unsigned long long)packets);
    return 0;
}
