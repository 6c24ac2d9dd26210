// The paper's pipeline (PY16 §3.2) natively, the peer of a whole `solve`: jump point search, A* until nothing is left, the seed
// among what A* closed, and wall following. Octile heuristic, eight moves, a diagonal needs both cells beside it; ties in f go to
// the greater cost-to-come. Maps are uint8 [H, W], 1 where free; a cell is (row, col).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <queue>
#include <vector>

namespace {

const double ROOT = std::sqrt(2.0), INF = std::numeric_limits<double>::infinity();

struct Entry {
    double f, g;
    int32_t cell;
    bool operator<(const Entry& other) const { return f != other.f ? f > other.f : g < other.g; }
};

// A map with a blocked cell on every side, and what a search over it needs. Kept between calls, so that memory is not asked for anew.
struct Board {
    int32_t height, width, stride, goal_row, goal_col, goal;
    std::vector<uint8_t> open, closed;
    std::vector<double> cost;
    std::vector<int32_t> parent;
    std::priority_queue<Entry> waiting;

    int32_t at(int32_t row, int32_t col) const { return (row + 1) * stride + col + 1; }

    void read(const uint8_t* free, int32_t h, int32_t w, int32_t row, int32_t col) {
        height = h, width = w, stride = w + 2, goal_row = row + 1, goal_col = col + 1, goal = at(row, col);
        const size_t size = static_cast<size_t>(h + 2) * stride;
        open.assign(size, 0);
        for (int32_t r = 0; r < h; ++r) std::memcpy(&open[at(r, 0)], free + static_cast<size_t>(r) * w, w);
    }

    void begin(int32_t start) {
        closed.assign(open.size(), 0);
        cost.assign(open.size(), INF);
        parent.resize(open.size());
        waiting = {};
        if (!open[start]) return;
        cost[start] = 0;
        parent[start] = start;
        waiting.push({octile(start), 0, start});
    }

    double octile(int32_t cell) const {
        const int32_t rows = std::abs(cell / stride - goal_row), cols = std::abs(cell % stride - goal_col);
        return std::max(rows, cols) + (ROOT - 1) * std::min(rows, cols);
    }

    void reach(int32_t from, int32_t to, double longer) {
        if (longer >= cost[to]) return;
        cost[to] = longer;
        parent[to] = from;
        waiting.push({longer + octile(to), longer, to});
    }

    // The next cell to expand, -1 where none is left.
    int32_t next() {
        while (!waiting.empty()) {
            const int32_t cell = waiting.top().cell;
            waiting.pop();
            if (closed[cell]) continue;
            closed[cell] = 1;
            return cell;
        }
        return -1;
    }

    // Where a straight run has to stop: at the goal, or where a wall beside it has just ended; 0 where a wall ends the run.
    int32_t run(int32_t cell, int32_t step, int32_t side) const {
        for (cell += step; open[cell]; cell += step)
            if (cell == goal || (open[cell + side] && !open[cell + side - step]) || (open[cell - side] && !open[cell - side - step]))
                return cell;
        return 0;
    }

    int32_t jump(int32_t cell, int32_t vertical, int32_t horizontal) const {
        if (!vertical) return run(cell, horizontal, stride);
        if (!horizontal) return run(cell, vertical, 1);
        while (open[cell + vertical] && open[cell + horizontal] && open[cell + vertical + horizontal]) {
            cell += vertical + horizontal;
            if (cell == goal || run(cell, vertical, 1) || run(cell, horizontal, stride)) return cell;
        }
        return 0;
    }

    void try_jump(int32_t cell, int32_t vertical, int32_t horizontal) {
        const int32_t point = jump(cell, vertical, horizontal);
        if (!point) return;
        const int32_t rows = std::abs(point / stride - cell / stride), cols = std::abs(point % stride - cell % stride);
        reach(cell, point, cost[cell] + std::max(rows, cols) * (rows && cols ? ROOT : 1.0));
    }

    void jump_from(int32_t cell) {
        const int32_t from = parent[cell];
        const int32_t down = cell / stride - from / stride, right = cell % stride - from % stride;
        const int32_t vertical = stride * ((down > 0) - (down < 0)), horizontal = (right > 0) - (right < 0);
        if (cell == from) {
            for (const int32_t v : {-stride, 0, stride})
                for (const int32_t h : {-1, 0, 1})
                    if (v || h) try_jump(cell, v, h);
        } else if (vertical && horizontal) {
            try_jump(cell, vertical, 0);
            try_jump(cell, 0, horizontal);
            try_jump(cell, vertical, horizontal);
        } else {
            try_jump(cell, vertical, horizontal);
            const int32_t side = vertical ? 1 : stride;
            for (const int32_t turn : {-side, side}) {
                if (!open[cell + turn] || open[cell + turn - vertical - horizontal]) continue;
                try_jump(cell, vertical ? 0 : turn, vertical ? turn : 0);
                try_jump(cell, vertical ? vertical : turn, vertical ? turn : horizontal);
            }
        }
    }

    void step_from(int32_t cell) {
        const double straight = cost[cell] + 1, diagonal = cost[cell] + ROOT;
        const int32_t up = cell - stride, down = cell + stride;
        const bool north = open[up], south = open[down], west = open[cell - 1], east = open[cell + 1];
        if (north) reach(cell, up, straight);
        if (south) reach(cell, down, straight);
        if (west) reach(cell, cell - 1, straight);
        if (east) reach(cell, cell + 1, straight);
        if (north && west && open[up - 1]) reach(cell, up - 1, diagonal);
        if (north && east && open[up + 1]) reach(cell, up + 1, diagonal);
        if (south && west && open[down - 1]) reach(cell, down - 1, diagonal);
        if (south && east && open[down + 1]) reach(cell, down + 1, diagonal);
    }
};

thread_local Board board;

}  // namespace

extern "C" {

// The cells expanded; *cost is the length of a shortest path, infinite where there is none.
int32_t paper_jps(const uint8_t* free, int32_t h, int32_t w, int32_t row, int32_t col, int32_t goal_row, int32_t goal_col, double* cost) {
    board.read(free, h, w, goal_row, goal_col);
    board.begin(board.at(row, col));
    int32_t expanded = 0;
    for (int32_t cell; (cell = board.next()) >= 0;) {
        ++expanded;
        if (cell == board.goal) break;
        board.jump_from(cell);
    }
    *cost = board.cost[board.goal];
    return expanded;
}

// The same by A*; `closed` (uint8 [H, W]) tells which cells it expanded.
int32_t paper_astar(const uint8_t* free, int32_t h, int32_t w, int32_t row, int32_t col, int32_t goal_row, int32_t goal_col, double* cost,
                    uint8_t* closed) {
    board.read(free, h, w, goal_row, goal_col);
    board.begin(board.at(row, col));
    int32_t expanded = 0;
    for (int32_t cell; (cell = board.next()) >= 0;) {
        ++expanded;
        if (cell == board.goal) break;
        board.step_from(cell);
    }
    *cost = board.cost[board.goal];
    for (int32_t r = 0; r < h; ++r) std::memcpy(closed + static_cast<size_t>(r) * w, &board.closed[board.at(r, 0)], w);
    return expanded;
}

// The closed cell nearest the goal, the first in row order among equals; (-1, -1) where none is closed.
void paper_seed(const uint8_t* closed, int32_t h, int32_t w, int32_t goal_row, int32_t goal_col, int32_t* seed) {
    double least = INF;
    seed[0] = seed[1] = -1;
    for (int32_t r = 0; r < h; ++r)
        for (int32_t c = 0; c < w; ++c)
            if (closed[static_cast<size_t>(r) * w + c]) {
                const int32_t rows = std::abs(r - goal_row), cols = std::abs(c - goal_col);
                const double far = std::max(rows, cols) + (ROOT - 1) * std::min(rows, cols);
                if (far < least) least = far, seed[0] = r, seed[1] = c;
            }
}

// Marks in `contour` (uint8 [H, W], zero before) the cells passed with a hand on the wall ahead of the seed; how many they are.
int32_t paper_contour(const uint8_t* free, int32_t h, int32_t w, const int32_t* seed, int32_t goal_row, int32_t goal_col,
                      uint8_t* contour) {
    if (seed[0] < 0) return 0;
    const auto is_on = [&](int32_t r, int32_t c) { return 0 <= r && r < h && 0 <= c && c < w; };
    const auto is_free = [&](int32_t r, int32_t c) { return is_on(r, c) && free[static_cast<size_t>(r) * w + c]; };
    const int32_t rows = goal_row - seed[0], cols = goal_col - seed[1];
    const bool is_along = std::abs(rows) >= std::abs(cols);
    const int32_t down = is_along ? (rows > 0) - (rows < 0) : 0, right = is_along ? 0 : (cols > 0) - (cols < 0);
    if (!is_on(seed[0] + down, seed[1] + right) || is_free(seed[0] + down, seed[1] + right)) return 0;
    int32_t marked = 0;
    const auto mark = [&](int32_t r, int32_t c) {
        uint8_t& cell = contour[static_cast<size_t>(r) * w + c];
        marked += !cell;
        cell = 1;
    };
    // With the wall on the left, and, where the edge of the map ended that walk, with the wall on the right.
    for (const int32_t hand : {1, -1}) {
        int32_t r = seed[0], c = seed[1], dr = hand * right, dc = -hand * down;
        const int32_t first_dr = dr, first_dc = dc;
        mark(r, c);
        while (true) {
            const int32_t side_r = -hand * dc, side_c = hand * dr;
            const bool is_side_on = is_on(r + side_r, c + side_c), is_front_on = is_on(r + dr, c + dc);
            const bool is_side_free = is_free(r + side_r, c + side_c);
            if (!is_side_on || (!is_front_on && !is_side_free)) break;
            if (is_side_free) {
                dr = side_r, dc = side_c, r += dr, c += dc;
            } else if (is_free(r + dr, c + dc)) {
                r += dr, c += dc;
            } else {
                const int32_t turned = hand * dc;
                dc = -hand * dr, dr = turned;
            }
            mark(r, c);
            if (r == seed[0] && c == seed[1] && dr == first_dr && dc == first_dc) return marked;
        }
    }
    return marked;
}
}
