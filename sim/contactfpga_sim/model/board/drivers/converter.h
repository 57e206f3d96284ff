// An MCP3208 at the board's pins, edge by edge as Microchip DS21298E has it: single-ended channels, bits on falling edges.
#pragma once
#include <array>
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

// An ADS131M08 as Texas Instruments SBAS950B has it at power-up: all channels at once, 24-bit words, bits on rising edges. A
// result is what the inputs were one and a half periods before it is ready, the first two half a period; two that were not
// read are kept.
class Ads131m08 {
public:
    uint32_t codes[8] = {};
    bool ready_n = true;

    bool step(bool clock, bool select_n, bool pace) {
        if (pace && !pace_) convert();
        if (select_n) {
            bits_ = 0;
            output_ = false;
        } else if (select_n_) {
            if (kept_) last_ = results_[0];
        } else if (clock && !clock_ && bits_ < 240) {
            output_ = word(bits_ / 24) >> (23 - bits_ % 24) & 1;
        } else if (clock_ && !clock && ++bits_ == 240) {
            if (kept_) results_[0] = results_[1], kept_--;
            ready_n = !kept_;
        }
        clock_ = clock, select_n_ = select_n, pace_ = pace;
        return output_;
    }

private:
    using Codes = std::array<uint32_t, 8>;

    void convert() {
        const unsigned into = ++periods_ % 2048;
        if (into == 1024) {
            earlier_ = middles_++ < 2 ? now() : middle_;
            middle_ = now();
        } else if (into == 2044) {
            ready_n = true;
        } else if (into == 0) {
            if (kept_ == 2) results_[0] = results_[1], kept_ = 1;
            results_[kept_++] = earlier_;
            ready_n = false;
        }
    }
    Codes now() const {
        Codes found;
        for (unsigned channel = 0; channel < 8; channel++) found[channel] = codes[channel];
        return found;
    }
    uint32_t word(unsigned place) const {
        if (place == 0) return 0x050000 | (kept_ ? 0xFF00 : 0);
        return place == 9 ? 0xA5A500 : last_[place - 1] ^ 0x800000;
    }

    Codes results_[2] = {}, middle_ = {}, earlier_ = {}, last_ = {};
    unsigned kept_ = 0, periods_ = 0, middles_ = 0, bits_ = 0;
    bool clock_ = false, select_n_ = true, pace_ = false, output_ = false;
};
