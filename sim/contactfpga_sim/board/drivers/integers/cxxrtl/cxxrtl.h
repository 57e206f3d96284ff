// What the code that Yosys writes (write_cxxrtl) is made of, with the machine's integers in the place of CXXRTL's own
// loops over numbers of 32 bits. It compiles in a third of the time and means the same, bit by bit. What this file lacks
// (values above 128 bits, division, assignments to slices) does not compile; CXXRTL's own header then serves.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#define CXXRTL_ALWAYS_INLINE inline __attribute__((always_inline))
#define CXXRTL_ASSERT(condition)

namespace cxxrtl {

template <size_t Bits>
using Unsigned = std::conditional_t<(Bits <= 32), uint32_t, std::conditional_t<(Bits <= 64), uint64_t, unsigned __int128>>;
template <size_t Bits>
using Signed = std::conditional_t<(Bits <= 32), int32_t, std::conditional_t<(Bits <= 64), int64_t, __int128>>;

template <size_t Bits>
struct part;
template <class High, class Low>
struct joined;

// Chunks lie in memory as in CXXRTL: the lowest first, unused bits 0.
template <size_t Bits>
struct value {
    static_assert(Bits <= 128, "wider than the machine's integers");

    struct chunk {
        static constexpr size_t bits = 32;
    };
    static constexpr size_t bits = Bits, chunks = (Bits + 31) / 32;
    static constexpr uint32_t msb_mask = ~0u >> (31 - (Bits + 31) % 32);
    using Number = Unsigned<Bits>;

    uint32_t data[chunks] = {};

    value() = default;
    template <class... Init>
    explicit constexpr value(Init... init) : data{init...} {}

    // What a number of any width leaves in so many bits.
    template <class Integer>
    static CXXRTL_ALWAYS_INLINE value of(Integer number) {
        value result;
        if constexpr (chunks == 1) {
            result.data[0] = static_cast<uint32_t>(number) & msb_mask;
        } else {
            const Number wide = static_cast<Number>(number);
            for (size_t n = 0; n < chunks; n++)
                result.data[n] = static_cast<uint32_t>(wide >> 32 * n);
            result.data[chunks - 1] &= msb_mask;
        }
        return result;
    }

    CXXRTL_ALWAYS_INLINE Number number() const {
        if constexpr (chunks == 1) {
            return data[0];
        } else {
            Number number = 0;
            for (size_t n = 0; n < chunks; n++)
                number |= static_cast<Number>(data[n]) << 32 * n;
            return number;
        }
    }

    CXXRTL_ALWAYS_INLINE Signed<Bits> signed_number() const {
        constexpr size_t unused = 8 * sizeof(Number) - Bits;
        return static_cast<Signed<Bits>>(number() << unused) >> unused;
    }

    CXXRTL_ALWAYS_INLINE explicit operator bool() const { return number() != 0; }
    CXXRTL_ALWAYS_INLINE bool operator==(const value &other) const { return number() == other.number(); }
    CXXRTL_ALWAYS_INLINE bool operator!=(const value &other) const { return number() != other.number(); }

    CXXRTL_ALWAYS_INLINE const value &val() const { return *this; }

    template <size_t Stop, size_t Start = Stop>
    CXXRTL_ALWAYS_INLINE part<Stop - Start + 1> slice() const {
        return {value<Stop - Start + 1>::of(number() >> Start)};
    }

    template <class Low>
    CXXRTL_ALWAYS_INLINE joined<value, Low> concat(const Low &low) const {
        return {*this, low};
    }

    template <size_t Count>
    CXXRTL_ALWAYS_INLINE const value<Count> repeat() const {
        static_assert(Bits == 1, "only of 1 bit");
        return value<Count>::of(-static_cast<Unsigned<Count>>(data[0]));
    }
};

// A copy of some bits: nothing can be assigned to it, as it would be lost.
template <size_t Bits>
struct part : value<Bits> {
    CXXRTL_ALWAYS_INLINE part(const value<Bits> &bits) : value<Bits>(bits) {}
    part &operator=(const part &) = delete;

    template <class Low>
    CXXRTL_ALWAYS_INLINE joined<part, Low> concat(const Low &low) const {
        return {*this, low};
    }
};

// Values side by side, to be read or assigned to.
template <class High, class Low>
struct joined {
    static constexpr size_t bits = High::bits + Low::bits;

    const High &high;
    const Low &low;

    CXXRTL_ALWAYS_INLINE Unsigned<bits> number() const {
        return static_cast<Unsigned<bits>>(high.number()) << Low::bits | low.number();
    }
    CXXRTL_ALWAYS_INLINE value<bits> val() const { return value<bits>::of(number()); }
    CXXRTL_ALWAYS_INLINE operator value<bits>() const { return val(); }

    template <class Lower>
    CXXRTL_ALWAYS_INLINE joined<joined, Lower> concat(const Lower &lower) const {
        return {*this, lower};
    }

    CXXRTL_ALWAYS_INLINE void operator=(const value<bits> &bits) const { assign(*this, bits); }
};

template <size_t Bits>
CXXRTL_ALWAYS_INLINE void assign(const value<Bits> &to, const value<Bits> &from) {
    const_cast<value<Bits> &>(to) = from;  // the generated code assigns to its own variables only
}
template <size_t Bits>
void assign(const part<Bits> &, const value<Bits> &) = delete;
template <class High, class Low>
CXXRTL_ALWAYS_INLINE void assign(const joined<High, Low> &to, const value<joined<High, Low>::bits> &from) {
    assign(to.high, value<High::bits>::of(from.number() >> Low::bits));
    assign(to.low, value<Low::bits>::of(from.number()));
}

template <size_t Bits>
struct wire {
    value<Bits> curr, next;

    wire() = default;
    template <class... Init>
    explicit constexpr wire(Init... init) : curr{init...}, next{init...} {}

    wire(const wire &) = delete;  // a copy is a mistake: the value is meant
    wire &operator=(const wire &) = delete;
    wire(wire &&) = default;
    wire &operator=(wire &&) = default;

    template <class Observer>
    bool commit(Observer &) {
        const bool changed = curr != next;
        curr = next;
        return changed;
    }
};

template <size_t Width>
struct memory {
    struct Write {
        size_t index;
        value<Width> word, enabled;
        int priority;
    };

    std::vector<value<Width>> data;
    std::vector<Write> writes;  // of this clock, those of the highest priority last

    explicit memory(size_t depth) : data(depth) {}

    const value<Width> &operator[](size_t index) const { return data[index]; }

    void update(size_t index, const value<Width> &word, const value<Width> &enabled, int priority) {
        auto place = writes.end();
        while (place != writes.begin() && priority < place[-1].priority)
            place--;
        writes.insert(place, {index, word, enabled, priority});
    }

    template <class Observer>
    bool commit(Observer &) {
        bool changed = false;
        for (const Write &write : writes) {
            value<Width> &word = data[write.index];
            const auto enabled = write.enabled.number();
            const auto now = value<Width>::of((word.number() & ~enabled) | (write.word.number() & enabled));
            changed |= word != now;
            word = now;
        }
        writes.clear();
        return changed;
    }
};

struct performer;
struct observer {};
struct interior {};

struct module {
    module() = default;
    module(const module &) = delete;
    virtual ~module() = default;
    virtual void reset() = 0;
    virtual bool eval(performer *performer = nullptr) = 0;
    virtual bool commit() = 0;
};

}  // namespace cxxrtl

// Yosys' cells. In their names u stands for an operand that is extended by zeros, s for one that is extended by its sign.
namespace cxxrtl_yosys {

using namespace cxxrtl;

// The lowest Bits of an operand.
template <size_t Bits, size_t A>
CXXRTL_ALWAYS_INLINE Unsigned<Bits> u(const value<A> &a) {
    return static_cast<Unsigned<Bits>>(a.number());
}

template <size_t Bits, size_t A>
CXXRTL_ALWAYS_INLINE Unsigned<Bits> s(const value<A> &a) {
    return static_cast<Unsigned<Bits>>(a.signed_number());
}

#define ONE(name, result) \
    template <size_t Y, size_t A> \
    CXXRTL_ALWAYS_INLINE value<Y> name(const value<A> &a) { \
        return value<Y>::of(result); \
    }
#define TWO(name, result) \
    template <size_t Y, size_t A, size_t B> \
    CXXRTL_ALWAYS_INLINE value<Y> name(const value<A> &a, const value<B> &b) { \
        return value<Y>::of(result); \
    }

ONE(logic_not, !a)
ONE(reduce_bool, !!a)
ONE(reduce_or, !!a)
ONE(reduce_and, !value<A>::of(~a.number()))
ONE(not_u, ~u<Y>(a))
ONE(not_s, ~s<Y>(a))
ONE(pos_u, u<Y>(a))
ONE(pos_s, s<Y>(a))
ONE(neg_u, -u<Y>(a))
ONE(neg_s, -s<Y>(a))

template <size_t A>
CXXRTL_ALWAYS_INLINE bool odd(const value<A> &a) {
    uint32_t folded = 0;
    for (size_t n = 0; n < value<A>::chunks; n++)
        folded ^= a.data[n];
    return __builtin_parity(folded);
}
ONE(reduce_xor, odd(a))
ONE(reduce_xnor, !odd(a))

TWO(logic_and, a && b)
TWO(logic_or, a || b)

#define BITWISE(name, operation) \
    TWO(name##_uu, u<Y>(a) operation u<Y>(b)) \
    TWO(name##_ss, s<Y>(a) operation s<Y>(b))
BITWISE(and, &)
BITWISE(or, |)
BITWISE(xor, ^)
BITWISE(add, +)
BITWISE(sub, -)
BITWISE(mul, *)
TWO(xnor_uu, ~(u<Y>(a) ^ u<Y>(b)))
TWO(xnor_ss, ~(s<Y>(a) ^ s<Y>(b)))

#define COMPARED(name, operation) \
    TWO(name##_uu, a.number() operation b.number()) \
    TWO(name##_ss, a.signed_number() operation b.signed_number())
COMPARED(eq, ==)
COMPARED(eqx, ==)
COMPARED(ne, !=)
COMPARED(nex, !=)
COMPARED(lt, <)
COMPARED(le, <=)
COMPARED(gt, >)
COMPARED(ge, >=)

// A machine shifts by less than a number's width.
template <class Number, size_t B>
CXXRTL_ALWAYS_INLINE Number left(Number number, const value<B> &by) {
    return by.number() < 8 * sizeof number ? number << static_cast<unsigned>(by.number()) : 0;
}

template <class Number, size_t B>
CXXRTL_ALWAYS_INLINE Number right(Number number, const value<B> &by) {
    if (by.number() < 8 * sizeof number)
        return number >> static_cast<unsigned>(by.number());
    return number < 0 ? -1 : 0;
}

TWO(shl_uu, left(u<Y>(a), b))
TWO(shl_su, left(s<Y>(a), b))
TWO(sshl_uu, left(u<Y>(a), b))
TWO(sshl_su, left(s<Y>(a), b))
TWO(shr_uu, right(a.number(), b))
TWO(sshr_uu, right(a.number(), b))
TWO(sshr_su, right(a.signed_number(), b))
TWO(shift_uu, right(a.number(), b))
TWO(shiftx_uu, right(a.number(), b))

#undef ONE
#undef TWO
#undef BITWISE
#undef COMPARED

struct memory_index {
    size_t index;
    bool valid;

    template <size_t Bits>
    memory_index(const value<Bits> &address, size_t offset, size_t depth)
        : index(static_cast<size_t>(address.number()) - offset), valid(index < depth) {
        static_assert(Bits <= 32, "address is too wide");
    }
};

}  // namespace cxxrtl_yosys
