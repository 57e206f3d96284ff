// Lines that are joined and diodes that are bridged; see contactfpga_sim/model/sheet/matrix.py.
#pragma once

#include "shift.h"

struct Lines {
    Word rows, columns;
};

enum Joint { ROW_PAIR, COLUMN_PAIR, CROSSED, BRIDGED, SUPPLIED, PULLED };

template <unsigned ROW_COUNT, unsigned COLUMN_COUNT>
class Shorts {
public:
    bool any = false;
    Word supplied = 0, pulled = 0;  // rows at the supply of the released level; columns that are lifted at once

    void join(unsigned kind, unsigned one, unsigned other) {
        any = true;
        if (kind == ROW_PAIR)
            rows_[one] |= Word{1} << other, rows_[other] |= Word{1} << one;
        if (kind == COLUMN_PAIR)
            columns_[one] |= Word{1} << other, columns_[other] |= Word{1} << one;
        if (kind == CROSSED)
            crossed_[one] |= Word{1} << other;
        if (kind == BRIDGED)
            bridged_[one] |= Word{1} << other;
        if (kind == SUPPLIED)
            supplied |= Word{1} << one;
        if (kind == PULLED)
            pulled |= Word{1} << other;
    }

    // Lines that take the level of the sources: the selecting one passes closed switches from row to column, the released
    // one the other way.
    Lines followers(const Word *closed, Lines found, bool selecting) const {
        for (Lines before = {}; before.rows != found.rows || before.columns != found.columns;) {
            before = found;
            for (unsigned row = 0; row < ROW_COUNT; row++) {
                const Word both = crossed_[row] | (bridged_[row] & closed[row]), bit = Word{1} << row;
                const Word up = both | (selecting ? 0 : closed[row]), down = both | (selecting ? closed[row] : 0);
                if (found.columns & up || found.rows & rows_[row])
                    found.rows |= bit;
                if (found.rows & bit)
                    found.columns |= down;
            }
            for (unsigned column = 0; column < COLUMN_COUNT; column++)
                found.columns |= Word{(found.columns & columns_[column]) != 0} << column;
        }
        return found;
    }

private:
    Word rows_[ROW_COUNT] = {}, columns_[COLUMN_COUNT] = {}, crossed_[ROW_COUNT] = {}, bridged_[ROW_COUNT] = {};
};
