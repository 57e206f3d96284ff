// A board in its sheet: the gateware, the switch matrix at its pins, and a UART at the other end of its line.
// Compiled for one Skin: ROWS, COLUMNS, GUARD lines, LINE_OF_ROW, LINE_OF_COLUMN, COL2ROW, BIT_CLOCKS; ROW_CHAINS and
// COLUMN_CHAINS, 0 for direct lines; PROBES is 0 for a netlist, which has the pins only; DIVIDED is 1 where items are
// apart from records; ALIVE is 1 where there is that pin; PRECHARGE is 1 where columns can be driven, REVERSAL where
// rows can be let go and are read. UNITS pressure units are read by an MCP3208, or, PACED, by an ADS131M08. KEEPS: clocks for which columns that a
// self-test discharged stay so when they are let go, 0 where there is no self-test. With MUTANTS the gateware has an
// input that picks a mutant. With STATE each of its
// bits can be flipped, and a moment kept and returned to.
#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

#define ROW_LINES (ROWS + GUARD)
#define COLUMN_LINES (COLUMNS + GUARD)

#include "clocked.h"
#include "converter.h"
#include "shift.h"
#include "shorts.h"
#include "uart.h"
#ifdef STATE
#include "state.h"
#endif

enum Boundary { ROW, RECORD, ITEM, BYTE, LINE, CONTACT, ALIVE_PIN, DRIVEN, CHARGED, RECEIVED, BOUNDARIES };

// The line that each row and each column is soldered to, the guard lines last.
constexpr uint8_t line_of_row[] = LINE_OF_ROW, line_of_column[] = LINE_OF_COLUMN;

// A pressed switch passes the selecting level of its row to its column, and nothing else: the diode sees to that. A row
// that is let go has that level, too, unless a driven column lifts it, and its pull is stronger than that of a column
// that nothing drives.
// Switches and faults are told in the sheet's rows and columns, guard lines last; levels are those of lines.
class Matrix {
public:
    Word stuck = 0;
    // A column with capacitance goes a share of its way a clock: to the level that a pressed switch pulls it to, or back
    // to 0. It reads pressed above the threshold. Share and level depend on how many columns are pulled at once.
    // A row, or a column, may be slower than the others by a factor.
    bool slow = false;
    std::vector<double> row_factor, column_factor;
    double press_share[COLUMN_LINES + 1], pulled[COLUMN_LINES + 1], release_share = 1, threshold = 0.5;
    // A row that is let go likewise: to the level that the driven columns lift it to, or back to 0.
    bool slow_rows = false;
    double rise_share[COLUMN_LINES + 1], lifted[COLUMN_LINES + 1], fall_share = 1, row_threshold = 0.5;

    // Columns that fall through resistive cells: by the lines of row and column the share of its way that a column goes in
    // a clock. Added to their levels: noise of this deviation, drawn when a row is selected, and a motor's edges, which
    // come every so many clocks and last for some.
    std::vector<double> cell_share;
    double noise = 0, edge = 0, edge_every = 0, edge_for = 0;

    Matrix() {
        std::fill_n(row_end_, ROW_LINES, COLUMN_LINES);
        std::fill_n(column_end_, COLUMN_LINES, ROW_LINES);
        solder();
    }

    void press(unsigned row, uint64_t cells) {
        pressed_[row] = cells;
        solder(row);
    }

    // From where on the switches of each row, and of each column, no longer reach its pin.
    void cut(const uint8_t *row_ends, const uint8_t *column_ends) {
        std::copy_n(row_ends, ROW_LINES, row_end_);
        std::copy_n(column_ends, COLUMN_LINES, column_end_);
        solder();
    }

    static Word driven(Word row_levels) { return (COL2ROW ? ~row_levels : row_levels) & mask(ROW_LINES); }

    // Of the columns that are driven those to the released level, where `level` is that of all but a guard column, the
    // last one, which is driven to the other one.
    static Word feeding(Word driven, bool level) {
        return driven & (level == COL2ROW ? mask(COLUMNS) : ~mask(COLUMNS));
    }

    Shorts<ROW_LINES, COLUMN_LINES> shorts;

    // Once a clock, with the rows that are driven to the selecting level, those that are driven to the other one, and the
    // columns that are driven to the released level or held at the selecting one; `fights` counts the clocks in which
    // driven lines meet at different levels.
    uint64_t fights = 0;
    Word levels(Word selected, Word rows_released, Word columns_driven, Word columns_held) {
        [[maybe_unused]] const Word selected_rows = selected;
        Word reads = 0, lifted = columns_driven;
        if (!cell_share.empty())
            disturb(selected);
        if (selected)
            selected_ = lowest(selected);
        if (shorts.any) {
            const Lines feeding{rows_released, columns_driven & ~stuck};
            const Lines low = shorts.followers(closed_, {selected, columns_held}, true);
            lifted_ = shorts.followers(closed_, {feeding.rows | shorts.supplied, feeding.columns}, false);
            fights += ((low.rows & feeding.rows) | (low.columns & feeding.columns)) != 0;
            reads = low.columns, lifted = lifted_.columns | shorts.pulled;
        } else {
            for (; selected; selected &= selected - 1)
                reads |= closed_[lowest(selected)];
            fights += (reads & columns_driven) != 0;
        }
        reads |= stuck | columns_held | keep(columns_held, lifted);
#if REVERSAL
        reads |= drained(selected_rows | rows_released, columns_driven, lifted);
#endif
        if (slow)
            reads = settled(reads, columns_driven);
        return (COL2ROW ? ~reads : reads) & mask(COLUMN_LINES);
    }

    // Columns that nothing drives and that a row pulls which is let go, and which nothing lifts.
    Word drained(Word rows_driven, Word columns_driven, Word lifted) const {
        Word reads = 0;
        for (Word let_go = ~rows_driven & mask(ROW_LINES); let_go; let_go &= let_go - 1) {
            const unsigned row = lowest(let_go);
            const bool touched = shorts.any ? lifted_.rows >> row & 1 : (closed_[row] & columns_driven & ~stuck) != 0;
            reads |= touched ? 0 : closed_[row];
        }
        return reads & ~(columns_driven | lifted);
    }

    // Of the row pins: a driven column lifts the rows that are let go to its level, which is that of rows at rest.
    Word row_levels(Word levels, Word rows_driven, Word columns_driven) {
        const Word feeding = columns_driven & ~stuck;
        Word touched = 0;
        if (shorts.any)
            touched = lifted_.rows;
        else for (unsigned line = 0; line < ROW_LINES; line++)
            touched |= Word{(closed_[line] & feeding) != 0} << line;
        if (slow_rows)
            touched = risen(touched, COL2ROW ? levels : ~levels, rows_driven, feeding);
        return (levels & rows_driven) | ((COL2ROW ? touched : ~touched) & ~rows_driven & mask(ROW_LINES));
    }

private:
    uint64_t pressed_[ROWS] = {};
    uint8_t row_end_[ROW_LINES], column_end_[COLUMN_LINES];
    Word closed_[ROW_LINES];  // by a row's line, the lines of the columns that it reaches through closed switches
    double volts_[COLUMN_LINES] = {};
    unsigned selected_ = 0;  // the line that is driven, or was last

    double added_[COLUMN_LINES] = {}, edge_clock_ = 0;
    bool was_selected_ = false;
    uint64_t random_ = 0x9E3779B97F4A7C15ull;

    // By xorshift64* (Vigna 2016), above 0 and at most 1.
    double uniform() {
        random_ ^= random_ >> 12;
        random_ ^= random_ << 25;
        random_ ^= random_ >> 27;
        return ((random_ * 0x2545F4914F6CDD1Dull >> 11) + 1) * 0x1p-53;
    }

    void disturb(Word selected) {
        edge_clock_ += 1;
        if (edge_clock_ >= edge_every)
            edge_clock_ -= edge_every;
        if (selected && !was_selected_ && noise)
            for (double &added : added_)  // Box and Muller's
                added = noise * std::sqrt(-2 * std::log(uniform())) * std::cos(6.283185307179586 * uniform());
        was_selected_ = selected != 0;
    }

    double share(double usual, bool pull, unsigned column) const {
        if (pull && !cell_share.empty())
            return cell_share[selected_ * COLUMN_LINES + column];
        if (row_factor.empty())
            return usual;
        return -std::expm1(std::log1p(-usual) / (column_factor[column] * (pull ? row_factor[selected_] : 1)));
    }

    // `released`: rows whose pin has the released level, which is the touched one, where it is driven.
    Word risen(Word touched, Word released, Word driven, Word feeding) {
        Word reads = 0;
        for (unsigned line = 0; line < ROW_LINES; line++) {
            const unsigned switches = count(closed_[line] & feeding);
            double &volts = row_volts_[line];
            if (driven >> line & 1)
                volts = released >> line & 1;
            else if (touched >> line & 1)
                volts += (lifted[switches] - volts) * rise_share[switches];
            else
                volts -= volts * fall_share;
            reads |= Word{volts > row_threshold} << line;
        }
        return reads;
    }

    double row_volts_[ROW_LINES] = {};
    Lines lifted_ = {};          // with shorts, to the released level
    Word kept_ = 0, kept_for_ = 0;  // columns that were discharged, and clocks for which they stay so

    Word keep(Word held, Word lifted) {
        if (KEEPS && held) {
            kept_ = held, kept_for_ = KEEPS;
            return 0;
        }
        if (!kept_for_)
            return 0;
        kept_for_--;
        return kept_ &= ~lifted;
    }

    void solder() {
        for (unsigned row = 0; row < ROW_LINES; row++)
            solder(row);
    }

    void solder(unsigned row) {
        Word cells = row < ROWS ? pressed_[row] | Word{GUARD} << COLUMNS % (8 * sizeof(Word)) : mask(COLUMNS);
        Word reached = 0;
        for (; cells; cells &= cells - 1) {
            const unsigned column = lowest(cells);
            if (column < row_end_[row] && row < column_end_[column])
                reached |= Word{1} << line_of_column[column];
        }
        closed_[line_of_row[row]] = reached;
    }

    Word settled(Word pulls, Word columns_driven) {
        Word reads = 0;
        const unsigned together = count(pulls);
        const double all = edge_clock_ < edge_for ? edge : 0;
        for (unsigned column = 0; column < COLUMN_LINES; column++) {
            const bool pull = pulls >> column & 1;
            if (columns_driven >> column & 1 && !pull)
                volts_[column] = 0;
            volts_[column] +=
                ((pull ? pulled[together] : 0) - volts_[column]) * share(pull ? press_share[together] : release_share, pull, column);
            reads |= Word{volts_[column] + added_[column] + all > threshold} << column;
        }
        return reads;
    }
};

class Board {
    Clocked model_;

#if UNITS
    bool put_miso() {
        const auto &top = model_.top;
#if PACED
        const bool level = converter.step(get(top.p_spi__clock), get(top.p_spi__select__n), get(top.p_spi__pace));
        const bool changed = level != miso_ || converter.ready_n != ready_n_;
        put(model_.top.p_spi__ready__n, ready_n_ = converter.ready_n);
#else
        const bool level = converter.step(get(top.p_spi__clock), get(top.p_spi__select__n), get(top.p_spi__mosi));
        const bool changed = level != miso_;
#endif
        put(model_.top.p_spi__miso, miso_ = level);
        return changed;
    }
    bool miso_ = false, ready_n_ = false;
#else
    bool put_miso() { return false; }
#endif

#if ROW_CHAINS
    RowRegisters<ROW_LINES, ROW_CHAINS> row_registers_;

    Word rows() {
        const auto &top = model_.top;
        const auto data = static_cast<uint64_t>(get(top.p_row__data));
        const bool clock = get(top.p_row__clock), latch = get(top.p_row__latch), enable_n = get(top.p_row__enable__n);
        return row_registers_.step(data, clock, latch, enable_n, COL2ROW ? mask(ROW_LINES) : 0);
    }
#else
    Word rows() { return static_cast<Word>(get(model_.top.p_rows)); }
#endif

#if COLUMN_CHAINS
    ColumnRegisters<COLUMN_LINES, COLUMN_CHAINS> column_registers_;

    uint64_t read(Word levels) {
        return column_registers_.step(get(model_.top.p_column__load__n), get(model_.top.p_column__clock), levels);
    }
    auto &columns() { return model_.top.p_column__data; }
#else
    Word read(Word levels) { return levels; }
    auto &columns() { return model_.top.p_columns; }
#endif

#if (GUARD || KEEPS) && REVERSAL
    Word columns_driven() {
        const auto &top = model_.top;
        return Matrix::feeding(static_cast<Word>(get(top.p_columns__drive)), get(top.p_columns__level));
    }
#elif PRECHARGE
    Word columns_driven() { return static_cast<Word>(get(model_.top.p_columns__drive)); }
#else
    Word columns_driven() { return 0; }
#endif

#if KEEPS
    Word columns_held() { return static_cast<Word>(get(model_.top.p_columns__drive)) & ~columns_driven(); }
#else
    Word columns_held() { return 0; }
#endif

#if REVERSAL
    Word rows_driven() { return static_cast<Word>(get(model_.top.p_rows__drive)); }
    bool put_rows() {
        const Word levels = matrix.row_levels(rows(), rows_driven(), columns_driven());
        const bool changed = levels != row_levels_;
        put(model_.top.p_rows__read, row_levels_ = levels);
        return changed;
    }
    Word row_levels_ = 0;
#else
    Word rows_driven() { return mask(ROW_LINES); }
    bool put_rows() { return false; }
#endif

public:
#if UNITS
#if PACED
    Ads131m08 converter;
#else
    Mcp3208 converter;
#endif
#endif
    Matrix matrix;
    Sender sender;
    Reader reader;
    uint64_t cycle = 0;
    unsigned captured = 1u << RECEIVED;
    unsigned mutant = 0;
    std::vector<Event> events[BOUNDARIES];

    void run(uint64_t cycles) {
        for (const uint64_t end = cycle + cycles; cycle < end; cycle++) {
            put(model_.top.p_rx, sender.level());
#ifdef MUTANTS
            put(model_.top.p_mutant, mutant);
#endif
            model_.settle();
            const Word driven = Matrix::driven(rows()) & rows_driven();
            const Word levels = read(matrix.levels(driven, rows_driven() & ~driven, columns_driven(), columns_held()));
            const bool rows_change = put_rows(), miso_changes = put_miso();
            if (levels != levels_ || rows_change || miso_changes) {
                // Lines enter flip-flops only, so the second evaluation changes nothing but what those take.
                put(columns(), levels_ = levels);
                model_.settle();
            }
            watch(driven);
            model_.finish();
        }
    }

#ifdef STATE
    State state{model_.top};

    // All that decides what follows, but for what is captured; lines without shift registers only.
    struct Moment {
        std::vector<uint32_t> words;
        Matrix matrix;
        Sender sender;
        Reader reader;
        uint64_t cycle;
        Word levels, row_levels;
        bool line;
    };
    Moment moment() const { return {state.words(), matrix, sender, reader, cycle, levels_, row_levels(), line_}; }
    void go_to(const Moment &moment) {
        state.put(moment.words);
        matrix = moment.matrix, sender = moment.sender, reader = moment.reader;
        cycle = moment.cycle, line_ = moment.line;
        put(columns(), levels_ = moment.levels);
#if REVERSAL
        put(model_.top.p_rows__read, row_levels_ = moment.row_levels);
#endif
    }
    bool same(const Moment &moment) const { return reader.same(moment.reader) && state.words() == moment.words; }
    Word row_levels() const {
#if REVERSAL
        return row_levels_;
#else
        return 0;
#endif
    }
#endif

private:
    Word levels_ = 0, driven_ = 0, charged_ = 0;
    bool line_ = true, contact_ = false, alive_ = false;

    void watch(Word driven) {
        auto &top = model_.top;
        const bool line = get(top.p_tx);
        uint8_t byte;
        if (reader.take(line, byte))
            note(RECEIVED, byte, 0, cycle + Reader::rest);
        if (line != line_)
            note(LINE, line_ = line, 0, cycle);
        const bool contact = get(top.p_contact);
        if (contact != contact_)
            note(CONTACT, contact_ = contact, 0, cycle);
#if ALIVE
        const bool alive = get(top.p_alive);
        if (alive != alive_)
            note(ALIVE_PIN, alive_ = alive, 0, cycle);
#endif
        if (driven != driven_)
            note_lines(DRIVEN, driven_ = driven);
        if (columns_driven() != charged_)
            note_lines(CHARGED, charged_ = columns_driven());
#if PROBES
        if (get(top.p_row__transfer))
            note(ROW, static_cast<uint64_t>(get(top.p_row__cells)), get(top.p_row__last), cycle);
        if (get(top.p_record__transfer))
            note(RECORD, static_cast<uint64_t>(get(top.p_record__data)), get(top.p_record__end), cycle);
#if DIVIDED
        if (get(top.p_item__transfer))
            note(ITEM, static_cast<uint64_t>(get(top.p_item__data)), get(top.p_item__end), cycle);
#endif
        if (get(top.p_byte__transfer))
            note(BYTE, static_cast<uint64_t>(get(top.p_byte__data)), 0, cycle);
#endif
    }

    void note_lines(Boundary boundary, Word lines) {
        note(boundary, static_cast<uint64_t>(lines), high_half(lines), cycle);
    }

    void note(Boundary boundary, uint64_t data, uint64_t mark, uint64_t at) {
        if (captured >> boundary & 1)
            events[boundary].push_back({at, data, mark});
    }
};

EXPORT Board *board_new() { return new Board; }
EXPORT void board_free(Board *board) { delete board; }
EXPORT uint64_t board_cycle(Board *board) { return board->cycle; }
EXPORT uint64_t board_fights(Board *board) { return board->matrix.fights; }
EXPORT uint64_t board_broken(Board *board) { return board->reader.broken; }
EXPORT void board_capture(Board *board, unsigned boundaries) { board->captured = boundaries | 1u << RECEIVED; }
EXPORT void board_restart(Board *board, unsigned mutant) {
    const unsigned captured = board->captured;
    board->~Board();
    new (board) Board;
    board->captured = captured;
    board->mutant = mutant;
}
EXPORT void board_stick(Board *board, const uint8_t *columns) {
    board->matrix.stuck = 0;
    for (unsigned column = 0; column < COLUMN_LINES; column++)
        board->matrix.stuck |= Word{columns[column]} << line_of_column[column];
}
EXPORT void board_cut(Board *board, const uint8_t *row_ends, const uint8_t *column_ends) {
    board->matrix.cut(row_ends, column_ends);
}
EXPORT void board_part(Board *board) { board->matrix.shorts = {}; }
EXPORT void board_join(Board *board, unsigned kind, unsigned one, unsigned other) {
    const uint8_t *lines[] = {line_of_row, line_of_column};
    board->matrix.shorts.join(kind, lines[kind == COLUMN_PAIR][one], lines[kind != ROW_PAIR][other]);
}
EXPORT void board_settle(
    Board *board, const double *press_share, const double *pulled, double release_share, double threshold) {
    Matrix &matrix = board->matrix;
    matrix.slow = true;
    for (unsigned count = 0; count <= COLUMN_LINES; count++) {
        matrix.press_share[count] = press_share[count];
        matrix.pulled[count] = pulled[count];
    }
    matrix.release_share = release_share;
    matrix.threshold = threshold;
}
// By the lines of row and column; `end` is the share of the way to ground at which a column stays.
EXPORT void board_fall(Board *board, const double *share, double end, double threshold) {
    Matrix &matrix = board->matrix;
    matrix.cell_share.assign(share, share + ROW_LINES * COLUMN_LINES);
    matrix.slow = true, matrix.release_share = 0, matrix.threshold = threshold;
    std::fill_n(matrix.pulled, COLUMN_LINES + 1, end);
}
EXPORT void board_disturb(Board *board, double noise, double edge, double edge_every, double edge_for) {
    Matrix &matrix = board->matrix;
    matrix.noise = noise, matrix.edge = edge, matrix.edge_every = edge_every, matrix.edge_for = edge_for;
}
EXPORT void board_settle_rows(
    Board *board, const double *rise_share, const double *lifted, double fall_share, double threshold) {
    Matrix &matrix = board->matrix;
    matrix.slow_rows = true;
    std::copy_n(rise_share, COLUMN_LINES + 1, matrix.rise_share);
    std::copy_n(lifted, COLUMN_LINES + 1, matrix.lifted);
    matrix.fall_share = fall_share;
    matrix.row_threshold = threshold;
}
EXPORT void board_load(Board *board, const uint32_t *codes) {
#if UNITS
    std::copy_n(codes, UNITS, board->converter.codes);
#endif
}
EXPORT void board_slow(Board *board, const double *row_factor, const double *column_factor) {
    Matrix &matrix = board->matrix;
    matrix.row_factor.resize(ROW_LINES);
    matrix.column_factor.resize(COLUMN_LINES);
    for (unsigned row = 0; row < ROW_LINES; row++)
        matrix.row_factor[line_of_row[row]] = row_factor[row];
    for (unsigned column = 0; column < COLUMN_LINES; column++)
        matrix.column_factor[line_of_column[column]] = column_factor[column];
}

// Those that run return the fights so far, so that nobody has to ask for them.
EXPORT uint64_t board_run(Board *board, uint64_t cycles) {
    board->run(cycles);
    return board->matrix.fights;
}

// Each of `frames` sheets is pressed for `cycles`.
EXPORT uint64_t board_hold(Board *board, const uint64_t *cells, size_t frames, uint64_t cycles) {
    for (; frames--; cells += ROWS) {
        for (unsigned row = 0; row < ROWS; row++)
            board->matrix.press(row, cells[row]);
        board->run(cycles);
    }
    return board->matrix.fights;
}

EXPORT void board_send(Board *board, const uint8_t *bytes, size_t count) {
    board->sender.bytes.insert(board->sender.bytes.end(), bytes, bytes + count);
}

EXPORT void board_pull_low(Board *board, uint64_t cycles) { board->sender.low = cycles; }

EXPORT size_t board_count(Board *board, unsigned boundary) { return board->events[boundary].size(); }
EXPORT const Event *board_events(Board *board, unsigned boundary) { return board->events[boundary].data(); }
EXPORT void board_forget(Board *board, unsigned boundary) { board->events[boundary].clear(); }

#ifdef STATE
EXPORT const Place *board_places(Board *board, size_t *count) {
    *count = board->state.places.size();
    return board->state.places.data();
}
EXPORT void board_flip(Board *board, uint32_t place, uint32_t word, uint32_t bit) { board->state.flip(place, word, bit); }
EXPORT Board::Moment *board_moment(Board *board) { return new Board::Moment(board->moment()); }
EXPORT void board_go_to(Board *board, const Board::Moment *moment) { board->go_to(*moment); }
EXPORT bool board_same(Board *board, const Board::Moment *moment) { return board->same(*moment); }
EXPORT void board_drop(Board *, Board::Moment *moment) { delete moment; }
#endif
