// The shift registers between a board and its sheet, a cycle at a time; see contactfpga_sim/sheet/shift.py.
#pragma once

#include <cstdint>
#include <random>

constexpr uint64_t mask(unsigned bits) { return bits == 64 ? ~0ull : (1ull << bits) - 1; }

// What registers hold at power-up: random bits, the same in every run.
template <size_t COUNT>
void power_up(uint64_t (&registers)[COUNT], unsigned bits, unsigned seed) {
    std::mt19937_64 random(seed);
    for (auto &content : registers)
        content = random() & mask(bits);
}

// CHAINS chains of 74HC595 for LINES lines: bits move up on a rising shift clock, and to the outputs on a rising latch.
template <unsigned LINES, unsigned CHAINS>
class RowRegisters {
public:
    RowRegisters() {
        power_up(bits_, length, 1);
        power_up(latched_, length, 2);
    }

    // Levels of the outputs in this cycle, or `released` while they are switched off.
    uint64_t step(uint64_t data, bool clock, bool latch, bool enable_n, uint64_t released) {
        uint64_t levels = 0;
        for (unsigned chain = 0; chain < CHAINS; chain++) {
            uint64_t &bits = bits_[chain];
            if (latch && !latch_)
                latched_[chain] = bits;
            if (clock && !clock_)
                bits = (bits << 1 | (data_ >> chain & 1)) & mask(length);
            levels |= latched_[chain] << chain * length;
        }
        data_ = data, clock_ = clock, latch_ = latch;
        return enable_n ? released : levels & mask(LINES);
    }

private:
    static constexpr unsigned length = (LINES + CHAINS - 1) / CHAINS;
    uint64_t bits_[CHAINS], latched_[CHAINS], data_ = 0;
    bool clock_ = true, latch_ = true;
};

// CHAINS chains of 74HC165 for LINES lines: takes the columns while its load pin is low, then gives the lowest bit first.
template <unsigned LINES, unsigned CHAINS>
class ColumnRegisters {
public:
    ColumnRegisters() { power_up(bits_, length, 3); }

    uint64_t step(bool load_n, bool clock, uint64_t columns) {
        uint64_t data = 0;
        for (unsigned chain = 0; chain < CHAINS; chain++) {
            uint64_t &bits = bits_[chain];
            if (!load_n)
                bits = columns >> chain * length & mask(length);
            else if (clock && !clock_)
                bits >>= 1;
            data |= (bits & 1) << chain;
        }
        clock_ = clock;
        return data;
    }

private:
    static constexpr unsigned length = (LINES + CHAINS - 1) / CHAINS;
    uint64_t bits_[CHAINS];
    bool clock_ = true;
};
