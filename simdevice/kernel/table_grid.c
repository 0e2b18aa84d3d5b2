/* Who may be near whom: a grid of the robots, made anew only when one of them has moved by half a skin since. */
#include <math.h>
#include <string.h>

#include "order.h"
#include "table.h"

static uint32_t column_of(const kernel_table *table, double x)
{
    double column = (x - table->grid_x) / table->cell;

    return column > 0.0 ? (column < table->columns ? (uint32_t)column : table->columns - 1) : 0;
}

static uint32_t row_of(const kernel_table *table, double y)
{
    double row = (y - table->grid_y) / table->cell;

    return row > 0.0 ? (row < table->rows ? (uint32_t)row : table->rows - 1) : 0;
}

/* Lays cells over all robots: small ones, but no more of them than there is room for. */
static void lay(kernel_table *table)
{
    double low_x = table->x[0], low_y = table->y[0], high_x = low_x, high_y = low_y, columns, rows;
    uint32_t row;

    for (row = 1; row < table->count; row++) {
        low_x = least(low_x, table->x[row]);
        low_y = least(low_y, table->y[row]);
        high_x = most(high_x, table->x[row]);
        high_y = most(high_y, table->y[row]);
    }
    table->grid_x = low_x;
    table->grid_y = low_y;
    table->cell = table->least_cell;
    for (;;) {
        columns = floor((high_x - low_x) / table->cell) + 1.0;
        rows = floor((high_y - low_y) / table->cell) + 1.0;
        if (columns * rows <= table->most_cells) {
            break;
        }
        table->cell *= most(1.1, sqrt(columns * rows / table->most_cells));
    }
    table->columns = (uint32_t)columns;
    table->rows = (uint32_t)rows;
}

static void fill(kernel_table *table)
{
    uint32_t cells = table->columns * table->rows, row, cell, total = 0;

    memset(table->cell_start, 0, (cells + 1) * sizeof *table->cell_start);
    for (row = 0; row < table->count; row++) {
        cell = row_of(table, table->y[row]) * table->columns + column_of(table, table->x[row]);
        table->cell_of[row] = cell;
        table->cell_start[cell]++;
        table->seen_x[row] = table->x[row];
        table->seen_y[row] = table->y[row];
    }
    for (cell = 0; cell <= cells; cell++) {
        total += table->cell_start[cell];
        table->cell_start[cell] = total;
    }
    for (row = table->count; row-- > 0;) {
        table->cell_item[--table->cell_start[table->cell_of[row]]] = row;
    }
}

static void pair_up(kernel_table *table, uint32_t row, uint32_t from, uint32_t to, double square)
{
    for (; from < to; from++) {
        uint32_t other = table->cell_item[from];
        double dx = table->x[other] - table->x[row], dy = table->y[other] - table->y[row];

        if (dx * dx + dy * dy < square) {
            table->pair[2 * table->pairs] = row;
            table->pair[2 * table->pairs + 1] = other;
            table->pairs++;
        }
    }
}

void table_refresh_grid(kernel_table *table)
{
    uint32_t columns, cell, cells, item;
    double reach = 2.0 * table->profile.radius + table->most_gap + table->skin;

    if (!table->stale || table->count == 0) {
        return;
    }
    table->stale = 0;
    lay(table);
    fill(table);
    table->pairs = 0;
    columns = table->columns;
    cells = columns * table->rows;
    for (cell = 0; cell < cells; cell++) {
        uint32_t end = table->cell_start[cell + 1], column = cell % columns, below = cell + columns;

        for (item = table->cell_start[cell]; item < end; item++) {
            uint32_t row = table->cell_item[item];

            pair_up(table, row, item + 1, end, reach * reach);
            if (column + 1 < columns) {
                pair_up(table, row, end, table->cell_start[cell + 2], reach * reach);
            }
            if (below < cells) { /* three cells beside each other lie in one stretch of the list */
                uint32_t first = column > 0 ? below - 1 : below, last = column + 1 < columns ? below + 1 : below;

                pair_up(table, row, table->cell_start[first], table->cell_start[last + 1], reach * reach);
            }
        }
    }
}

static void sort(uint32_t *rows, uint32_t count)
{
    uint32_t gap, i, j;

    for (gap = count / 2; gap > 0; gap = gap == 2 ? 1 : gap * 5 / 11) {
        for (i = gap; i < count; i++) {
            uint32_t row = rows[i];

            for (j = i; j >= gap && rows[j - gap] > row; j -= gap) {
                rows[j] = rows[j - gap];
            }
            rows[j] = row;
        }
    }
}

void table_collect(kernel_table *table, uint32_t row, double radius)
{
    double x = table->x[row], y = table->y[row], reach = radius + 0.5 * table->skin;
    uint32_t left, right, low, high, cell_row, other;

    table->near = 0;
    table_refresh_grid(table);
    left = column_of(table, x - reach);
    right = column_of(table, x + reach);
    low = row_of(table, y - reach);
    high = row_of(table, y + reach);
    if ((right - left + 1) * (high - low + 1) >= table->count) {
        for (other = 0; other < table->count; other++) {
            if (other != row) {
                table->near_row[table->near++] = other;
            }
        }
        return;
    }
    for (cell_row = low; cell_row <= high; cell_row++) {
        uint32_t first = cell_row * table->columns;
        uint32_t item = table->cell_start[first + left], end = table->cell_start[first + right + 1];

        for (; item < end; item++) {
            other = table->cell_item[item];
            if (other != row) {
                table->near_row[table->near++] = other;
            }
        }
    }
    sort(table->near_row, table->near);
}

/* The nearest one of another class in a stretch of cells, or what was found before. */
static double nearest_in(const kernel_table *table, uint32_t row, uint32_t first, uint32_t last, double square)
{
    uint32_t item, end = table->cell_start[last + 1];

    for (item = table->cell_start[first]; item < end; item++) {
        uint32_t other = table->cell_item[item];

        if (table->group[other] != table->group[row]) {
            double dx = table->x[other] - table->x[row], dy = table->y[other] - table->y[row];

            square = least(square, dx * dx + dy * dy);
        }
    }
    return square;
}

double table_nearest_other(const kernel_table *table, uint32_t row, double limit)
{
    double square = INFINITY;
    int32_t columns = (int32_t)table->columns, rows = (int32_t)table->rows, ring, most_rings = columns > rows ? columns : rows;
    int32_t column = (int32_t)(table->cell_of[row] % table->columns), line = (int32_t)(table->cell_of[row] / table->columns);

    for (ring = 0; ring < most_rings; ring++) { /* squares of cells, the one around the other */
        double beyond = (ring - 1) * table->cell - table->skin;
        int32_t at, left = column - ring, right = column + ring;

        if (beyond > limit || (beyond > 0.0 && square <= beyond * beyond)) {
            break;
        }
        for (at = line - ring; at <= line + ring; at++) {
            uint32_t first = (uint32_t)at * table->columns;

            if (at < 0 || at >= rows) {
                continue;
            }
            if (at == line - ring || at == line + ring) {
                square = nearest_in(
                    table, row, first + (uint32_t)(left > 0 ? left : 0),
                    first + (uint32_t)(right < columns ? right : columns - 1), square);
                continue;
            }
            if (left >= 0) {
                square = nearest_in(table, row, first + (uint32_t)left, first + (uint32_t)left, square);
            }
            if (right < columns) {
                square = nearest_in(table, row, first + (uint32_t)right, first + (uint32_t)right, square);
            }
        }
    }
    return square;
}
