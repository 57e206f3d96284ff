// The shift registers between a board and its sheet, a cycle at a time; see contactfpga_sim/model/sheet/shift.py.
#pragma once

#include <cstdint>
#include <type_traits>

// A bit per line of the rows or of the columns: of 64, and a guard line.
using Word = std::conditional_t<(ROW_LINES > 64 || COLUMN_LINES > 64), unsigned __int128, uint64_t>;

constexpr Word mask(unsigned bits) { return bits == 8 * sizeof(Word) ? ~Word{0} : (Word{1} << bits) - 1; }
constexpr uint64_t high_half(Word word) { return static_cast<uint64_t>(word >> 32 >> 32); }
inline unsigned lowest(Word word) {
    const auto low = static_cast<uint64_t>(word);
    return low ? __builtin_ctzll(low) : 64 + __builtin_ctzll(high_half(word));
}
inline unsigned count(Word word) {
    return __builtin_popcountll(static_cast<uint64_t>(word)) + __builtin_popcountll(high_half(word));
}

// What registers hold at power-up: random bits, the same in every run. By xorshift64* (Vigna 2016), as <random> takes
// longer to compile than all of the drivers.
template <size_t COUNT>
void power_up(Word (&registers)[COUNT], unsigned bits, unsigned seed) {
    uint64_t state = seed * 0x9E3779B97F4A7C15ull;
    for (auto &content : registers) {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        content = state * 0x2545F4914F6CDD1Dull & mask(bits);
    }
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
    Word step(uint64_t data, bool clock, bool latch, bool enable_n, Word released) {
        Word levels = 0;
        for (unsigned chain = 0; chain < CHAINS; chain++) {
            Word &bits = bits_[chain];
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
    Word bits_[CHAINS], latched_[CHAINS];
    uint64_t data_ = 0;
    bool clock_ = true, latch_ = true;
};

// CHAINS chains of 74HC165 for LINES lines: takes the columns while its load pin is low, then gives the lowest bit first.
template <unsigned LINES, unsigned CHAINS>
class ColumnRegisters {
public:
    ColumnRegisters() { power_up(bits_, length, 3); }

    uint64_t step(bool load_n, bool clock, Word columns) {
        uint64_t data = 0;
        for (unsigned chain = 0; chain < CHAINS; chain++) {
            Word &bits = bits_[chain];
            if (!load_n)
                bits = columns >> chain * length & mask(length);
            else if (clock && !clock_)
                bits >>= 1;
            data |= static_cast<uint64_t>(bits & 1) << chain;
        }
        clock_ = clock;
        return data;
    }

private:
    static constexpr unsigned length = (LINES + CHAINS - 1) / CHAINS;
    Word bits_[CHAINS];
    bool clock_ = true;
};
