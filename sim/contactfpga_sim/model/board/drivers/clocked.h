// The generated model with one clock, driven a cycle at a time.
#pragma once

#include <cstdint>
#include <type_traits>
#include <vector>

#include <cxxrtl/cxxrtl.h>

// Found before CXXRTL's own by the generated code, which lives in this namespace: registers and memories that do less in
// a clock.
namespace cxxrtl_design {

// Commits without telling, and without finding out, whether anything changed.
struct Blind : cxxrtl::observer {};

template <size_t Bits>
struct wire : cxxrtl::wire<Bits> {
    using cxxrtl::wire<Bits>::wire;

    template <class Observer>
    bool commit(Observer &observer) {
        if constexpr (!std::is_same_v<Observer, Blind>)
            return told(observer);
        this->curr = this->next;
        return false;
    }

private:
    // One for each width: written out for each register it would take a tenth of the time to compile, and hardly any
    // design needs it.
    template <class Observer>
    __attribute__((noinline)) bool told(Observer &observer) {
        return cxxrtl::wire<Bits>::commit(observer);
    }
};

template <size_t Width>
struct memory : cxxrtl::memory<Width> {
    using cxxrtl::memory<Width>::memory;

    // Queues a write only where one bit at least is enabled.
    CXXRTL_ALWAYS_INLINE void update(size_t index, const cxxrtl::value<Width> &word, const cxxrtl::value<Width> &enabled,
                                     int priority) {
        if (enabled)
            cxxrtl::memory<Width>::update(index, word, enabled, priority);
    }
};

}  // namespace cxxrtl_design

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
    cxxrtl_design::i_design top;

    Clocked() { loops_ = !top.eval(); }

    // May be called again in the same clock, after inputs have changed.
    void settle() {
        if (!loops_)
            return rise();
        top.p_clk = cxxrtl::value<1>{0u};
        top.prev_p_clk = cxxrtl::value<1>{0u};
        while (top.eval(), top.commit()) {}
    }

    void finish() {
        if (loops_)
            rise();
        cxxrtl_design::Blind blind;
        top.commit(blind);
    }

private:
    void rise() {
        top.prev_p_clk = cxxrtl::value<1>{0u};
        top.p_clk = cxxrtl::value<1>{1u};
        top.eval();
    }

    bool loops_;  // the generated code asks to be evaluated until nothing changes
};
