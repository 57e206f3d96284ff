// The other end of a board's line, with BIT_CLOCKS clocks to a bit, and what is noted of a board.
#pragma once

#include <cstdint>
#include <deque>

struct Event {
    uint64_t cycle, data, mark;
};

// Sends bytes to the board, back to back from the cycle they are handed in.
class Sender {
public:
    std::deque<uint8_t> bytes;
    uint64_t low = 0;  // clocks for which the pin is low, before anything else

    bool level() {
        if (low) {
            low--;
            return false;
        }
        if (clocks_ == 0) {
            if (bytes.empty())
                return true;
            frame_ = 1u << 9 | bytes.front() << 1;
            bytes.pop_front();
            clocks_ = 10 * BIT_CLOCKS;
        }
        return frame_ >> (10 - (clocks_-- + BIT_CLOCKS - 1) / BIT_CLOCKS) & 1;
    }

private:
    unsigned frame_ = 0, clocks_ = 0;
};

// Reads the board's line as a UART does: in the middle of each bit after a falling edge.
class Reader {
public:
    uint64_t broken = 0;  // bytes without a stop bit

    // True when a byte is complete; its stop bit then has `rest` clocks to go.
    bool take(bool level, uint8_t &byte) {
        if (clock_ < 0) {
            if (level || !last_) {
                last_ = level;
                return false;
            }
            clock_ = 0;
        }
        last_ = level;
        const int bit = clock_ / BIT_CLOCKS;
        const bool middle = clock_ % BIT_CLOCKS == BIT_CLOCKS / 2;
        clock_++;
        if (!middle)
            return false;
        if (bit == 0 && level)
            clock_ = -1;  // too short for a start bit
        if (bit >= 1 && bit <= 8)
            byte_ = byte_ >> 1 | level << 7;
        if (bit < 9)
            return false;
        clock_ = -1;
        broken += !level;
        byte = byte_;
        return level;
    }

    static constexpr unsigned rest = BIT_CLOCKS - BIT_CLOCKS / 2;

    bool same(const Reader &other) const {
        return clock_ == other.clock_ && last_ == other.last_ && byte_ == other.byte_;
    }

private:
    int clock_ = -1;
    bool last_ = true;
    uint8_t byte_ = 0;
};
