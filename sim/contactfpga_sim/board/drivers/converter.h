// An MCP3208 at the board's pins, edge by edge as Microchip DS21298E has it: single-ended channels, bits on falling edges.
#pragma once
#include <cstdint>

class Mcp3208 {
public:
    uint32_t codes[8] = {};  // what each input would read now

    // Once a clock; the level that it gives.
    bool step(bool clock, bool select_n, bool mosi) {
        const bool rose = clock && !clock_, fell = !clock && clock_;
        if (select_n) {
            rises_ = command_ = 0;
            output_ = false;
        } else if (rose && (rises_ || mosi_)) {
            rises_++;
            command_ = command_ << 1 | mosi_;  // as it was before the edge
        } else if (fell && rises_ == 6) {  // the fifth clock after the start bit
            held_ = codes[command_ >> 1 & 7];
            output_ = false;
        } else if (fell && rises_ >= 7 && rises_ <= 18) {
            output_ = held_ >> (18 - rises_) & 1;
        }
        clock_ = clock, mosi_ = mosi;
        return output_;
    }

private:
    bool clock_ = true, mosi_ = true, output_ = false;
    unsigned rises_ = 0, command_ = 0;
    uint32_t held_ = 0;
};
