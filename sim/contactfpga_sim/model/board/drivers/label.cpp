// Feeds whole frames to a labeller and keeps what comes out, with the cycle of every transfer.
#include <algorithm>

#include "clocked.h"

struct Record {
    uint64_t frame, cycle, zone;
};

struct Timing {
    uint64_t first_row, last_row, end;
};

// xorshift64* (Vigna 2016): the same stalls on every machine.
struct Chance {
    uint64_t state;

    bool operator()(unsigned percent) {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        return (state * 0x2545F4914F6CDD1Dull >> 32) % 100 < percent;
    }
};

class Bench {
public:
    std::vector<Record> records;
    std::vector<Timing> timings;

    // Runs until the last frame's end mark has left; gives up, returning false, after `limit` cycles.
    bool run(const uint64_t *rows, size_t frames, unsigned gap, unsigned stall, uint64_t seed, uint64_t limit) {
        Chance chance{seed | 1};
        records.clear();
        timings.assign(frames, Timing{});
        const size_t total = frames * ROWS;
        size_t next = 0, leaving = 0;
        bool offered = false;
        const uint64_t started = cycle_;
        while (leaving < frames) {
            if (cycle_ - started > limit)
                return false;
            // An offer stands until it is taken: the rule of a stream.
            offered = next < total && (offered || gap == 0 || !chance(gap));
            offer(rows, next, offered);
            bool ready = stall == 0 || !chance(stall);
            put(model_.top.p_records____ready, ready);
            model_.settle();
            if (offered && get(model_.top.p_rows____ready)) {
                note_row(next++);
                offered = false;
            }
            if (ready && get(model_.top.p_records____valid))
                leaving += note_record(leaving);
            model_.finish();
            cycle_++;
        }
        return true;
    }

private:
    Clocked model_;
    uint64_t cycle_ = 0;

    void offer(const uint64_t *rows, size_t next, bool valid) {
        put(model_.top.p_rows____valid, valid);
        if (valid) {
            unsigned __int128 last = next % ROWS == ROWS - 1;
            put(model_.top.p_rows____payload, rows[next] | last << COLUMNS);
        }
    }

    void note_row(size_t row) {
        if (row % ROWS == 0)
            timings[row / ROWS].first_row = cycle_;
        if (row % ROWS == ROWS - 1)
            timings[row / ROWS].last_row = cycle_;
    }

    bool note_record(size_t frame) {
        const auto payload = static_cast<uint64_t>(get(model_.top.p_records____payload));
        const bool end = payload >> ZONE_BITS & 1;
        if (end)
            timings[frame].end = cycle_;
        else
            records.push_back({frame, cycle_, payload & ((1ull << ZONE_BITS) - 1)});
        return end;
    }
};

EXPORT Bench *bench_new() { return new Bench; }
EXPORT void bench_free(Bench *bench) { delete bench; }
EXPORT int bench_run(Bench *bench, const uint64_t *rows, size_t frames, unsigned gap, unsigned stall, uint64_t seed,
                     uint64_t limit) {
    return bench->run(rows, frames, gap, stall, seed, limit);
}
EXPORT const Record *bench_records(Bench *bench, size_t *count) {
    *count = bench->records.size();
    return bench->records.data();
}
EXPORT const Timing *bench_timings(Bench *bench) { return bench->timings.data(); }
