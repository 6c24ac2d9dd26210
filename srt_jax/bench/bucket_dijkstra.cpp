// A plain bucket Dijkstra in int32, the native peer of cost_to_come: 8 moves, straight 5741, diagonal 8119, a diagonal needs both
// cells beside it. Buckets are as wide as a straight move, so every cell of the lowest bucket is final and three buckets suffice.
#include <algorithm>
#include <cstdint>
#include <vector>

static const int32_t STRAIGHT = 5741, DIAGONAL = 8119, UNREACHED = INT32_MAX, BLOCKED = -1;

// free: uint8 [H, W]; cost: int32 [H, W], UNREACHED where no path leads.
extern "C" void bucket_dijkstra(const uint8_t* free, int32_t height, int32_t width, int32_t row, int32_t col, int32_t* cost) {
    const int32_t stride = width + 2;
    static thread_local std::vector<int32_t> field;
    static thread_local std::vector<int32_t> buckets[3];
    field.assign(static_cast<size_t>(height + 2) * stride, BLOCKED);
    for (auto& bucket : buckets) bucket.clear();
    for (int32_t r = 0; r < height; ++r)
        for (int32_t c = 0; c < width; ++c)
            if (free[r * width + c]) field[(r + 1) * stride + c + 1] = UNREACHED;
    const int32_t start = (row + 1) * stride + col + 1;
    if (field[start] == UNREACHED) {
        field[start] = 0;
        buckets[0].push_back(start);
    }
    for (int32_t level = 0, empty = 0; empty < 3; ++level) {
        auto& bucket = buckets[level % 3];
        empty = bucket.empty() ? empty + 1 : 0;
        const int32_t least = level * STRAIGHT;
        for (const int32_t cell : bucket) {
            const int32_t here = field[cell];
            if (here < least) continue;  // has been expanded from a lower bucket
            auto relax = [&](int32_t to, int32_t total) {
                if (total < field[to]) {
                    field[to] = total;
                    buckets[total / STRAIGHT % 3].push_back(to);
                }
            };
            const bool up = field[cell - stride] >= 0, down = field[cell + stride] >= 0;
            const bool left = field[cell - 1] >= 0, right = field[cell + 1] >= 0;
            relax(cell - stride, here + STRAIGHT);
            relax(cell + stride, here + STRAIGHT);
            relax(cell - 1, here + STRAIGHT);
            relax(cell + 1, here + STRAIGHT);
            if (up && left) relax(cell - stride - 1, here + DIAGONAL);
            if (up && right) relax(cell - stride + 1, here + DIAGONAL);
            if (down && left) relax(cell + stride - 1, here + DIAGONAL);
            if (down && right) relax(cell + stride + 1, here + DIAGONAL);
        }
        bucket.clear();
    }
    for (int32_t r = 0; r < height; ++r)
        for (int32_t c = 0; c < width; ++c) {
            const int32_t value = field[(r + 1) * stride + c + 1];
            cost[r * width + c] = value == BLOCKED ? UNREACHED : value;
        }
}
