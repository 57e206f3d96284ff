/* contactfpga.h: reads the packets of a contactfpga board (protocol 2, docs/protocol.md) in C99 or C++11.
 *
 * Nothing is allocated; the one state is a contactfpga_reader, which the caller owns. Feed it each byte from the UART:
 *
 *     static contactfpga_reader reader;
 *     contactfpga_init(&reader);
 *     ...
 *     if (contactfpga_push(&reader, byte) == CONTACTFPGA_FRAME) {
 *         contactfpga_zone zone;
 *         for (uint16_t i = 0; i < reader.frame.items; i++) {
 *             contactfpga_zone_at(&reader, i, &zone);
 *             ...
 *         }
 *     }
 *
 * What a frame holds can be read until the next byte is pushed. A frame whose time since power-up is not known, or that
 * is damaged, is counted and never shown. A board says what it is (a hello) twice a second, so the first frame comes
 * within half a second.
 *
 * A board with pressure units sends what they read in packets of their own: CONTACTFPGA_SWEEP, then reader.sweep.
 *
 * CONTACTFPGA_PACKET_BYTES: the longest packet that can be taken. The default takes that of every sheet; define a smaller
 * one before including this file to save memory: a hello needs up to 120 bytes, a frame 14 bytes and its zones.
 * CONTACTFPGA_FAST: if it is defined, a table of 512 bytes and whole bytes at a time make decoding about twice as fast.
 */
#ifndef CONTACTFPGA_H
#define CONTACTFPGA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef CONTACTFPGA_PACKET_BYTES
#define CONTACTFPGA_PACKET_BYTES 22630
#endif

#define CONTACTFPGA_MAX_LINES 64
#define CONTACTFPGA_MAX_LEVELS 3
#define CONTACTFPGA_MAX_UNITS 8
#define CONTACTFPGA_REQUEST_BYTES 10
#define CONTACTFPGA_PULSED_REQUEST_BYTES 66
#define CONTACTFPGA_COMMAND_BYTES 14
#define CONTACTFPGA_PULSED_COMMAND_BYTES 98

/* What a byte completed. */
typedef enum {
    CONTACTFPGA_NOTHING = 0,
    CONTACTFPGA_FRAME,
    CONTACTFPGA_HELLO,
    CONTACTFPGA_FAULTS, /* what the board says of its lines has changed: contactfpga_row_open and so on */
    CONTACTFPGA_SWEEP   /* the pressure units were read */
} contactfpga_event;

typedef enum { CONTACTFPGA_MOMENTS = 0, CONTACTFPGA_CELLS = 1, CONTACTFPGA_BARYCENTER = 2 } contactfpga_report;

/* Bits of a frame's flags. */
enum { CONTACTFPGA_OVERFLOW = 1, CONTACTFPGA_MISMATCH = 2, CONTACTFPGA_FAULT = 4, CONTACTFPGA_MOTION = 8 };

/* What a board can be told to do; it takes those that its Skin has. */
enum {
    CONTACTFPGA_SELF_TEST = 1,
    CONTACTFPGA_SAMPLE_AT = 2,    /* value: clocks after a row is selected; 0: the settle time */
    CONTACTFPGA_ZERO = 3,         /* value of these three: contactfpga_unit_value */
    CONTACTFPGA_THRESHOLD = 4,
    CONTACTFPGA_SUM_THRESHOLD = 5
};

/* Why packets were refused. */
enum {
    CONTACTFPGA_FRAMING,
    CONTACTFPGA_CRC,
    CONTACTFPGA_LENGTH,
    CONTACTFPGA_KIND,
    CONTACTFPGA_CONTENT,
    CONTACTFPGA_NOISE,
    CONTACTFPGA_REASONS
};

/* What the board says of itself. */
typedef struct {
    uint8_t rows, columns;
    uint8_t connectivity; /* 4 or 8 */
    uint8_t report;       /* a contactfpga_report */
    uint8_t fraction_bits; /* of barycenters */
    bool on_change;       /* frames come when cells change, and as a keep-alive; else all the time */
    bool ghosts;          /* the sheet has no diodes */
    bool plane;           /* else a cylinder */
    bool closed;          /* its last column is a neighbor of the first */
    bool extent;          /* its zones say how far they reach */
    uint8_t levels;       /* of force of a cell; 1: it is pressed or not */
    bool guard;           /* it has guard lines, and names faults */
    bool self_test;       /* it can test its lines */
    uint16_t zone_capacity;
    uint8_t units;         /* pressure units, at most CONTACTFPGA_MAX_UNITS; 0: it has none, and the next five are 0 */
    uint8_t unit_bits;     /* of a reading */
    uint8_t sums, sum_bits; /* weighted sums that can have a threshold, and bits of the largest amount of one */
    uint16_t spacing_clocks; /* from a unit's sample to that of the next one; 0: all are sampled at once */
    uint32_t sweep_clocks;   /* from one sweep to the next */
    double pitch_x_mm, pitch_y_mm, radius_mm;
    uint8_t fingerprint[8];
    uint32_t clock_hz, baud;
    char name[33]; /* UTF-8, ends with a zero byte */
    uint64_t sent; /* frames since power-up */
    uint32_t epoch; /* whole times 2^22 us since power-up */
    uint32_t heard; /* number of the last request */
    uint8_t stuck;  /* columns; 7: 7 or more */
} contactfpga_hello;

typedef struct {
    uint64_t time_us; /* sample of the first row, since power-up */
    uint8_t sequence, flags;
    uint8_t heard;        /* lowest three bits of the last request's number before the frame was scanned */
    uint16_t cells;       /* pressed on the whole sheet */
    uint16_t zones;       /* on the sheet, also those the frame had no room for */
    uint16_t items;       /* zones, or with CONTACTFPGA_CELLS rows, that the frame carries */
    uint32_t overwritten; /* frames that newer ones replaced before they were sent, modulo 2^overwritten_bits */
} contactfpga_frame;

/* A contact zone. Its barycenter is sum_x / area along the columns, in cells, and sum_y / area along the rows; with
 * CONTACTFPGA_BARYCENTER the board has divided: x and y are in cells / 2^fraction_bits, and the sums are 0. On a closed
 * sheet ``turned`` cells lie past the seam, seen from the others: (sum_x + columns * turned) / area is the barycenter. A
 * zone that is a ring or wound has no x (docs/skin.md). Of a board with ``extent`` columns left to right and rows top to
 * bottom are the first and last ones with a cell of the zone; on a closed sheet, left above right is over the seam. */
typedef enum { CONTACTFPGA_PLAIN = 0, CONTACTFPGA_RING = 1, CONTACTFPGA_WOUND = 2 } contactfpga_winding;
typedef struct {
    uint32_t area, sum_x, sum_y, x, y, turned;
    uint8_t left, right, top, bottom;
    contactfpga_winding winding;
} contactfpga_zone;

/* What the pressure units read. */
typedef struct {
    int64_t time_us; /* sample of the first unit, since power-up; later than that of the sweep before */
    uint8_t sequence;
    bool over, armed;  /* a threshold is reached; the board has one */
    uint8_t saturated; /* a bit for each unit: it read 0 or full scale, so its reading may be anything beyond */
    uint32_t readings[CONTACTFPGA_MAX_UNITS]; /* in steps of the converter */
} contactfpga_sweep;

/* What was counted since contactfpga_init; the names are those of the Python driver's board.stats. */
typedef struct {
    uint64_t frames, lost, overwritten, bytes; /* at full rate 32 bits are used up within hours, and lost may jump */
    uint32_t unexplained, damaged[CONTACTFPGA_REASONS], resynchronized, hellos, fault_reports, sweeps, sweeps_lost,
        sweeps_unexplained, before_hello, unknown_kinds, foreign_version, skin_changes, restarts;
} contactfpga_stats;

/* Widths of a sheet's fields on the wire. */
typedef struct {
    uint8_t area, sum_x, sum_y, zones, overwritten, record[8], record_bytes, item_bytes, trailer_bytes, cell;
    uint16_t cells, max_zones, max_items;
} contactfpga_widths;

typedef struct {
    contactfpga_frame frame; /* the last one shown */
    contactfpga_hello hello; /* the last one, once greeted */
    contactfpga_sweep sweep; /* the last one shown */
    contactfpga_stats stats;
    bool greeted; /* a hello has come */
    /* What follows is the reader's own. */
    contactfpga_widths widths;
    contactfpga_hello draft; /* the hello that is being collected */
    uint32_t draft_crc, draft_fields;
    uint16_t draft_bytes;
    uint8_t lines[28]; /* the last report of faults, in digits of seven bits */
    uint16_t length; /* bytes of the packet so far */
    bool overlong, begun, damage;
    bool met, known, forgot, timed, before; /* of the time line: see contactfpga__explain */
    uint32_t waiting;
    uint64_t next, time_us;
    int64_t last_us;
    uint32_t epoch, before_overwritten;
    uint8_t before_heard;
    bool swept, sweep_timed; /* a sweep has come; one with its time has */
    uint8_t sweep_sequence;
    uint8_t packet[CONTACTFPGA_PACKET_BYTES];
} contactfpga_reader;

/* Begin to listen to a port. */
static inline void contactfpga_init(contactfpga_reader *reader);

/* Take a byte from the board. */
static inline contactfpga_event contactfpga_push(contactfpga_reader *reader, uint8_t byte);

/* Of a board with several sheets: makes a packet without its delimiter that of a board with its sheet alone, whose reader
 * takes it with a delimiter; writes the number of the sheet and returns the new length, 0 for a packet of no sheet. Damage
 * stays damage. */
static inline size_t contactfpga_of_sheet(uint8_t *packet, size_t length, uint8_t *number);

/* Bytes were lost, or nobody read for more than 8 s: no frame is shown before the next hello, as its time is not known. */
static inline void contactfpga_doubt(contactfpga_reader *reader);

/* Zone number ``index`` of the last frame; false, and nothing is written, where it carries no such zone. */
static inline bool contactfpga_zone_at(const contactfpga_reader *reader, uint16_t index, contactfpga_zone *zone);

/* Whether a cell of the last frame is pressed, with CONTACTFPGA_CELLS; else, and outside the sheet, false. */
static inline bool contactfpga_pressed(const contactfpga_reader *reader, uint8_t row, uint8_t column);

/* How many of the board's levels of force a cell of the last frame reached; likewise, and else 0. */
static inline uint8_t contactfpga_level(const contactfpga_reader *reader, uint8_t row, uint8_t column);

/* Whether the board's last report says that a row or a column is open before its far end, that a column (the guard column
 * counts as the one after the last) read pressed while no row was driven, or that the self-test found joined lines. */
static inline bool contactfpga_row_open(const contactfpga_reader *reader, uint8_t row);
static inline bool contactfpga_column_open(const contactfpga_reader *reader, uint8_t column);
static inline bool contactfpga_column_stuck(const contactfpga_reader *reader, uint8_t column);
static inline bool contactfpga_lines_joined(const contactfpga_reader *reader);

/* Barycenter of a zone in mm on the sheet laid flat; column 0 and row 0 lie at 0. Not a number for a zone without cells,
 * which a frame flagged CONTACTFPGA_MISMATCH may hold. On a closed sheet x lies from 0 to the circumference, and is not a
 * number for a zone that is a ring or wound. */
static inline void contactfpga_barycenter_mm(
    const contactfpga_reader *reader, const contactfpga_zone *zone, double *x_mm, double *y_mm);

/* A request with this number for a frame, and with ``hello`` for a hello, into ``out``; returns how many bytes to send, 0
 * where a request may not have this number. ``pulsed``: the board has fewer than 4 clocks per bit (contactfpga_pulsed).
 * ``out`` has room for CONTACTFPGA_REQUEST_BYTES, or CONTACTFPGA_PULSED_REQUEST_BYTES. The frame that answers it is the
 * first whose ``heard`` is number % 8; docs/protocol.md says what that takes. */
static inline size_t contactfpga_request(uint32_t number, bool hello, bool pulsed, uint8_t *out);

/* The same with something to do, one of CONTACTFPGA_SELF_TEST and so on, at most 127, and its value, below 2^21. The frame
 * that answers it was scanned after the board took the command. ``out`` has room for CONTACTFPGA_COMMAND_BYTES, or
 * CONTACTFPGA_PULSED_COMMAND_BYTES. */
static inline size_t contactfpga_command(
    uint32_t number, uint8_t what, uint32_t value, bool hello, bool pulsed, uint8_t *out);

/* The value of a command CONTACTFPGA_ZERO, _THRESHOLD or _SUM_THRESHOLD: for this unit, or sum, this many steps of its
 * converter. False where the board, whose hello has come, has no such unit or sum, or it never reads as much. */
static inline bool contactfpga_unit_value(
    const contactfpga_hello *hello, uint8_t what, uint8_t place, uint32_t steps, uint32_t *value);

/* Whether a request or a command may have this number. */
static inline bool contactfpga_may_number(uint32_t number);

/* Whether the board, whose hello has come, takes requests as pulses. */
static inline bool contactfpga_pulsed(const contactfpga_hello *hello);

/* ---- from here on how it is done ---- */

enum {
    CONTACTFPGA__CHECK_BYTES = 3,
    CONTACTFPGA__KIND_HELLO = 4,
    CONTACTFPGA__KIND_REQUEST = 5,
    CONTACTFPGA__KIND_ZONES = 5,
    CONTACTFPGA__KIND_UNITS = 8,
    CONTACTFPGA__KIND_FAULTS = 9,
    CONTACTFPGA__KIND_COMMAND = 10,
    CONTACTFPGA__KIND_NUMBERED = 11,
    CONTACTFPGA__SHEET = 1,
    CONTACTFPGA__STATE = 2,
    CONTACTFPGA__PITCH = 3,
    CONTACTFPGA__RADIUS = 4,
    CONTACTFPGA__FINGERPRINT = 5,
    CONTACTFPGA__RATES = 6,
    CONTACTFPGA__NAME = 7,
    CONTACTFPGA__COMMANDS = 8,
    CONTACTFPGA__UNITS = 9,
    CONTACTFPGA__PLACE = 10,
    CONTACTFPGA__CHECK = 255,
    CONTACTFPGA__UNIT_BITS = 28, /* of a reading, at most */
    CONTACTFPGA__SUM_BITS = 38,  /* of a sum: readings times weights of seven bits, of eight units */
    CONTACTFPGA__STATE_DIGITS = 16,
    CONTACTFPGA__LONGEST_HELLO = 8192
};
#define CONTACTFPGA__WRAP_US (UINT64_C(1) << 24)
#define CONTACTFPGA__EPOCH_US (UINT64_C(1) << 22)
#define CONTACTFPGA__BEGUN_US (INT64_C(1) << 21)
#define CONTACTFPGA__FINE CONTACTFPGA_REASONS

/* CRC-16/MCRF4XX: x^16 + x^12 + x^5 + 1, lowest bit first. */
#ifdef CONTACTFPGA_FAST
static const uint16_t contactfpga__crc16_table[256] = {
    0x0000, 0x1189, 0x2312, 0x329B, 0x4624, 0x57AD, 0x6536, 0x74BF, 0x8C48, 0x9DC1, 0xAF5A, 0xBED3, 0xCA6C, 0xDBE5, 0xE97E, 0xF8F7,
    0x1081, 0x0108, 0x3393, 0x221A, 0x56A5, 0x472C, 0x75B7, 0x643E, 0x9CC9, 0x8D40, 0xBFDB, 0xAE52, 0xDAED, 0xCB64, 0xF9FF, 0xE876,
    0x2102, 0x308B, 0x0210, 0x1399, 0x6726, 0x76AF, 0x4434, 0x55BD, 0xAD4A, 0xBCC3, 0x8E58, 0x9FD1, 0xEB6E, 0xFAE7, 0xC87C, 0xD9F5,
    0x3183, 0x200A, 0x1291, 0x0318, 0x77A7, 0x662E, 0x54B5, 0x453C, 0xBDCB, 0xAC42, 0x9ED9, 0x8F50, 0xFBEF, 0xEA66, 0xD8FD, 0xC974,
    0x4204, 0x538D, 0x6116, 0x709F, 0x0420, 0x15A9, 0x2732, 0x36BB, 0xCE4C, 0xDFC5, 0xED5E, 0xFCD7, 0x8868, 0x99E1, 0xAB7A, 0xBAF3,
    0x5285, 0x430C, 0x7197, 0x601E, 0x14A1, 0x0528, 0x37B3, 0x263A, 0xDECD, 0xCF44, 0xFDDF, 0xEC56, 0x98E9, 0x8960, 0xBBFB, 0xAA72,
    0x6306, 0x728F, 0x4014, 0x519D, 0x2522, 0x34AB, 0x0630, 0x17B9, 0xEF4E, 0xFEC7, 0xCC5C, 0xDDD5, 0xA96A, 0xB8E3, 0x8A78, 0x9BF1,
    0x7387, 0x620E, 0x5095, 0x411C, 0x35A3, 0x242A, 0x16B1, 0x0738, 0xFFCF, 0xEE46, 0xDCDD, 0xCD54, 0xB9EB, 0xA862, 0x9AF9, 0x8B70,
    0x8408, 0x9581, 0xA71A, 0xB693, 0xC22C, 0xD3A5, 0xE13E, 0xF0B7, 0x0840, 0x19C9, 0x2B52, 0x3ADB, 0x4E64, 0x5FED, 0x6D76, 0x7CFF,
    0x9489, 0x8500, 0xB79B, 0xA612, 0xD2AD, 0xC324, 0xF1BF, 0xE036, 0x18C1, 0x0948, 0x3BD3, 0x2A5A, 0x5EE5, 0x4F6C, 0x7DF7, 0x6C7E,
    0xA50A, 0xB483, 0x8618, 0x9791, 0xE32E, 0xF2A7, 0xC03C, 0xD1B5, 0x2942, 0x38CB, 0x0A50, 0x1BD9, 0x6F66, 0x7EEF, 0x4C74, 0x5DFD,
    0xB58B, 0xA402, 0x9699, 0x8710, 0xF3AF, 0xE226, 0xD0BD, 0xC134, 0x39C3, 0x284A, 0x1AD1, 0x0B58, 0x7FE7, 0x6E6E, 0x5CF5, 0x4D7C,
    0xC60C, 0xD785, 0xE51E, 0xF497, 0x8028, 0x91A1, 0xA33A, 0xB2B3, 0x4A44, 0x5BCD, 0x6956, 0x78DF, 0x0C60, 0x1DE9, 0x2F72, 0x3EFB,
    0xD68D, 0xC704, 0xF59F, 0xE416, 0x90A9, 0x8120, 0xB3BB, 0xA232, 0x5AC5, 0x4B4C, 0x79D7, 0x685E, 0x1CE1, 0x0D68, 0x3FF3, 0x2E7A,
    0xE70E, 0xF687, 0xC41C, 0xD595, 0xA12A, 0xB0A3, 0x8238, 0x93B1, 0x6B46, 0x7ACF, 0x4854, 0x59DD, 0x2D62, 0x3CEB, 0x0E70, 0x1FF9,
    0xF78F, 0xE606, 0xD49D, 0xC514, 0xB1AB, 0xA022, 0x92B9, 0x8330, 0x7BC7, 0x6A4E, 0x58D5, 0x495C, 0x3DE3, 0x2C6A, 0x1EF1, 0x0F78,
};
static inline uint16_t contactfpga__crc16(uint16_t crc, const uint8_t *data, size_t length) {
    for (size_t i = 0; i < length; i++) crc = (uint16_t)(crc >> 8 ^ contactfpga__crc16_table[(crc ^ data[i]) & 0xFF]);
    return crc;
}
#else
static inline uint16_t contactfpga__crc16(uint16_t crc, const uint8_t *data, size_t length) {
    for (size_t i = 0; i < length; i++) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; bit++) crc = (uint16_t)(crc & 1 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
    return crc;
}
#endif

static inline uint32_t contactfpga__crc32(uint32_t crc, const uint8_t *data, size_t length) {
    crc = ~crc;
    for (size_t i = 0; i < length; i++) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; bit++) crc = crc & 1 ? crc >> 1 ^ UINT32_C(0xEDB88320) : crc >> 1;
    }
    return ~crc;
}

static inline void contactfpga__check_bytes(uint16_t crc, uint8_t *out) {
    out[0] = (uint8_t)(0x80 | (crc & 0x7F));
    out[1] = (uint8_t)(0x80 | (crc >> 7 & 0x7F));
    out[2] = (uint8_t)(0x80 | crc >> 14);
}

/* ``width`` bits, at most 32, from bit ``offset`` on, lowest first. */
static inline uint32_t contactfpga__bits(const uint8_t *data, size_t offset, unsigned width) {
#ifdef CONTACTFPGA_FAST
    uint64_t word = 0;
    size_t first = offset / 8, end = (offset + width + 7) / 8;
    for (size_t place = first; place < end; place++) word |= (uint64_t)data[place] << 8 * (place - first);
    return (uint32_t)(word >> offset % 8 & ((UINT64_C(1) << width) - 1));
#else
    uint32_t value = 0;
    for (unsigned bit = 0; bit < width; bit++)
        value |= (uint32_t)(data[(offset + bit) / 8] >> (offset + bit) % 8 & 1) << bit;
    return value;
#endif
}

/* A number in digits of seven bits. */
static inline uint64_t contactfpga__number(const uint8_t *digits, unsigned count) {
    uint64_t value = 0;
    for (unsigned place = 0; place < count; place++) value |= (uint64_t)(digits[place] & 0x7F) << 7 * place;
    return value;
}

static inline uint32_t contactfpga__word(const uint8_t *data) {
    return contactfpga__bits(data, 0, 32);
}

static inline double contactfpga__double(const uint8_t *data) {
    uint64_t word = contactfpga__word(data) | (uint64_t)contactfpga__word(data + 4) << 32;
    double value;
    memcpy(&value, &word, sizeof value);
    return value;
}

/* The least bits that hold 0 to ``largest``, one at least. */
static inline uint8_t contactfpga__width(uint32_t largest) {
    uint8_t width = 1;
    while (largest >>= 1) width++;
    return width;
}

static inline uint8_t contactfpga__bytes(unsigned bits) {
    return (uint8_t)((bits + 7) / 8);
}

static inline uint16_t contactfpga__max_zones(const contactfpga_hello *hello) {
    if (hello->closed)
        return (uint16_t)((hello->connectivity == 8 ? (hello->rows + 1) / 2 : hello->rows) * (hello->columns / 2));
    if (hello->connectivity == 8) return (uint16_t)((hello->rows + 1) / 2 * ((hello->columns + 1) / 2));
    return (uint16_t)((hello->rows * hello->columns + 1) / 2);
}

static inline contactfpga_widths contactfpga__widths(const contactfpga_hello *hello) {
    contactfpga_widths w;
    uint32_t rows = hello->rows, columns = hello->columns;
    w.cells = (uint16_t)(rows * columns);
    w.max_zones = contactfpga__max_zones(hello);
    w.area = contactfpga__width(w.cells);
    w.sum_x = contactfpga__width(rows * (columns * (columns - 1) / 2));
    w.sum_y = contactfpga__width(columns * (rows * (rows - 1) / 2));
    w.zones = contactfpga__width(w.max_zones);
    w.record[0] = w.area, w.record[1] = w.sum_x, w.record[2] = w.sum_y, w.record[3] = hello->closed ? w.area : 0;
    w.record[4] = w.record[5] = hello->extent ? contactfpga__width(columns - 1) : 0;
    w.record[6] = w.record[7] = hello->extent ? contactfpga__width(rows - 1) : 0;
    if (hello->report == CONTACTFPGA_BARYCENTER) {
        w.record[0] = contactfpga__width(w.cells - 1u);
        w.record[1] = contactfpga__width((columns - 1) << hello->fraction_bits);
        w.record[2] = contactfpga__width((rows - 1) << hello->fraction_bits);
    }
    unsigned record = 0;
    for (int i = 0; i < 8; i++) record += w.record[i];
    w.record_bytes = contactfpga__bytes(record);
    w.cell = contactfpga__width(hello->levels);
    w.item_bytes = hello->report == CONTACTFPGA_CELLS ? contactfpga__bytes(columns * w.cell) : w.record_bytes;
    w.max_items = hello->report == CONTACTFPGA_CELLS ? hello->rows : hello->zone_capacity;
    unsigned counted = 24u + 8 + 3 + w.area + w.zones;
    w.trailer_bytes = (uint8_t)(contactfpga__bytes(counted + 4) + 1);
    w.overwritten = (uint8_t)(8u * (w.trailer_bytes - 1u) - counted);
    return w;
}

/* ---- hellos ---- */

static inline bool contactfpga__is_utf8(const uint8_t *text, size_t length) {
    for (size_t i = 0; i < length;) {
        uint8_t lead = text[i++];
        if (lead < 0x80) continue;
        int more = lead >= 0xC2 && lead < 0xE0 ? 1 : lead >= 0xE0 && lead < 0xF0 ? 2 : lead >= 0xF0 && lead < 0xF5 ? 3 : 0;
        if (!more || i + (size_t)more > length) return false;
        uint8_t low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80, high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
        if (text[i] < low || text[i] > high) return false;
        for (i++; --more; i++)
            if (text[i] < 0x80 || text[i] > 0xBF) return false;
    }
    return true;
}

static inline bool contactfpga__is_length(double mm) {
    return mm > 0 && mm <= 1.7976931348623157e308;
}

/* Whether frames of such a sheet can be read. */
static inline bool contactfpga__may_be(const contactfpga_hello *hello) {
    uint8_t most_bits = hello->report == CONTACTFPGA_BARYCENTER ? 8 : 0;
    return contactfpga__is_length(hello->pitch_x_mm) && contactfpga__is_length(hello->pitch_y_mm)
        && (hello->plane || contactfpga__is_length(hello->radius_mm)) && hello->rows >= 1 && hello->columns >= 1
        && hello->rows <= CONTACTFPGA_MAX_LINES && hello->columns <= CONTACTFPGA_MAX_LINES
        && hello->fraction_bits <= most_bits && (hello->connectivity == 4 || hello->connectivity == 8)
        && !(hello->extent && hello->report == CONTACTFPGA_CELLS)
        && hello->levels <= (hello->report == CONTACTFPGA_CELLS && !hello->closed ? CONTACTFPGA_MAX_LEVELS : 1)
        && (!hello->closed || (hello->columns >= 3 && !hello->plane && hello->report != CONTACTFPGA_BARYCENTER))
        && hello->zone_capacity >= 1 && hello->zone_capacity <= contactfpga__max_zones(hello) && hello->clock_hz
        && hello->baud;
}

/* The least bytes of a field. */
static inline uint8_t contactfpga__least(uint8_t kind) {
    switch (kind) {
    case CONTACTFPGA__SHEET:
    case CONTACTFPGA__UNITS: return 10;
    case CONTACTFPGA__PLACE: return 2;
    case CONTACTFPGA__STATE: return CONTACTFPGA__STATE_DIGITS;
    case CONTACTFPGA__PITCH: return 16;
    case CONTACTFPGA__RADIUS:
    case CONTACTFPGA__FINGERPRINT:
    case CONTACTFPGA__RATES: return 8;
    case CONTACTFPGA__CHECK: return 4;
    default: return 0;
    }
}

enum {
    CONTACTFPGA__ODD_SHEET = 16,
    CONTACTFPGA__ODD_STATE = 17,
    CONTACTFPGA__ODD_NAME = 18,
    CONTACTFPGA__ODD_UNITS = 19,
    CONTACTFPGA__ODD_PLACE = 20
};

/* Keep a field's content; what is wrong with it counts only once the hello is whole. */
static inline void contactfpga__take_field(contactfpga_reader *reader, uint8_t kind, const uint8_t *value, uint8_t length) {
    contactfpga_hello *hello = &reader->draft;
    uint32_t odd = 0;
    switch (kind) {
    case CONTACTFPGA__SHEET:
        hello->rows = value[0], hello->columns = value[1], hello->report = value[3];
        hello->connectivity = value[2] & 15, hello->closed = value[2] >> 7, hello->extent = value[2] >> 6 & 1;
        hello->levels = (uint8_t)(1 + (value[2] >> 4 & 3));
        hello->fraction_bits = value[4], hello->on_change = value[5] == 1;
        hello->zone_capacity = (uint16_t)(value[6] | value[7] << 8), hello->ghosts = value[8] == 1;
        hello->guard = value[9] & 1;
        odd = (uint32_t)(value[3] > 2 || value[5] > 1 || value[8] > 1) << CONTACTFPGA__ODD_SHEET;
        break;
    case CONTACTFPGA__STATE:
        reader->draft_fields &= ~(UINT32_C(1) << CONTACTFPGA__ODD_STATE);
        for (int i = 0; i < CONTACTFPGA__STATE_DIGITS; i++)
            if (!(value[i] & 0x80)) odd = UINT32_C(1) << CONTACTFPGA__ODD_STATE;
        hello->sent = contactfpga__number(value, 7);
        hello->epoch = (uint32_t)contactfpga__number(value + 7, 4);
        hello->heard = (uint32_t)contactfpga__number(value + 11, 3);
        hello->stuck = value[14] & 0x7F;
        break;
    case CONTACTFPGA__PITCH:
        hello->pitch_x_mm = contactfpga__double(value), hello->pitch_y_mm = contactfpga__double(value + 8);
        break;
    case CONTACTFPGA__RADIUS: hello->radius_mm = contactfpga__double(value), hello->plane = false; break;
    case CONTACTFPGA__FINGERPRINT: memcpy(hello->fingerprint, value, 8); break;
    case CONTACTFPGA__RATES:
        hello->clock_hz = contactfpga__word(value), hello->baud = contactfpga__word(value + 4);
        break;
    case CONTACTFPGA__COMMANDS: hello->self_test = length && memchr(value, 1, length); break;
    case CONTACTFPGA__UNITS:
        hello->units = value[0], hello->unit_bits = value[1], hello->sums = value[2], hello->sum_bits = value[3];
        hello->spacing_clocks = (uint16_t)(value[4] | value[5] << 8);
        hello->sweep_clocks = contactfpga__word(value + 6);
        reader->draft_fields &= ~(UINT32_C(1) << CONTACTFPGA__ODD_UNITS);
        if (value[0] < 1 || value[0] > CONTACTFPGA_MAX_UNITS || value[1] < 1 || value[1] > CONTACTFPGA__UNIT_BITS
            || value[3] > CONTACTFPGA__SUM_BITS || !hello->sweep_clocks)
            odd = UINT32_C(1) << CONTACTFPGA__ODD_UNITS;
        break;
    case CONTACTFPGA__PLACE:
        reader->draft_fields &= ~(UINT32_C(1) << CONTACTFPGA__ODD_PLACE);
        if (value[0] >= value[1]) odd = UINT32_C(1) << CONTACTFPGA__ODD_PLACE;
        break;
    case CONTACTFPGA__NAME: {
        size_t kept = length < sizeof hello->name - 1 ? length : sizeof hello->name - 1;
        reader->draft_fields &= ~(UINT32_C(1) << CONTACTFPGA__ODD_NAME);
        if (!contactfpga__is_utf8(value, length)) odd = UINT32_C(1) << CONTACTFPGA__ODD_NAME;
        memset(hello->name, 0, sizeof hello->name);
        memcpy(hello->name, value, kept);
        break;
    }
    default: return;
    }
    reader->draft_fields |= UINT32_C(1) << kind | odd;
}

/* The hello is whole: is it one? */
static inline int contactfpga__finish_hello(contactfpga_reader *reader, const uint8_t *check) {
    uint32_t mandatory = 1u << CONTACTFPGA__SHEET | 1u << CONTACTFPGA__STATE | 1u << CONTACTFPGA__PITCH
        | 1u << CONTACTFPGA__FINGERPRINT | 1u << CONTACTFPGA__RATES;
    uint32_t fields = reader->draft_fields;
    if (contactfpga__word(check) != reader->draft_crc) return CONTACTFPGA_CRC;
    if ((fields & mandatory) != mandatory || fields >> CONTACTFPGA__ODD_SHEET || !contactfpga__may_be(&reader->draft))
        return CONTACTFPGA_CONTENT;
    return CONTACTFPGA__FINE;
}

/* An unsealed packet of kind hello, without its last byte; ``whole``: it completes one. */
static inline int contactfpga__read_hello(contactfpga_reader *reader, const uint8_t *data, size_t length, bool *whole) {
    *whole = false;
    while (length) {
        uint8_t kind = data[0];
        if (length < 2 || length < 2u + data[1]) return CONTACTFPGA_LENGTH;
        uint8_t size = data[1];
        if (kind == CONTACTFPGA__SHEET) {
            memset(&reader->draft, 0, sizeof reader->draft);
            reader->draft.plane = true;
            reader->draft_crc = reader->draft_bytes = 0;
            reader->draft_fields = 1; /* a hello has begun */
        } else if (!reader->draft_fields) {
            return CONTACTFPGA_CONTENT;
        }
        if (size < contactfpga__least(kind)) return CONTACTFPGA_CONTENT;
        if (kind == CONTACTFPGA__CHECK) {
            *whole = true;
            return length > 2u + size ? CONTACTFPGA_LENGTH : contactfpga__finish_hello(reader, data + 2);
        }
        if (kind != CONTACTFPGA__STATE) {
            reader->draft_crc = contactfpga__crc32(reader->draft_crc, data, 2u + size);
            reader->draft_bytes = (uint16_t)(reader->draft_bytes + 2 + size);
        }
        if (reader->draft_bytes > CONTACTFPGA__LONGEST_HELLO) return CONTACTFPGA_CONTENT;
        contactfpga__take_field(reader, kind, data + 2, size);
        data += 2 + size, length -= 2u + size;
    }
    return CONTACTFPGA__FINE;
}

static inline bool contactfpga__same_sheet(const contactfpga_hello *one, const contactfpga_hello *other) {
    return one->rows == other->rows && one->columns == other->columns && one->connectivity == other->connectivity
        && one->report == other->report && one->fraction_bits == other->fraction_bits
        && one->zone_capacity == other->zone_capacity && one->pitch_x_mm == other->pitch_x_mm
        && one->pitch_y_mm == other->pitch_y_mm && one->plane == other->plane
        && (one->plane || one->radius_mm == other->radius_mm) && one->closed == other->closed
        && one->extent == other->extent && one->levels == other->levels && one->ghosts == other->ghosts
        && !memcmp(one->fingerprint, other->fingerprint, sizeof one->fingerprint);
}

static inline bool contactfpga__same_units(const contactfpga_hello *one, const contactfpga_hello *other) {
    return one->units == other->units && one->unit_bits == other->unit_bits && one->sums == other->sums
        && one->sum_bits == other->sum_bits && one->spacing_clocks == other->spacing_clocks
        && one->sweep_clocks == other->sweep_clocks;
}

/* The board was restarted, or is another one: what it said of its lines and units holds no longer. */
static inline void contactfpga__forget(contactfpga_reader *reader) {
    memset(reader->lines, 0, sizeof reader->lines);
    reader->swept = reader->sweep_timed = false;
}

/* ---- how many frames there were, and when ---- */

static inline void contactfpga__restart_time(contactfpga_reader *reader) {
    reader->met = reader->known = reader->forgot = reader->timed = reader->before = false;
    reader->waiting = 0;
    reader->next = 0;
    reader->last_us = -1;
    reader->epoch = 0;
}

/* A hello tells how many frames were sent and which multiple of 2^22 us it is. */
static inline void contactfpga__take_hello(contactfpga_reader *reader) {
    const contactfpga_hello *hello = &reader->draft;
    reader->stats.hellos++;
    if (reader->greeted && !contactfpga__same_sheet(&reader->hello, hello)) {
        reader->stats.skin_changes++;
        contactfpga__forget(reader);
        contactfpga__restart_time(reader);
    }
    if (reader->met) {
        uint64_t first = reader->next;
        bool forgot = reader->forgot && !contactfpga_may_number(hello->heard);
        int64_t end_us = (int64_t)((hello->epoch + UINT64_C(1)) * CONTACTFPGA__EPOCH_US);
        if (forgot || hello->sent < reader->next || end_us <= reader->last_us - CONTACTFPGA__BEGUN_US) {
            reader->stats.restarts++;
            contactfpga__forget(reader);
            reader->before = false;
            reader->last_us = -1;
            first = 0;
        }
        if (hello->sent > first + reader->waiting)
            reader->stats.lost += hello->sent - first - reader->waiting;
    }
    reader->met = reader->known = reader->greeted = true;
    reader->next = hello->sent, reader->epoch = hello->epoch;
    reader->timed = reader->forgot = false;
    reader->waiting = 0;
    if (!hello->units) reader->swept = false;
    if (!contactfpga__same_units(&reader->hello, hello)) reader->sweep_timed = false;
    reader->hello = *hello;
    reader->widths = contactfpga__widths(hello);
}

static inline uint8_t contactfpga__gap(const contactfpga_reader *reader, uint8_t sequence) {
    return (uint8_t)(sequence - (uint8_t)reader->next);
}

/* The time since power-up of a frame that carries these; false where it is not known. */
static inline bool contactfpga__explain(
    contactfpga_reader *reader, uint32_t time_us, uint8_t sequence, uint8_t heard, uint64_t *full_us) {
    if (!reader->known) return false;
    if (reader->before) {
        if (reader->before_heard && !heard) {
            reader->forgot = true; /* only a restart forgets a request */
            return false;
        }
        /* A board that has heard no request begins again at 0 in a restart, and when its time wraps. */
        bool begins = heard != reader->before_heard
            || (!heard && time_us < (reader->time_us & (CONTACTFPGA__WRAP_US - 1)));
        if (contactfpga__gap(reader, sequence) && time_us < CONTACTFPGA__BEGUN_US && begins) return false;
    }
    if (!reader->timed) { /* from one epoch before the hello's to three after it */
        int64_t first_us = ((int64_t)reader->epoch - 1) * (int64_t)CONTACTFPGA__EPOCH_US;
        uint64_t into = ((uint64_t)time_us - (uint64_t)first_us) & (CONTACTFPGA__WRAP_US - 1);
        int64_t full = first_us + (int64_t)into;
        *full_us = (uint64_t)full;
        return full > reader->last_us;
    }
    uint64_t step = ((uint64_t)time_us - reader->time_us) & (CONTACTFPGA__WRAP_US - 1);
    *full_us = reader->time_us + step;
    return step > 0 && step <= CONTACTFPGA__EPOCH_US;
}

static inline bool contactfpga__take_time(contactfpga_reader *reader, contactfpga_frame *frame, uint32_t time_us) {
    if (!contactfpga__explain(reader, time_us, frame->sequence, frame->heard, &frame->time_us)) {
        reader->known = false;
        reader->waiting++;
        reader->stats.unexplained++;
        return false;
    }
    uint8_t gap = contactfpga__gap(reader, frame->sequence);
    reader->stats.frames++;
    reader->stats.lost += gap;
    if (reader->before)
        reader->stats.overwritten +=
            (frame->overwritten - reader->before_overwritten) & ((UINT32_C(1) << reader->widths.overwritten) - 1);
    reader->next += gap + 1u;
    reader->time_us = frame->time_us;
    reader->last_us = (int64_t)frame->time_us;
    reader->timed = reader->before = true;
    reader->before_heard = frame->heard;
    reader->before_overwritten = frame->overwritten;
    return true;
}

/* ---- frames ---- */

static inline bool contactfpga__read_zone(const contactfpga_reader *reader, uint16_t index, contactfpga_zone *zone) {
    const contactfpga_widths *w = &reader->widths;
    const uint8_t *record = reader->packet + (size_t)index * w->record_bytes;
    uint32_t fields[8];
    unsigned used = 0;
    for (int i = 0; i < 8; used += w->record[i++]) fields[i] = contactfpga__bits(record, used, w->record[i]);
    uint32_t first = fields[1], second = fields[2];
    bool divided = reader->hello.report == CONTACTFPGA_BARYCENTER;
    zone->area = fields[0];
    if (divided && !zone->area && w->cells == 1u << w->record[0]) zone->area = w->cells;
    zone->sum_x = divided ? 0 : first, zone->sum_y = divided ? 0 : second;
    zone->x = divided ? first : 0, zone->y = divided ? second : 0;
    zone->turned = fields[3];
    zone->left = (uint8_t)fields[4], zone->right = (uint8_t)fields[5];
    zone->top = (uint8_t)fields[6], zone->bottom = (uint8_t)fields[7];
    zone->winding = CONTACTFPGA_PLAIN;
    if (reader->hello.closed && zone->area && zone->turned >= zone->area)
        zone->winding = zone->turned == zone->area ? CONTACTFPGA_RING : CONTACTFPGA_WOUND;
    return !contactfpga__bits(record, used, 8u * w->record_bytes - used);
}

/* Whether a zone may have its extent: it is on the sheet, has a place for each cell, is not longer or wider than so many
 * cells reach, and holds the barycenter. */
static inline bool contactfpga__has_extent(const contactfpga_hello *hello, const contactfpga_zone *zone) {
    uint32_t columns = hello->columns, left = zone->left, right = zone->right;
    if (left >= columns || right >= columns || (left > right && !hello->closed)) return false;
    if (zone->top > zone->bottom || zone->bottom >= hello->rows) return false;
    uint32_t width = (right + columns - left) % columns + 1, height = zone->bottom - zone->top + 1u;
    if (width > zone->area || height > zone->area || zone->area > width * height) return false;
    bool divided = hello->report == CONTACTFPGA_BARYCENTER;
    uint32_t scale = divided ? UINT32_C(1) << hello->fraction_bits : zone->area;
    uint32_t x = divided ? zone->x : zone->sum_x, y = divided ? zone->y : zone->sum_y;
    if (y < zone->top * scale || y > zone->bottom * scale) return false;
    if (zone->winding != CONTACTFPGA_PLAIN) return left == 0 && right == columns - 1;
    uint32_t along = (x + columns * zone->turned + (columns - left) * scale) % (columns * scale);
    return width == columns || along <= (width - 1) * scale;
}

static inline uint32_t contactfpga__cell(const contactfpga_reader *reader, size_t row, unsigned column) {
    const contactfpga_widths *w = &reader->widths;
    return contactfpga__bits(reader->packet + row * w->item_bytes, column * w->cell, w->cell);
}

/* Zones that cannot be, or that do not add up; only asked where the board flags no mismatch. */
static inline bool contactfpga__adds_up(const contactfpga_reader *reader, const contactfpga_frame *frame) {
    const contactfpga_hello *hello = &reader->hello;
    uint32_t most_x = hello->columns - 1u, most_y = hello->rows - 1u, carried = 0;
    for (uint16_t i = 0; i < frame->items; i++) {
        if (hello->report == CONTACTFPGA_CELLS) {
            for (uint8_t column = 0; column < hello->columns; column++) carried += contactfpga__cell(reader, i, column) > 0;
            continue;
        }
        contactfpga_zone zone;
        contactfpga__read_zone(reader, i, &zone);
        bool inside = zone.sum_x <= zone.area * most_x && zone.sum_y <= zone.area * most_y
            && zone.x <= most_x << hello->fraction_bits && zone.y <= most_y << hello->fraction_bits;
        if (zone.winding == CONTACTFPGA_WOUND && zone.turned + 1 != UINT32_C(1) << reader->widths.area) return false;
        if (!zone.area || !inside || (hello->extent && !contactfpga__has_extent(hello, &zone))) return false;
        carried += zone.area;
    }
    bool overflow = hello->report != CONTACTFPGA_CELLS && frame->flags & CONTACTFPGA_OVERFLOW;
    return overflow ? carried < frame->cells : carried == frame->cells;
}

/* Bits behind the last column of bitmap rows, or behind the last field of records, are zeros, and no cell has a level that
 * the board lacks. */
static inline bool contactfpga__filled_up(const contactfpga_reader *reader, uint16_t items) {
    for (uint16_t i = 0; i < items; i++) {
        contactfpga_zone zone;
        unsigned bytes = reader->widths.item_bytes, used = (unsigned)reader->hello.columns * reader->widths.cell;
        const uint8_t *row = reader->packet + (size_t)i * bytes;
        if (reader->hello.report == CONTACTFPGA_CELLS ? contactfpga__bits(row, used, 8 * bytes - used)
                                                      : !contactfpga__read_zone(reader, i, &zone))
            return false;
        for (unsigned column = 0; reader->hello.levels > 1 && column < reader->hello.columns; column++)
            if (contactfpga__cell(reader, i, column) > reader->hello.levels) return false;
    }
    return true;
}

/* An unsealed packet, ``length`` plain bytes in reader->packet, of a kind that frames have. */
static inline int contactfpga__read_frame(
    contactfpga_reader *reader, size_t length, contactfpga_frame *frame, uint32_t *time_us) {
    const contactfpga_widths *w = &reader->widths;
    uint8_t last = reader->packet[length - 1];
    if (last >> 4 != CONTACTFPGA__KIND_ZONES + reader->hello.report) return CONTACTFPGA_KIND;
    if (length < w->trailer_bytes || (length - w->trailer_bytes) % w->item_bytes) return CONTACTFPGA_LENGTH;
    size_t body = length - w->trailer_bytes;
    const uint8_t *trailer = reader->packet + body;
    bool cells = reader->hello.report == CONTACTFPGA_CELLS;
    *time_us = contactfpga__bits(trailer, 0, 24);
    frame->sequence = trailer[3];
    frame->heard = trailer[4] & 7;
    frame->cells = (uint16_t)contactfpga__bits(trailer, 35, w->area);
    frame->zones = (uint16_t)contactfpga__bits(trailer, 35u + w->area, w->zones);
    frame->overwritten = contactfpga__bits(trailer, 35u + w->area + w->zones, w->overwritten);
    frame->flags = last & 15;
    uint16_t expected = cells ? reader->hello.rows : frame->zones;
    uint16_t carried = expected < w->max_items ? expected : w->max_items;
    bool overflow = frame->flags & CONTACTFPGA_OVERFLOW;
    if (body / w->item_bytes != carried || overflow != (carried < expected)) return CONTACTFPGA_LENGTH;
    frame->items = carried;
    if (frame->zones > (cells ? 0 : w->max_zones) || !contactfpga__filled_up(reader, carried)) return CONTACTFPGA_CONTENT;
    if (!(frame->flags & CONTACTFPGA_MISMATCH) && (frame->cells > w->cells || !contactfpga__adds_up(reader, frame)))
        return CONTACTFPGA_CONTENT;
    return CONTACTFPGA__FINE;
}

/* ---- faults ---- */

static inline unsigned contactfpga__line_bits(const contactfpga_hello *hello) {
    return (hello->guard ? hello->rows + 2u * hello->columns + 1 : 0) + hello->self_test;
}

/* Whether bytes are a word of so many bits in digits of seven. */
static inline int contactfpga__check_word(const uint8_t *data, size_t length, unsigned bits) {
    if (length != (bits + 6) / 7) return CONTACTFPGA_LENGTH;
    for (size_t i = 0; i < length; i++)
        if (!(data[i] & 0x80)) return CONTACTFPGA_CONTENT;
    return bits % 7 && (data[length - 1] & 0x7F) >> bits % 7 ? CONTACTFPGA_CONTENT : CONTACTFPGA__FINE;
}

/* An unsealed packet of kind faults; slots of the self-test are checked and not kept. */
static inline int contactfpga__take_faults(contactfpga_reader *reader, size_t length, contactfpga_event *event) {
    const contactfpga_hello *hello = &reader->hello;
    const uint8_t *data = reader->packet;
    if (data[length - 1] & 1) {
        if (length < 3 || !(data[0] & data[1] & 0x80)) return CONTACTFPGA_CONTENT;
        return contactfpga__check_word(data + 2, length - 3, (unsigned)hello->rows + hello->columns);
    }
    int found = contactfpga__check_word(data, length - 1, contactfpga__line_bits(hello));
    if (found != CONTACTFPGA__FINE) return found;
    reader->stats.fault_reports++;
    for (size_t i = 0; i + 1 < length; i++) {
        if (reader->lines[i] != (data[i] & 0x7F)) *event = CONTACTFPGA_FAULTS;
        reader->lines[i] = data[i] & 0x7F;
    }
    return found;
}

static inline bool contactfpga__line(const contactfpga_reader *reader, unsigned bit) {
    return reader->lines[bit / 7] >> bit % 7 & 1;
}

/* ---- pressure units ---- */

/* The readings of an unsealed packet; returns false where they are not written as they must be. */
static inline bool contactfpga__read_sweep(const contactfpga_reader *reader, contactfpga_sweep *sweep, uint64_t *trailer) {
    const contactfpga_hello *hello = &reader->hello;
    unsigned digits = (hello->unit_bits + 6u) / 7, body = hello->units * digits;
    uint32_t full = (UINT32_C(1) << hello->unit_bits) - 1;
    for (unsigned i = 0; i < body + 5; i++)
        if (!(reader->packet[i] & 0x80)) return false;
    memset(sweep, 0, sizeof *sweep);
    for (unsigned unit = 0; unit < hello->units; unit++) {
        uint32_t reading = (uint32_t)contactfpga__number(reader->packet + unit * digits, digits);
        if (reading > full) return false;
        if (!reading || reading == full) sweep->saturated |= (uint8_t)(1u << unit);
        sweep->readings[unit] = reading;
    }
    *trailer = contactfpga__number(reader->packet + body, 5);
    return !(*trailer >> 32);
}

/* An unsealed packet of kind units. Its time is that of about now, which the last frame tells. */
static inline int contactfpga__take_sweep(contactfpga_reader *reader, size_t length, contactfpga_event *event) {
    contactfpga_sweep sweep;
    uint64_t trailer;
    if (length != reader->hello.units * ((reader->hello.unit_bits + 6u) / 7) + 6) return CONTACTFPGA_LENGTH;
    if (!contactfpga__read_sweep(reader, &sweep, &trailer)) return CONTACTFPGA_CONTENT;
    sweep.sequence = (uint8_t)(trailer >> 24);
    sweep.over = reader->packet[length - 1] & 1, sweep.armed = reader->packet[length - 1] >> 1 & 1;
    reader->stats.sweeps++;
    if (reader->swept) reader->stats.sweeps_lost += (uint8_t)(sweep.sequence - reader->sweep_sequence - 1);
    reader->swept = true, reader->sweep_sequence = sweep.sequence;
    const int64_t half = (int64_t)CONTACTFPGA__WRAP_US / 2;
    uint64_t ahead = ((trailer & (CONTACTFPGA__WRAP_US - 1)) - (uint64_t)reader->last_us + (uint64_t)half)
        & (CONTACTFPGA__WRAP_US - 1);
    sweep.time_us = reader->last_us + (int64_t)ahead - half;
    bool placed = reader->known && reader->last_us >= 0;
    if (!placed || (reader->sweep_timed && sweep.time_us <= reader->sweep.time_us)) {
        reader->stats.sweeps_unexplained++;
        return CONTACTFPGA__FINE;
    }
    reader->sweep_timed = true;
    reader->sweep = sweep;
    *event = CONTACTFPGA_SWEEP;
    return CONTACTFPGA__FINE;
}

/* ---- packets ---- */

/* Undo the stuffing in place; returns the plain bytes, or 0 where the blocks do not fit the length. */
static inline size_t contactfpga__unstuff(uint8_t *data, size_t length) {
    size_t from = 0, to = 0;
    while (from < length) {
        uint8_t code = data[from];
        size_t end = from + code;
        if (!code || end > length) return 0;
        for (from++; from < end;) data[to++] = data[from++];
        if (code < 255 && from < length) data[to++] = 0;
    }
    return to;
}

/* Whether the check of a packet with this last byte covers nothing but its stuffed bytes. */
static inline bool contactfpga__is_bare(uint8_t last) {
    return last >> 4 == CONTACTFPGA__KIND_HELLO || last >> 4 == 2 || last >> 4 == 3;
}

static inline int contactfpga__take_packet(contactfpga_reader *reader, size_t length, contactfpga_event *event) {
    uint8_t *data = reader->packet, check[CONTACTFPGA__CHECK_BYTES];
    if (length < CONTACTFPGA__CHECK_BYTES + 2) return CONTACTFPGA_FRAMING;
    const uint8_t *sent = data + length - CONTACTFPGA__CHECK_BYTES;
    if (!reader->greeted && sent[0] & sent[1] & sent[2] & 0x80 && sent[2] < 0x84
        && !contactfpga__is_bare(sent[-1])) {
        reader->stats.before_hello++;
        return CONTACTFPGA__FINE;
    }
    uint8_t last = sent[-1];
    uint16_t crc = 0xFFFF;
    if (reader->greeted && !contactfpga__is_bare(last)) crc = contactfpga__crc16(crc, reader->hello.fingerprint, 2);
    contactfpga__check_bytes(contactfpga__crc16(crc, data, length - CONTACTFPGA__CHECK_BYTES), check);
    if (memcmp(check, sent, sizeof check)) return CONTACTFPGA_CRC;
    length = contactfpga__unstuff(data, length - CONTACTFPGA__CHECK_BYTES);
    if (!length || data[length - 1] != last) return CONTACTFPGA_FRAMING;
    uint8_t kind = last >> 4;
    if (kind == 2 || kind == 3) { /* protocol 1 */
        reader->stats.foreign_version++;
        if ((last & 0xF8) == 0x20 && length == 26) {
            reader->greeted = false;
            contactfpga__restart_time(reader);
        }
        return CONTACTFPGA_REASONS + 1;
    }
    if (kind == CONTACTFPGA__KIND_HELLO) {
        bool whole;
        int found = contactfpga__read_hello(reader, data, length - 1, &whole);
        if (whole || found != CONTACTFPGA__FINE) reader->draft_fields = 0;
        if (found != CONTACTFPGA__FINE || !whole) return found;
        contactfpga__take_hello(reader);
        *event = CONTACTFPGA_HELLO;
        return found;
    }
    if (kind == CONTACTFPGA__KIND_FAULTS && reader->greeted && contactfpga__line_bits(&reader->hello))
        return contactfpga__take_faults(reader, length, event);
    if (kind == CONTACTFPGA__KIND_UNITS && reader->greeted && reader->hello.units)
        return contactfpga__take_sweep(reader, length, event);
    if (kind < CONTACTFPGA__KIND_ZONES || kind > CONTACTFPGA__KIND_ZONES + 2) {
        reader->stats.unknown_kinds++;
        return CONTACTFPGA__FINE;
    }
    contactfpga_frame frame;
    uint32_t time_us;
    int found = contactfpga__read_frame(reader, length, &frame, &time_us);
    if (found == CONTACTFPGA__FINE && contactfpga__take_time(reader, &frame, time_us)) {
        reader->frame = frame;
        *event = CONTACTFPGA_FRAME;
    }
    return found;
}

static inline void contactfpga__refuse(contactfpga_reader *reader, int reason) {
    if (reader->begun) { /* the first piece is cut off by when we began to listen; it is no damage */
        reader->stats.damaged[reason]++;
        reader->damage = true;
    }
    reader->begun = true;
}

static inline contactfpga_event contactfpga_push(contactfpga_reader *reader, uint8_t byte) {
    contactfpga_event event = CONTACTFPGA_NOTHING;
    reader->stats.bytes++;
    reader->frame.items = 0; /* its bytes are about to be overwritten */
    if (byte) {
        if (reader->length == CONTACTFPGA_PACKET_BYTES) {
            contactfpga__refuse(reader, CONTACTFPGA_NOISE);
            reader->length = 0;
            return event;
        }
        reader->packet[reader->length++] = byte;
        return event;
    }
    size_t length = reader->length;
    reader->length = 0;
    if (!length) return event;
    int found = contactfpga__take_packet(reader, length, &event);
    if (found < CONTACTFPGA__FINE) {
        contactfpga__refuse(reader, found);
    } else if (found == CONTACTFPGA__FINE) {
        reader->begun = true;
        reader->stats.resynchronized += reader->damage;
        reader->damage = false;
    }
    return event;
}

static inline size_t contactfpga_of_sheet(uint8_t *packet, size_t length, uint8_t *number) {
    if (length < CONTACTFPGA__CHECK_BYTES + 4) return 0;
    uint8_t *check = packet + length - CONTACTFPGA__CHECK_BYTES;
    if (check[-2] != 2 || check[-1] >> 4 != CONTACTFPGA__KIND_NUMBERED) return 0;
    uint16_t crc = (uint16_t)((check[0] & 0x7F) | (check[1] & 0x7F) << 7 | (check[2] & 3) << 14);
    for (int place = 1; place <= 2; place++) { /* the CRC before these two bytes, which the ordinary packet lacks */
        for (int bit = 0; bit < 8; bit++) crc = (uint16_t)(crc & 0x8000 ? (crc ^ 0x8408) << 1 | 1 : crc << 1);
        crc ^= check[-place];
    }
    *number = check[-1] & 0x0F;
    check[-2] = (uint8_t)((check[0] & 0x80) | (crc & 0x7F)); /* what is wrong besides the CRC stays so */
    check[-1] = (uint8_t)((check[1] & 0x80) | (crc >> 7 & 0x7F));
    check[0] = (uint8_t)((check[2] & 0xFC) | crc >> 14);
    return length - 2;
}

static inline void contactfpga_init(contactfpga_reader *reader) {
    memset(reader, 0, sizeof *reader);
    reader->last_us = -1;
}

static inline void contactfpga_doubt(contactfpga_reader *reader) {
    reader->known = false;
}

static inline bool contactfpga_zone_at(const contactfpga_reader *reader, uint16_t index, contactfpga_zone *zone) {
    if (index >= reader->frame.items || reader->hello.report == CONTACTFPGA_CELLS) return false;
    contactfpga__read_zone(reader, index, zone);
    return true;
}

static inline uint8_t contactfpga_level(const contactfpga_reader *reader, uint8_t row, uint8_t column) {
    if (reader->hello.report != CONTACTFPGA_CELLS || row >= reader->frame.items || column >= reader->hello.columns) return 0;
    return (uint8_t)contactfpga__cell(reader, row, column);
}

static inline bool contactfpga_pressed(const contactfpga_reader *reader, uint8_t row, uint8_t column) {
    return contactfpga_level(reader, row, column) > 0;
}

static inline bool contactfpga_row_open(const contactfpga_reader *reader, uint8_t row) {
    return reader->hello.guard && row < reader->hello.rows && contactfpga__line(reader, row);
}

static inline bool contactfpga_column_open(const contactfpga_reader *reader, uint8_t column) {
    const contactfpga_hello *hello = &reader->hello;
    return hello->guard && column < hello->columns && contactfpga__line(reader, (unsigned)hello->rows + column);
}

static inline bool contactfpga_column_stuck(const contactfpga_reader *reader, uint8_t column) {
    const contactfpga_hello *hello = &reader->hello;
    unsigned first = (unsigned)hello->rows + hello->columns;
    return hello->guard && column <= hello->columns && contactfpga__line(reader, first + column);
}

static inline bool contactfpga_lines_joined(const contactfpga_reader *reader) {
    return reader->hello.self_test && contactfpga__line(reader, contactfpga__line_bits(&reader->hello) - 1);
}

static inline void contactfpga_barycenter_mm(
    const contactfpga_reader *reader, const contactfpga_zone *zone, double *x_mm, double *y_mm) {
    bool divided = reader->hello.report == CONTACTFPGA_BARYCENTER;
    double zero = 0.0, steps = divided ? (double)(1u << reader->hello.fraction_bits) : (double)zone->area;
    *x_mm = *y_mm = zero / zero;
    if (!zone->area) return;
    uint32_t around = reader->hello.columns * zone->area, x = divided ? zone->x : zone->sum_x;
    if (reader->hello.closed) x = (x + reader->hello.columns * zone->turned) % around;
    if (zone->winding == CONTACTFPGA_PLAIN) *x_mm = x / steps * reader->hello.pitch_x_mm;
    *y_mm = (divided ? zone->y : zone->sum_y) / steps * reader->hello.pitch_y_mm;
}

static inline bool contactfpga_may_number(uint32_t number) {
    return number < UINT32_C(1) << 21 && number & 0x7F && number >> 7 & 0x7F && number >> 14 & 0x7F && number % 8;
}

static inline bool contactfpga_pulsed(const contactfpga_hello *hello) {
    return (uint64_t)hello->clock_hz + hello->baud / 2 < UINT64_C(4) * hello->baud;
}

/* Digits of seven bits and a last byte as a packet to the board. */
static inline size_t contactfpga__sealed(uint64_t word, size_t digits, uint8_t last, bool pulsed, uint8_t *out) {
    uint8_t plain[CONTACTFPGA_COMMAND_BYTES] = {0};
    size_t bytes = digits + 7, length = 0;
    plain[1] = (uint8_t)(digits + 2);
    for (size_t place = 0; place < digits; place++) plain[2 + place] = (uint8_t)(0x80 | (word >> 7 * place & 0x7F));
    plain[2 + digits] = last;
    contactfpga__check_bytes(contactfpga__crc16(0xFFFF, plain + 1, digits + 2), plain + 3 + digits);
    if (!pulsed) {
        memcpy(out, plain, bytes);
        return bytes;
    }
    for (size_t i = 0; i < bytes; i++) {
        if (!plain[i]) out[length++] = 0xF0;
        for (int bit = 0; plain[i] && bit < 8; bit++) out[length++] = plain[i] >> bit & 1 ? 0xFF : 0x00;
    }
    return length;
}

static inline size_t contactfpga_request(uint32_t number, bool hello, bool pulsed, uint8_t *out) {
    if (!contactfpga_may_number(number)) return 0;
    return contactfpga__sealed(number, 3, (uint8_t)(CONTACTFPGA__KIND_REQUEST << 4 | hello), pulsed, out);
}

static inline size_t contactfpga_command(
    uint32_t number, uint8_t what, uint32_t value, bool hello, bool pulsed, uint8_t *out) {
    if (!contactfpga_may_number(number) || what > 0x7F || value >> 21) return 0;
    uint64_t word = number | (uint64_t)what << 21 | (uint64_t)value << 28;
    return contactfpga__sealed(word, 7, (uint8_t)(CONTACTFPGA__KIND_COMMAND << 4 | hello), pulsed, out);
}

static inline bool contactfpga_unit_value(
    const contactfpga_hello *hello, uint8_t what, uint8_t place, uint32_t steps, uint32_t *value) {
    bool sum = what == CONTACTFPGA_SUM_THRESHOLD;
    uint8_t bits = sum ? hello->sum_bits : hello->unit_bits, shift = bits > 18 ? (uint8_t)(bits - 18) : 0;
    if (what < CONTACTFPGA_ZERO || what > CONTACTFPGA_SUM_THRESHOLD || place >= (sum ? hello->sums : hello->units)
        || bits > CONTACTFPGA__SUM_BITS || (bits < 32 && steps >> bits))
        return false;
    uint32_t kept = steps >> shift;
    if (steps && !kept && what != CONTACTFPGA_ZERO) kept = 1; /* rounded down, but a threshold stays one */
    *value = kept << 3 | place;
    return true;
}

#ifdef __cplusplus
}
#endif
#endif
