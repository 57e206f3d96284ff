/* Reads what a board sent from standard input and writes what it says, an event per line, and the counters at the end.
 *
 *     cc -o decode decode.c && ./decode < recording.bin
 *
 * A number as its argument is that of one sheet of a board with several.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "contactfpga.h"

static contactfpga_reader reader;

static void show_hello(const contactfpga_hello *hello) {
    printf("hello %ux%u %u%s%s %u %u %u %u %u %u %u ", hello->rows, hello->columns, hello->connectivity,
        hello->closed ? "c" : "", hello->extent ? "e" : "", hello->report, hello->fraction_bits, hello->on_change, hello->zone_capacity, hello->ghosts, hello->guard,
        hello->self_test);
    printf("%.17g %.17g %.17g ", hello->pitch_x_mm, hello->pitch_y_mm, hello->plane ? 0.0 : hello->radius_mm);
    for (int i = 0; i < 8; i++) printf("%02x", hello->fingerprint[i]);
    printf(" %" PRIu32 " %" PRIu32 " %" PRIu64 " %" PRIu32 " %" PRIu32 " %u %s\n", hello->clock_hz, hello->baud,
        hello->sent, hello->epoch, hello->heard, hello->stuck, hello->name);
}

static void show_units(const contactfpga_hello *hello) {
    printf("units %u %u %u %u %u %" PRIu32 "\n", hello->units, hello->unit_bits, hello->sums, hello->sum_bits,
        hello->spacing_clocks, hello->sweep_clocks);
}

static void show_sweep(const contactfpga_sweep *sweep) {
    printf("sweep %" PRId64 " %u %u %u %u", sweep->time_us, sweep->sequence, sweep->over, sweep->armed, sweep->saturated);
    for (uint8_t unit = 0; unit < reader.hello.units; unit++) printf(" %" PRIu32, sweep->readings[unit]);
    printf("\n");
}

static void show_frame(const contactfpga_frame *frame) {
    contactfpga_zone zone;
    printf("frame %" PRIu64 " %u %u %u %u %u %" PRIu32, frame->time_us, frame->sequence, frame->flags, frame->heard,
        frame->cells, frame->zones, frame->overwritten);
    for (uint16_t i = 0; contactfpga_zone_at(&reader, i, &zone); i++) {
        printf(" %" PRIu32 ",%" PRIu32 ",%" PRIu32, zone.area, zone.sum_x + zone.x, zone.sum_y + zone.y);
        if (reader.hello.closed) printf(",%" PRIu32, zone.turned);
        if (reader.hello.extent) printf(",%u,%u,%u,%u", zone.left, zone.right, zone.top, zone.bottom);
    }
    for (uint8_t row = 0; row < reader.hello.rows; row++)
        for (uint8_t column = 0; column < reader.hello.columns; column++) /* once for each level that it reached */
            for (uint8_t level = contactfpga_level(&reader, row, column); level; level--) printf(" %u:%u", row, column);
    printf("\n");
}

static void show_faults(const contactfpga_hello *hello) {
    printf("faults");
    for (uint8_t row = 0; row < hello->rows; row++)
        if (contactfpga_row_open(&reader, row)) printf(" row:%u", row);
    for (uint8_t column = 0; column < hello->columns; column++)
        if (contactfpga_column_open(&reader, column)) printf(" column:%u", column);
    for (uint8_t column = 0; column <= hello->columns; column++)
        if (contactfpga_column_stuck(&reader, column)) printf(" stuck:%u", column);
    printf(contactfpga_lines_joined(&reader) ? " joined\n" : "\n");
}

static void take(uint8_t byte) {
    contactfpga_event event = contactfpga_push(&reader, byte);
    if (event == CONTACTFPGA_HELLO) show_hello(&reader.hello);
    if (event == CONTACTFPGA_HELLO && reader.hello.units) show_units(&reader.hello);
    if (event == CONTACTFPGA_SWEEP) show_sweep(&reader.sweep);
    if (event == CONTACTFPGA_FRAME) show_frame(&reader.frame);
    if (event == CONTACTFPGA_FAULTS) show_faults(&reader.hello);
}

/* A byte of a board with several sheets. */
static void take_of_sheet(uint8_t byte, int sheet) {
    static uint8_t packet[CONTACTFPGA_PACKET_BYTES + 2], number;
    static size_t length;
    if (byte) {
        if (length < sizeof packet) packet[length++] = byte;
        return;
    }
    size_t own = contactfpga_of_sheet(packet, length, &number);
    for (size_t i = 0; number == sheet && i < own; i++) take(packet[i]);
    if (own && number == sheet) take(0);
    length = 0;
}

int main(int count, char **words) {
    const contactfpga_stats *stats = &reader.stats;
    char *end = NULL;
    int byte, sheet = count > 1 ? (int)strtol(words[1], &end, 10) : -1;
    if (count > 1 && (end == words[1] || *end || sheet < 0 || sheet > 15)) {
        fprintf(stderr, "the sheet is '%s'; it must be a number from 0 to 15\n", words[1]);
        return 2;
    }
    contactfpga_init(&reader);
    while ((byte = getchar()) != EOF) {
        if (sheet < 0) take((uint8_t)byte);
        else take_of_sheet((uint8_t)byte, sheet);
    }
    printf("stats");
    printf(" frames=%" PRIu64 " lost=%" PRIu64 " unexplained=%" PRIu32 " overwritten=%" PRIu64, stats->frames,
        stats->lost, stats->unexplained, stats->overwritten);
    printf(" framing=%" PRIu32 " crc=%" PRIu32 " length=%" PRIu32 " kind=%" PRIu32 " content=%" PRIu32 " noise=%" PRIu32,
        stats->damaged[CONTACTFPGA_FRAMING], stats->damaged[CONTACTFPGA_CRC], stats->damaged[CONTACTFPGA_LENGTH],
        stats->damaged[CONTACTFPGA_KIND], stats->damaged[CONTACTFPGA_CONTENT], stats->damaged[CONTACTFPGA_NOISE]);
    printf(" sweeps=%" PRIu32 " sweeps_lost=%" PRIu32 " sweeps_unexplained=%" PRIu32, stats->sweeps, stats->sweeps_lost,
        stats->sweeps_unexplained);
    printf(" resynchronized=%" PRIu32 " hellos=%" PRIu32 " fault_reports=%" PRIu32 " before_hello=%" PRIu32
           " unknown_kinds=%" PRIu32,
        stats->resynchronized, stats->hellos, stats->fault_reports, stats->before_hello, stats->unknown_kinds);
    printf(" foreign_version=%" PRIu32 " skin_changes=%" PRIu32 " restarts=%" PRIu32
           " bytes=%" PRIu64 "\n",
        stats->foreign_version, stats->skin_changes, stats->restarts, stats->bytes);
    return 0;
}
