/* What a C program needs from the last byte to its own code: reads a port, decodes, and notes when it had each newest
 * frame.
 *
 *     bare PORT STEP_US FILE
 *
 * It ends when no frame comes for 0.8 s, and writes pairs of doubles: the number, and CLOCK_MONOTONIC in s.
 */
#define _DEFAULT_SOURCE
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "contactfpga.h"

static contactfpga_reader reader;
static uint8_t buffer[65536];

static double now(void) {
    struct timespec moment;
    clock_gettime(CLOCK_MONOTONIC, &moment);
    return (double)moment.tv_sec + (double)moment.tv_nsec * 1e-9;
}

int main(int count, char **words) {
    if (count != 4) return 2;
    int port = open(words[1], O_RDWR | O_NOCTTY);
    uint64_t step_us = strtoull(words[2], NULL, 10);
    FILE *file = fopen(words[3], "wb");
    struct termios raw;
    if (port < 0 || !file || tcgetattr(port, &raw)) return 1;
    cfmakeraw(&raw);
    tcsetattr(port, TCSANOW, &raw);
    contactfpga_init(&reader);
    uint32_t asked = 0;
    while (!contactfpga_may_number(asked)) asked += 129;
    for (int pulsed = 1; pulsed >= 0; pulsed--) {
        uint8_t request[256];
        size_t length = contactfpga_request(asked, true, pulsed, request);
        if (write(port, request, length) != (ssize_t)length) return 1;
    }
    struct pollfd ready = {port, POLLIN, 0};
    while (poll(&ready, 1, reader.stats.frames > 20 ? 800 : 60000) > 0) {
        ssize_t size = read(port, buffer, sizeof buffer);
        if (size <= 0) return 1;
        bool came = false;
        for (ssize_t i = 0; i < size; i++) came |= contactfpga_push(&reader, buffer[i]) == CONTACTFPGA_FRAME;
        if (!came) continue;
        double found[2] = {(double)(reader.frame.time_us / step_us), now()};
        fwrite(found, sizeof found, 1, file);
    }
    if (fclose(file)) return 1;
    struct timespec used;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    printf("%.6f\n", (double)used.tv_sec + (double)used.tv_nsec * 1e-9);
    return 0;
}
