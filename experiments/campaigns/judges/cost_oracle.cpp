// The least removal by trying every set of destroyable obstacles, with sums of 320 bits: no rounding. For `cost_campaign`.
// A map has at most 32 columns: a row is one word, and a flood goes along rows and columns until nothing changes.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <vector>

namespace {

using Sum = std::array<uint64_t, 5>;  // in units of 2^-149, the least positive float32; most significant word first

Sum of_float(float value) {
    uint32_t bits;
    std::memcpy(&bits, &value, 4);
    int exponent = bits >> 23 & 255, place = exponent ? exponent - 1 : 0;
    uint64_t digits = (bits & 0x7fffff) | (exponent ? 0x800000 : 0);
    Sum sum{};
    int word = place / 64, shift = place % 64;
    sum[4 - word] |= digits << shift;
    if (shift > 40 && word < 4) sum[3 - word] |= digits >> (64 - shift);
    return sum;
}

Sum added(const Sum& a, const Sum& b) {
    Sum sum{};
    unsigned __int128 carry = 0;
    for (int i = 4; i >= 0; --i) {
        carry += (unsigned __int128)a[i] + b[i];
        sum[i] = (uint64_t)carry;
        carry >>= 64;
    }
    return sum;
}

bool bit(const Sum& sum, int place) { return sum[4 - place / 64] >> place % 64 & 1; }

float rounded_down(const Sum& sum) {
    int top = 319;
    while (top >= 0 && !bit(sum, top)) --top;
    int lowest = std::max(0, top - 23);
    uint32_t digits = 0;
    for (int place = top; place >= lowest; --place) digits = digits << 1 | bit(sum, place);
    if (lowest > 253) return 3.4028234663852886e38f;
    uint32_t bits = ((uint32_t)lowest << 23) + digits;
    float value;
    std::memcpy(&value, &bits, 4);
    return value;
}

struct Map {
    int layers, height, width;
    const int32_t* labels;
    // Whether the goal is reached once the obstacles of `gone` are.
    bool leads(uint64_t gone, const int32_t* start, const int32_t* goal) const {
        uint32_t open[32], reached[32] = {};
        for (int row = 0; row < height; ++row) {
            open[row] = 0;
            for (int col = 0; col < width; ++col) {
                bool is_open = true;
                for (int layer = 0; layer < layers; ++layer) {
                    int32_t label = labels[(layer * height + row) * width + col];
                    is_open &= label == -1 || (label >= 0 && (gone >> label & 1));
                }
                open[row] |= (uint32_t)is_open << col;
            }
        }
        reached[start[0]] = 1u << start[1] & open[start[0]];
        for (bool changed = true; changed;) {
            changed = false;
            auto step = [&](int row) {
                uint32_t near = reached[row];
                if (row) near |= reached[row - 1];
                if (row + 1 < height) near |= reached[row + 1];
                near &= open[row];
                for (uint32_t before = 0; before != near;) before = near, near |= (near << 1 | near >> 1) & open[row];
                changed |= near != reached[row];
                reached[row] = near;
            };
            for (int row = 0; row < height; ++row) step(row);
            for (int row = height; row--;) step(row);
        }
        return reached[goal[0]] >> goal[1] & 1;
    }
};

}  // namespace

// For each task: out_kind 0 a path exists, 2 unsolvable, 3 start blocked, 4 goal blocked, 1 to be opened. Of the last also the
// least cost, rounded down; the numbers of obstacles of the least sets, as bits; and of the set `chosen` whether it opens the way
// (bit 0), costs the least exactly (bit 1), holds nothing needless (bit 2); and its cost, rounded down.
extern "C" void judge(int tasks, int layers, int height, int width, int known, const int32_t* labels, const uint8_t* destroyable,
                      const float* costs, const int32_t* starts, const int32_t* goals, const uint64_t* chosen, int32_t* out_kind,
                      float* out_least, uint32_t* out_sizes, int32_t* out_facts, float* out_cost) {
    for (int task = 0; task < tasks; ++task) {
        Map map{layers, height, width, labels + (int64_t)task * layers * height * width};
        const int32_t *start = starts + 2 * task, *goal = goals + 2 * task;
        std::vector<int> ids;
        uint64_t all = 0;
        for (int i = 0; i < known; ++i)
            if (destroyable[task * known + i]) ids.push_back(i), all |= 1ull << i;
        out_least[task] = out_cost[task] = 0, out_sizes[task] = 0, out_facts[task] = 0;
        if (!map.leads(0, start, start)) { out_kind[task] = 3; continue; }
        if (!map.leads(all, goal, goal)) { out_kind[task] = 4; continue; }
        if (map.leads(0, start, goal)) { out_kind[task] = 0; continue; }
        if (!map.leads(all, start, goal)) { out_kind[task] = 2; continue; }
        out_kind[task] = 1;
        int number = ids.size();
        std::vector<Sum> sums(1 << number, Sum{});
        std::vector<uint64_t> sets(1 << number, 0);
        for (int set = 1; set < 1 << number; ++set) {
            int low = __builtin_ctz(set), rest = set & (set - 1);
            sums[set] = added(sums[rest], of_float(costs[task * known + ids[low]]));
            sets[set] = sets[rest] | 1ull << ids[low];
        }
        std::vector<int> order(1 << number);
        std::iota(order.begin(), order.end(), 0);
        std::sort(order.begin(), order.end(), [&](int a, int b) { return sums[a] < sums[b]; });
        Sum least{}, own{};
        bool is_found = false;
        for (int set : order) {
            if (is_found && sums[set] != least) break;
            if (!map.leads(sets[set], start, goal)) continue;
            is_found = true, least = sums[set], out_sizes[task] |= 1u << __builtin_popcount(set);
        }
        for (int i = 0; i < known; ++i)
            if (chosen[task] >> i & 1) own = added(own, of_float(costs[task * known + i]));
        bool is_open = map.leads(chosen[task], start, goal), is_thin = true;
        for (int i = 0; i < known; ++i)
            if (chosen[task] >> i & 1) is_thin &= !map.leads(chosen[task] & ~(1ull << i), start, goal);
        out_least[task] = rounded_down(least), out_cost[task] = rounded_down(own);
        out_facts[task] = is_open | (own == least) << 1 | is_thin << 2;
    }
}
