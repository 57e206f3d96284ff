/* clockfit.h: the fit of a board's clock to the host's, for reader.c. It computes what contactfpga.driver.clock.ClockFit
 * computes in Python, which explains the names. Both round alike, as operations have the same order and no product is
 * contracted (-ffp-contract=off).
 */
#ifndef CONTACTFPGA_CLOCKFIT_H
#define CONTACTFPGA_CLOCKFIT_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* The same as in contactfpga.driver.clock. */
enum { MOST_POINTS = 512, MOST_ASKED = 64, SLOPES = 101 };
static const double MOST_PPM = 200.0, USUAL_PPM = 50.0, WINDOW_S = 60.0, PIECE_S = 0.25, UNKNOWN_S = 0.02, STEP_S = 0.005,
                    QUIET_S = 5.0, CAUTION = 1.25;

typedef struct {
    double device_s, excess_s;
} point;

/* In order of time. */
typedef struct {
    int64_t count;
    point at[MOST_POINTS];
} points;

typedef struct {
    double least_s, way_s, piece, base_s, fitted_s, height_s, slope, variance;
    int64_t base_us;
    point newest;
    points pieces, asked;
} fit;

/* contactfpga.zones.zone.HostLine without its first field. */
typedef struct {
    int64_t base_us;
    double base_s, rate, sigma_s;
} host_line;

static void drop_first(points *from, int64_t count) {
    from->count -= count;
    memmove(from->at, from->at + count, (size_t)from->count * sizeof(point));
}

static void append(points *to, point last, int64_t most) {
    if (to->count == most) drop_first(to, 1);
    to->at[to->count++] = last;
}

static void fit_forget(fit *f) {
    f->pieces.count = f->asked.count = 0;
    f->piece = -INFINITY;
    f->newest = (point){0.0, 0.0};
    f->base_us = 0;
    f->base_s = f->fitted_s = f->height_s = f->slope = f->variance = 0.0;
}

static void fit_begin(fit *f) {
    f->least_s = f->way_s = UNKNOWN_S;
    fit_forget(f);
}

static point fit_point(const fit *f, int64_t time_us, double host_s) {
    double device_s = (double)(time_us - f->base_us) / 1e6;
    return (point){device_s, host_s - f->base_s - device_s};
}

static double fit_bound(const fit *f, double device_s) {
    return f->height_s + f->slope * (device_s - f->fitted_s);
}

static double slope_of(int index) {
    return (-MOST_PPM + 4.0 * index) * 1e-6;
}

/* Adds to each slope's sum the height now of the highest line of it below the points; sign -1: of the lowest one above,
 * upside down. */
static void add_least(const points *from, double now_s, double sign, double *sums) {
    double slopes[SLOPES], least[SLOPES];
    for (int i = 0; i < SLOPES; i++) slopes[i] = sign * slope_of(i), least[i] = INFINITY;
    for (int64_t j = 0; j < from->count; j++) {
        double excess_s = sign * from->at[j].excess_s, run_s = from->at[j].device_s - now_s;
        for (int i = 0; i < SLOPES; i++) {
            double height = excess_s - slopes[i] * run_s;
            least[i] = height < least[i] ? height : least[i];
        }
    }
    for (int i = 0; i < SLOPES; i++) sums[i] += least[i];
}

static double median_of(double *values, int64_t count) {
    for (int64_t gap = count / 2; gap > 0; gap = gap == 2 ? 1 : gap * 5 / 11)
        for (int64_t i = gap; i < count; i++) {
            double value = values[i];
            int64_t j = i;
            for (; j >= gap && values[j - gap] > value; j -= gap) values[j] = values[j - gap];
            values[j] = value;
        }
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

static bool turns_down(point first, point second, point third) {
    double run = second.device_s - first.device_s, rise = second.excess_s - first.excess_s;
    return rise * (third.device_s - first.device_s) >= run * (third.excess_s - first.excess_s);
}

static double middle_slope(const points *from) {
    points hull;
    hull.count = 0;
    for (int64_t i = 0; i < from->count; i++) {
        while (hull.count > 1 && turns_down(hull.at[hull.count - 2], hull.at[hull.count - 1], from->at[i])) hull.count--;
        hull.at[hull.count++] = from->at[i];
    }
    double middle_s = (from->at[0].device_s + from->at[from->count - 1].device_s) / 2;
    for (int64_t i = 1; i < hull.count; i++) {
        point before = hull.at[i - 1], after = hull.at[i];
        if (after.device_s >= middle_s && after.device_s > before.device_s)
            return (after.excess_s - before.excess_s) / (after.device_s - before.device_s);
    }
    return 0.0;
}

static void likely(const points *from, int widest, double gap_s, double *found) {
    double heights[MOST_POINTS], least = INFINITY, middle = middle_slope(from);
    for (int64_t i = 0; i < from->count; i++) {
        heights[i] = from->at[i].excess_s - slope_of(widest) * from->at[i].device_s;
        least = heights[i] < least ? heights[i] : least;
    }
    double hidden_s = (gap_s > 0.0 ? gap_s : 0.0) / 4 + (median_of(heights, from->count) - least) + 1e-6;
    double span_s = from->at[from->count - 1].device_s - from->at[0].device_s;
    double usual = USUAL_PPM * 1e-6, sharp = hidden_s / (span_s > PIECE_S ? span_s : PIECE_S);
    least = INFINITY;
    for (int i = 0; i < SLOPES; i++) {
        double first = slope_of(i) / usual, second = (slope_of(i) - middle) / sharp;
        found[i] = first * first + second * second;
        least = found[i] < least ? found[i] : least;
    }
    for (int i = 0; i < SLOPES; i++) found[i] = exp((least - found[i]) / 2);
}

static void drop_old(points *from, double newest_s) {
    int64_t old = 0;
    while (old < from->count && from->at[old].device_s < newest_s - WINDOW_S) old++;
    drop_first(from, old);
}

static void fit_fit(fit *f) {
    double above[SLOPES] = {0.0}, gaps[SLOPES], weights[SLOPES], middles[SLOPES], now_s = f->newest.device_s;
    drop_old(&f->pieces, now_s);
    drop_old(&f->asked, now_s);
    f->fitted_s = now_s;
    add_least(&f->pieces, now_s, 1, above);
    for (int i = 0; i < SLOPES; i++) gaps[i] = f->asked.count ? above[i] : f->least_s;
    if (f->asked.count) add_least(&f->asked, now_s, -1, gaps);
    int widest = 0;
    for (int i = 1; i < SLOPES; i++) widest = gaps[i] > gaps[widest] ? i : widest;
    double most = gaps[widest], total = 0.0, middle = 0.0, slope = 0.0, least_s = 0.0, variance = 0.0;
    likely(&f->pieces, widest, most, weights);
    for (int i = 0; i < SLOPES; i++) {
        weights[i] = most > 0 ? (gaps[i] > 1e-9 ? gaps[i] : 1e-9) * weights[i] : exp(gaps[i] * 1e9 - most * 1e9);
        total += weights[i];
    }
    for (int i = 0; i < SLOPES; i++) {
        weights[i] /= total;
        middles[i] = above[i] - (gaps[i] > 0.0 ? gaps[i] : 0.0) / 2;
        middle += weights[i] * middles[i];
        slope += weights[i] * slope_of(i);
        least_s += weights[i] * gaps[i];
    }
    for (int i = 0; i < SLOPES; i++) {
        double off = middles[i] - middle;
        variance += weights[i] * (off * off + gaps[i] * gaps[i] / 12);
    }
    f->slope = slope;
    f->least_s = least_s > 0.0 ? least_s : 0.0;
    f->height_s = middle + f->least_s / 2;
    f->variance = variance * (CAUTION * CAUTION);
}

static void suppose(fit *f) {
    double now_s = f->newest.device_s;
    if (now_s - (f->asked.count ? f->asked.at[f->asked.count - 1].device_s : 0.0) <= QUIET_S) return;
    double lowest = INFINITY;
    for (int64_t i = 0; i < f->pieces.count; i++) {
        point one = f->pieces.at[i];
        if (one.device_s > now_s - QUIET_S && one.excess_s < lowest) lowest = one.excess_s;
    }
    append(&f->asked, (point){now_s, lowest - 2 * f->way_s}, MOST_ASKED);
}

static bool hides(point later, point earlier) {
    if (floor(earlier.device_s / PIECE_S) < floor(later.device_s / PIECE_S)) return false;
    return earlier.excess_s - later.excess_s > MOST_PPM * 1e-6 * (later.device_s - earlier.device_s);
}

static void fit_arrived(fit *f, int64_t time_us, double arrived_s, double wire_s) {
    if (!f->pieces.count) f->base_us = time_us, f->base_s = arrived_s - wire_s;
    point now = fit_point(f, time_us, arrived_s - wire_s);
    double below_s = fit_bound(f, now.device_s) - now.excess_s;
    if (f->pieces.count && below_s > f->least_s + STEP_S) {
        fit_forget(f);
        fit_arrived(f, time_us, arrived_s, wire_s);
        return;
    }
    f->newest = now;
    double piece = floor(now.device_s / PIECE_S);
    if (piece > f->piece) {
        f->piece = piece;
        append(&f->pieces, now, MOST_POINTS);
        suppose(f);
        fit_fit(f);
    } else if (below_s > 0) {
        while (f->pieces.count && hides(now, f->pieces.at[f->pieces.count - 1])) f->pieces.count--;
        append(&f->pieces, now, MOST_POINTS);
        f->height_s -= below_s;
        f->least_s = f->least_s - below_s > 0.0 ? f->least_s - below_s : 0.0;
    }
}

static void fit_answered(fit *f, int64_t time_us, double asked_s) {
    point asked = fit_point(f, time_us, asked_s);
    if (asked.excess_s > fit_bound(f, asked.device_s) + STEP_S) {
        f->pieces.count = f->asked.count = 0;
        append(&f->pieces, f->newest, MOST_POINTS);
    }
    append(&f->asked, asked, MOST_ASKED);
    fit_fit(f);
    f->way_s = f->least_s;
}

/* Of frames that arrive after the newest one that the fit knows; it knows one. */
static host_line fit_line(const fit *f) {
    double now_s = f->newest.device_s;
    double base_s = f->base_s + now_s + fit_bound(f, now_s) - f->least_s / 2;
    return (host_line){f->base_us + (int64_t)rint(now_s * 1e6), base_s, 1.0 + f->slope, sqrt(f->variance)};
}

#endif
