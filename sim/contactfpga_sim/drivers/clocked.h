// The generated model with one clock, driven a cycle at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "model.cpp"

#define EXPORT extern "C" __attribute__((visibility("default")))

template <size_t Bits>
void put(cxxrtl::value<Bits> &port, unsigned __int128 number) {
    constexpr size_t width = cxxrtl::value<Bits>::chunk::bits;
    for (size_t i = 0; i < cxxrtl::value<Bits>::chunks; i++) {
        port.data[i] = static_cast<uint32_t>(number);
        number >>= width;
    }
    port.data[cxxrtl::value<Bits>::chunks - 1] &= cxxrtl::value<Bits>::msb_mask;
}

template <size_t Bits>
unsigned __int128 get(const cxxrtl::value<Bits> &port) {
    unsigned __int128 number = 0;
    for (size_t i = cxxrtl::value<Bits>::chunks; i-- > 0;)
        number = number << 32 | port.data[i];
    return number;
}

template <size_t Bits>
unsigned __int128 get(const cxxrtl::wire<Bits> &port) {
    return get(port.curr);
}

// A cycle is: put the inputs, settle(), read the outputs as they are in this cycle, finish().
// The clock never falls: nothing in the gateware looks at that edge, and it would cost an evaluation.
class Clocked {
public:
    cxxrtl_design::p_top top;

    Clocked() { loops_ = !top.eval(); }

    void settle() {
        if (loops_) {
            top.p_clk = cxxrtl::value<1>{0u};
            top.prev_p_clk = cxxrtl::value<1>{0u};
            while (top.eval(), top.commit()) {}
        }
        top.prev_p_clk = cxxrtl::value<1>{0u};
        top.p_clk = cxxrtl::value<1>{1u};
        top.eval();
    }

    void finish() { top.commit(); }

private:
    bool loops_;  // the generated code asks to be evaluated until nothing changes
};
