// Several sheets at one FPGA: the gateware, a sheet of switches on shift registers at the pins of each, and a UART at the
// other end of its line. Compiled for BIT_CLOCKS and EACH_SHEET, which has an entry SHEET(number, rows, columns, guard lines,
// chains of rows, chains of columns, whether a selected row is low, lines of rows, lines of columns) for each; lists of
// lines are LINES(first, ...). With MUTANTS the gateware has an input that picks a mutant.
#include <algorithm>
#include <vector>

#define ROW_LINES 65
#define COLUMN_LINES 65

#include "clocked.h"
#include "shift.h"
#include "uart.h"

enum Boundary { LINE, CONTACT, RECEIVED, BOUNDARIES };

// A pressed switch passes the selecting level of its row to its column, and nothing else. Guard lines are last. Between the
// FPGA and the registers is a connector; the FPGA pulls the data of an unplugged one to the released level.
template <unsigned ROWS, unsigned COLUMNS, bool GUARD, unsigned ROW_CHAINS, unsigned COLUMN_CHAINS, bool SELECTS_LOW>
class Sheet {
public:
    Sheet(std::vector<uint8_t> line_of_row, std::vector<uint8_t> line_of_column)
        : line_of_row_(line_of_row), line_of_column_(line_of_column) {
        if (GUARD)
            closed_[line_of_row_[ROWS]] = mask(COLUMNS);
    }

    // Registers that are plugged in hold what they hold at power-up.
    void plug(bool plugged) {
        if (plugged && !plugged_)
            rows_ = {}, columns_ = {};
        plugged_ = plugged;
    }

    void press(const uint64_t *cells) {
        for (unsigned row = 0; row < ROWS; row++) {
            Word closed = Word{GUARD} << line_of_column_.back();
            for (uint64_t left = cells[row]; left; left &= left - 1)
                closed |= Word{1} << line_of_column_[lowest(left)];
            closed_[line_of_row_[row]] = closed;
        }
    }

    // Levels of the column registers' outputs, for those of the pins.
    uint64_t step(uint64_t data, bool clock, bool latch, bool enable_n, bool load_n, bool column_clock) {
        if (!plugged_)
            return SELECTS_LOW ? (1u << COLUMN_CHAINS) - 1 : 0;
        const Word levels = rows_.step(data, clock, latch, enable_n, SELECTS_LOW ? mask(LINES) : 0);
        Word reads = 0;
        for (Word left = (SELECTS_LOW ? ~levels : levels) & mask(LINES); left; left &= left - 1)
            reads |= closed_[lowest(left)];
        return columns_.step(load_n, column_clock, (SELECTS_LOW ? ~reads : reads) & mask(COLUMNS + GUARD));
    }

private:
    static constexpr unsigned LINES = ROWS + GUARD;
    std::vector<uint8_t> line_of_row_, line_of_column_;
    Word closed_[LINES] = {};  // by a row's line, the lines of the columns that it reaches
    bool plugged_ = true;
    RowRegisters<LINES, ROW_CHAINS> rows_;
    ColumnRegisters<COLUMNS + GUARD, COLUMN_CHAINS> columns_;
};

#define LINES(...) {__VA_ARGS__}

class Board {
    Clocked model_;

#define SHEET(NUMBER, ROWS, COLUMNS, GUARD, ROW_CHAINS, COLUMN_CHAINS, SELECTS_LOW, ROW_LIST, COLUMN_LIST) \
    Sheet<ROWS, COLUMNS, GUARD, ROW_CHAINS, COLUMN_CHAINS, SELECTS_LOW> sheet_##NUMBER{ROW_LIST, COLUMN_LIST};
    EACH_SHEET
#undef SHEET

    // Whether any sheet's levels have changed.
    bool put_columns() {
        auto &top = model_.top;
        bool changed = false;
#define SHEET(NUMBER, ...)                                                                                            \
    const uint64_t level_##NUMBER =                                                                                   \
        sheet_##NUMBER.step(static_cast<uint64_t>(get(top.p_row__data__##NUMBER)), get(top.p_row__clock__##NUMBER),   \
                            get(top.p_row__latch__##NUMBER), get(top.p_row__enable__n__##NUMBER),                     \
                            get(top.p_column__load__n__##NUMBER), get(top.p_column__clock__##NUMBER));                \
    if (level_##NUMBER != levels_[NUMBER]) {                                                                          \
        put(top.p_column__data__##NUMBER, levels_[NUMBER] = level_##NUMBER);                                          \
        changed = true;                                                                                               \
    }
        EACH_SHEET
#undef SHEET
        return changed;
    }

public:
    Sender sender;
    Reader reader;
    uint64_t cycle = 0;
    unsigned mutant = 0;
    std::vector<Event> events[BOUNDARIES];

    void press(unsigned number, const uint64_t *cells) {
#define SHEET(NUMBER, ...)  \
    if (number == NUMBER) \
        sheet_##NUMBER.press(cells);
        EACH_SHEET
#undef SHEET
    }

    void plug(unsigned number, bool plugged) {
#define SHEET(NUMBER, ...)  \
    if (number == NUMBER) \
        sheet_##NUMBER.plug(plugged);
        EACH_SHEET
#undef SHEET
    }

    void run(uint64_t cycles) {
        for (const uint64_t end = cycle + cycles; cycle < end; cycle++) {
            put(model_.top.p_rx, sender.level());
#ifdef MUTANTS
            put(model_.top.p_mutant, mutant);
#endif
            model_.settle();
            if (put_columns())
                model_.settle();  // lines enter flip-flops only
            watch();
            model_.finish();
        }
    }

private:
    bool line_ = true, contact_ = false;
    uint64_t levels_[16] = {};

    void watch() {
        const bool line = get(model_.top.p_tx), contact = get(model_.top.p_contact);
        uint8_t byte;
        if (reader.take(line, byte))
            events[RECEIVED].push_back({cycle + Reader::rest, byte, 0});
        if (line != line_)
            events[LINE].push_back({cycle, line_ = line, 0});
        if (contact != contact_)
            events[CONTACT].push_back({cycle, contact_ = contact, 0});
    }
};

EXPORT Board *board_new() { return new Board; }
EXPORT void board_free(Board *board) { delete board; }
EXPORT uint64_t board_cycle(Board *board) { return board->cycle; }
EXPORT void board_restart(Board *board, unsigned mutant) {
    board->~Board();
    new (board) Board;
    board->mutant = mutant;
}
EXPORT void board_press(Board *board, unsigned number, const uint64_t *cells) { board->press(number, cells); }
EXPORT void board_plug(Board *board, unsigned number, bool plugged) { board->plug(number, plugged); }
EXPORT void board_run(Board *board, uint64_t cycles) { board->run(cycles); }
EXPORT void board_send(Board *board, const uint8_t *bytes, size_t count) {
    board->sender.bytes.insert(board->sender.bytes.end(), bytes, bytes + count);
}
EXPORT size_t board_count(Board *board, unsigned boundary) { return board->events[boundary].size(); }
EXPORT const Event *board_events(Board *board, unsigned boundary) { return board->events[boundary].data(); }
EXPORT void board_forget(Board *board, unsigned boundary) { board->events[boundary].clear(); }
