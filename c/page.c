/* contactfpga.h for a page in a browser: compiled to WebAssembly, each function takes and returns plain numbers.
 *
 *     event = decode_push(byte);
 *     if (event == 1) for (i = 0; i < frame_items(); i++) draw(zone_x_mm(i), zone_y_mm(i), zone_area(i));
 *
 * Events are those of contactfpga_event: 1 frame, 2 hello, 3 faults, 4 sweep.
 */
#include "contactfpga.h"

#define EXPORT __attribute__((visibility("default")))

static contactfpga_reader reader;

EXPORT void decode_init(void) { contactfpga_init(&reader); }
EXPORT int decode_push(uint8_t byte) { return (int)contactfpga_push(&reader, byte); }

EXPORT unsigned hello_rows(void) { return reader.hello.rows; }
EXPORT unsigned hello_columns(void) { return reader.hello.columns; }
EXPORT double hello_pitch_x_mm(void) { return reader.hello.pitch_x_mm; }
EXPORT double hello_pitch_y_mm(void) { return reader.hello.pitch_y_mm; }

EXPORT double frame_time_us(void) { return (double)reader.frame.time_us; }
EXPORT unsigned frame_flags(void) { return reader.frame.flags; }
EXPORT unsigned frame_cells(void) { return reader.frame.cells; }
EXPORT unsigned frame_zones(void) { return reader.frame.zones; }
EXPORT unsigned frame_items(void) { return reader.frame.items; }
EXPORT double frames_lost(void) { return (double)reader.stats.lost; }

/* A zone without cells where the last frame carries none of this number. */
static contactfpga_zone zone_at(unsigned index) {
    contactfpga_zone zone;
    memset(&zone, 0, sizeof zone);
    if (index <= UINT16_MAX) contactfpga_zone_at(&reader, (uint16_t)index, &zone);
    return zone;
}

static void barycenter_mm(unsigned index, double *x_mm, double *y_mm) {
    const contactfpga_zone zone = zone_at(index);
    contactfpga_barycenter_mm(&reader, &zone, x_mm, y_mm);
}

EXPORT unsigned zone_area(unsigned index) { return zone_at(index).area; }

EXPORT double zone_x_mm(unsigned index) {
    double x_mm, y_mm;
    barycenter_mm(index, &x_mm, &y_mm);
    return x_mm;
}

EXPORT double zone_y_mm(unsigned index) {
    double x_mm, y_mm;
    barycenter_mm(index, &x_mm, &y_mm);
    return y_mm;
}

EXPORT bool row_open(uint8_t row) { return contactfpga_row_open(&reader, row); }
EXPORT bool column_open(uint8_t column) { return contactfpga_column_open(&reader, column); }
EXPORT bool column_stuck(uint8_t column) { return contactfpga_column_stuck(&reader, column); }
EXPORT bool lines_joined(void) { return contactfpga_lines_joined(&reader); }
