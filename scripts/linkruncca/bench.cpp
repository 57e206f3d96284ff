// Feeds frames with their blank border to a labeller behind the pixel port, a cell per clock, and keeps every record with
// its cycle. Cycles count from the one in which the first cell is given.
#include "clocked.h"

struct Record {
    uint64_t cycle, zone;
};

class Bench {
public:
    std::vector<Record> records;

    void run(const uint64_t *rows, size_t frames) {
        records.clear();
        cycle_ = 0;
        // A reset has to last until what delays rows is blank: that need not know of a reset.
        for (size_t i = 0; i < 2 * WIDTH + 16; i++)
            clock({}, true);
        const size_t height = PERIOD / WIDTH;
        // Further rows let the last records out.
        for (size_t row = 0; row < frames * height + 2; row++) {
            const size_t frame = row / height, y = row % height;
            const uint64_t word = frame < frames && y < SIZE ? rows[frame * SIZE + y] : 0;
            for (size_t x = 0; x < WIDTH; x++) {
                clock({x < SIZE && (word >> x & 1), x, y}, false);
                cycle_++;
            }
        }
    }

private:
    struct Cell {
        bool pressed;
        size_t x, y;
    };

    Clocked model_;
    uint64_t cycle_ = 0;

    void clock(Cell cell, bool reset) {
        put(model_.top.p_rst, reset);
        put(model_.top.p_pressed, cell.pressed);
        put(model_.top.p_x, cell.x);
        put(model_.top.p_y, cell.y);
        model_.settle();
        if (!reset && get(model_.top.p_found))
            records.push_back({cycle_, static_cast<uint64_t>(get(model_.top.p_zone))});
        model_.finish();
    }
};

EXPORT Bench *bench_new() { return new Bench; }
EXPORT void bench_free(Bench *bench) { delete bench; }
EXPORT void bench_run(Bench *bench, const uint64_t *rows, size_t frames) { bench->run(rows, frames); }
EXPORT const Record *bench_records(Bench *bench, size_t *count) {
    *count = bench->records.size();
    return bench->records.data();
}
