// Cut vertices between two cells by one depth-first search with low points (Hopcroft and Tarjan), the native peer of critical_cells:
// straight moves only, which reach what all eight reach.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

// free: uint8 [H, W]; critical: uint8 [H, W], 1 where blocking the cell cuts the way.
extern "C" void critical_cells(const uint8_t* free, int32_t height, int32_t width, int32_t row, int32_t col, int32_t goal_row,
                               int32_t goal_col, uint8_t* critical) {
    std::memset(critical, 0, static_cast<size_t>(height) * width);
    const int32_t stride = width + 2, start = (row + 1) * stride + col + 1, goal = (goal_row + 1) * stride + goal_col + 1;
    static thread_local std::vector<int32_t> order, low, parent, path;
    static thread_local std::vector<uint8_t> open, next;
    const size_t count = static_cast<size_t>(height + 2) * stride;
    order.assign(count, 0), low.assign(count, 0), parent.assign(count, 0), open.assign(count, 0), next.assign(count, 0);
    for (int32_t r = 0; r < height; ++r) std::memcpy(&open[(r + 1) * stride + 1], free + static_cast<size_t>(r) * width, width);
    if (!open[start] || !open[goal]) return;
    const int32_t moves[4] = {-stride, -1, 1, stride};
    path.assign(1, start);
    int32_t num = 1;
    order[start] = low[start] = num;
    while (!path.empty()) {
        const int32_t cell = path.back();
        if (next[cell] == 4) {
            path.pop_back();
            if (!path.empty()) low[path.back()] = std::min(low[path.back()], low[cell]);
            continue;
        }
        const int32_t to = cell + moves[next[cell]++];
        if (!open[to] || to == parent[cell]) continue;
        if (order[to]) {
            low[cell] = std::min(low[cell], order[to]);
        } else {
            parent[to] = cell, order[to] = low[to] = ++num;
            path.push_back(to);
        }
    }
    if (!order[goal]) return;
    auto mark = [&](int32_t cell) { critical[(cell / stride - 1) * width + cell % stride - 1] = 1; };
    mark(start), mark(goal);
    for (int32_t child = goal, cell = parent[goal]; child != start && cell != start; child = cell, cell = parent[cell])
        if (low[child] >= order[cell]) mark(cell);
}
