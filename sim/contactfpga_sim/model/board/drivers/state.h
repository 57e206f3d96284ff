// The flip-flops and memories of the generated model, by name: places.inc, made of it, lists them all.
#pragma once

#include "clocked.h"

struct Place {
    const char *name;
    uint32_t width, depth, chunks;  // bits of a word, words, and numbers of 32 bits that hold one
    uint32_t *now, *next;           // the same where there is no next
};

// Between two clocks only: nothing is under way then.
class State {
public:
    std::vector<Place> places;

    explicit State(cxxrtl_design::i_design &top) {
#define PLACE(name, member) add(name, top.member);
#define MEMORY(name, member, depth) add(name, top.member, depth);
#include "places.inc"
#undef PLACE
#undef MEMORY
    }

    void flip(uint32_t place, uint32_t word, uint32_t bit) {
        Place &at = places[place];
        const uint32_t chunk = word * at.chunks + bit / 32, mask = 1u << bit % 32;
        at.now[chunk] ^= mask;
        at.next[chunk] = at.now[chunk];
    }

    std::vector<uint32_t> words() const {
        std::vector<uint32_t> words;
        for (const Place &place : places)
            words.insert(words.end(), place.now, place.now + place.depth * place.chunks);
        return words;
    }

    void put(const std::vector<uint32_t> &words) {
        auto from = words.begin();
        for (Place &place : places)
            for (uint32_t i = 0; i < place.depth * place.chunks; i++)
                place.next[i] = place.now[i] = *from++;
    }

private:
    template <size_t Bits>
    void add(const char *name, cxxrtl::wire<Bits> &wire) {
        places.push_back({name, Bits, 1, wire.curr.chunks, wire.curr.data, wire.next.data});
    }

    template <size_t Width>
    void add(const char *name, cxxrtl::memory<Width> &memory, uint32_t depth) {
        uint32_t *data = memory.data[0].data;
        places.push_back({name, Width, depth, memory.data[0].chunks, data, data});
    }
};
