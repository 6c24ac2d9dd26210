// Dijkstra's algorithm with a binary heap, the native peer of toll_to_come on maps of one layer: a move pays the toll of every
// obstacle that it needs gone and that the cell left does not belong to.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

static const uint32_t STRAIGHT = 5741, DIAGONAL = 8119, UNREACHED = UINT32_MAX;

// labels: int32 [H, W], -1 free; toll: uint32 of each obstacle; sums: uint32 [H, W], in units of 1 / 5741 cell side.
extern "C" void toll_dijkstra(const int32_t* labels, const uint32_t* toll, int32_t height, int32_t width, int32_t row, int32_t col,
                              uint32_t* sums) {
    static thread_local std::vector<uint8_t> is_final;
    is_final.assign(static_cast<size_t>(height) * width, 0);
    for (int32_t i = 0; i < height * width; ++i) sums[i] = UNREACHED;
    using Entry = std::pair<uint32_t, int32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> heap;
    const int32_t start = row * width + col;
    if (labels[start] >= 0) return;
    sums[start] = 0;
    heap.push({0, start});
    while (!heap.empty()) {
        const auto [here, cell] = heap.top();
        heap.pop();
        if (is_final[cell]) continue;
        is_final[cell] = 1;
        const int32_t r = cell / width, c = cell % width;
        for (int32_t down = -1; down <= 1; ++down)
            for (int32_t right = -1; right <= 1; ++right) {
                if ((!down && !right) || r + down < 0 || r + down >= height || c + right < 0 || c + right >= width) continue;
                const int32_t to = cell + down * width + right;
                if (is_final[to]) continue;
                uint32_t total = here + (down && right ? DIAGONAL : STRAIGHT);
                int32_t paid[3] = {labels[cell], -1, -1};
                auto pay = [&](int32_t owner, int32_t known) {
                    for (int32_t i = 0; i < known; ++i)
                        if (paid[i] == owner) return;
                    if (owner >= 0) total += toll[owner];
                };
                pay(labels[to], 1);
                if (down && right) {
                    paid[1] = labels[to];
                    const int32_t above = labels[cell + down * width], beside = labels[cell + right];
                    pay(above, 2);
                    paid[2] = above;
                    pay(beside, 3);
                }
                if (total < sums[to]) {
                    sums[to] = total;
                    heap.push({total, to});
                }
            }
    }
}
