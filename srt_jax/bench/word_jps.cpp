// Jump point search on machine words, the native peer of shortest_path: 8 moves, straight 5741, diagonal 8119, a diagonal needs
// both cells beside it. Scans along rows and columns look at 64 cells at once. (D. Harabor, A. Grastien: Improving jump point
// search, ICAPS 2014, for the scans; the rule for corners as in their work on JPS without cutting them.)
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <queue>
#include <vector>

namespace {

const int32_t STRAIGHT = 5741, DIAGONAL = 8119, FAR = INT32_MAX;
using Word = uint64_t;

// Rows or columns of a map, a bit a cell, with a guard word on either side and a blocked line before and after.
struct Lines {
    int words = 0;
    std::vector<Word> free, ahead, back;  // ahead, back: where a scan to higher or lower numbers stops

    void shape(int count, int length) {
        words = (length + 63) / 64 + 2;
        for (auto* bits : {&free, &ahead, &back}) bits->assign(static_cast<size_t>(count + 2) * words, 0);
    }
    Word* at(std::vector<Word>& bits, int line) { return &bits[static_cast<size_t>(line + 1) * words + 1]; }
    const Word* at(const std::vector<Word>& bits, int line) const { return &bits[static_cast<size_t>(line + 1) * words + 1]; }
    bool has(int line, int cell) const { return cell >= -1 && (at(free, line)[cell >> 6] >> (cell & 63)) & 1; }

    // A scan stops before a blocked cell, and where a cell of the line beside it is free whose predecessor is blocked.
    void find_stops(int count) {
        for (int line = 0; line < count; ++line) {
            const Word *own = at(free, line), *up = at(free, line - 1), *down = at(free, line + 1);
            Word *to = at(ahead, line), *fro = at(back, line);
            for (int k = -1; k < words - 1; ++k) {
                const Word before = k > -1, after = k < words - 2;
                auto later = [&](const Word* bits) { return bits[k] << 1 | (before ? bits[k - 1] >> 63 : 0); };
                auto sooner = [&](const Word* bits) { return bits[k] >> 1 | (after ? bits[k + 1] << 63 : 0); };
                to[k] = (up[k] & ~later(up)) | (down[k] & ~later(down)) | ~own[k];
                fro[k] = (up[k] & ~sooner(up)) | (down[k] & ~sooner(down)) | ~own[k];
            }
        }
    }
    void stop_at(int line, int cell) {
        at(ahead, line)[cell >> 6] |= Word(1) << (cell & 63);
        at(back, line)[cell >> 6] |= Word(1) << (cell & 63);
    }
    int next(int line, int cell, int way) const {
        if (way > 0) {
            const Word* bits = at(ahead, line);
            int x = cell + 1, k = x >> 6;
            Word word = bits[k] & (~Word(0) << (x & 63));
            while (!word) word = bits[++k];
            return k * 64 + __builtin_ctzll(word);
        }
        const Word* bits = at(back, line);
        int x = cell - 1, k = x >> 6;
        Word word = bits[k] & (~Word(0) >> (63 - (x & 63)));
        while (!word) word = bits[--k];
        return k * 64 + 63 - __builtin_clzll(word);
    }
};

void transpose(Word block[64]) {
    Word mask = 0x00000000FFFFFFFFull;
    for (int width = 32; width; width >>= 1, mask ^= mask << width)
        for (int i = 0; i < 64; i = (i + width + 1) & ~width) {
            const Word swapped = ((block[i] >> width) ^ block[i + width]) & mask;
            block[i] ^= swapped << width;
            block[i + width] ^= swapped;
        }
}

struct Search {
    int height, width;
    Lines rows, columns;
    std::vector<int32_t> best;
    std::vector<int> touched;

    void read(const uint8_t* free, int h, int w) {
        height = h, width = w;
        rows.shape(h, w);
        columns.shape(w, h);
        for (int r = 0; r < h; ++r) {
            Word* bits = rows.at(rows.free, r);
            const uint8_t* cells = free + static_cast<size_t>(r) * w;
            int c = 0;
            for (; c + 8 <= w; c += 8) {  // eight bytes of 0 and 1 to eight bits
                uint64_t eight;
                std::memcpy(&eight, cells + c, 8);
                bits[c >> 6] |= ((eight * 0x0102040810204080ull) >> 56) << (c & 63);
            }
            for (; c < w; ++c) bits[c >> 6] |= Word(cells[c]) << (c & 63);
        }
        for (int r = 0; r < h; r += 64)
            for (int c = 0; c < w; c += 64) {
                Word block[64] = {};
                for (int i = 0; i < 64 && r + i < h; ++i) block[i] = rows.at(rows.free, r + i)[c >> 6];
                transpose(block);
                for (int i = 0; i < 64 && c + i < w; ++i) columns.at(columns.free, c + i)[r >> 6] = block[i];
            }
        rows.find_stops(h);
        columns.find_stops(w);
        if (best.size() != static_cast<size_t>(h) * w) best.assign(static_cast<size_t>(h) * w, FAR), touched.clear();
        for (int cell : touched) best[cell] = FAR;
        touched.clear();
    }

    bool is_free(int r, int c) const { return r >= 0 && r < height && c >= 0 && c < width && rows.has(r, c); }
};

// Which ways on: bit (dr + 1) * 3 + dc + 1.
inline int bit(int dr, int dc) { return 1 << ((dr + 1) * 3 + dc + 1); }

struct Entry {
    int32_t f, g;
    int cell, ways;
    bool operator<(const Entry& other) const { return f > other.f; }
};

}  // namespace

// free: uint8 [H, W] of 0 and 1. Returns how many cells were expanded; length in cell sides, infinite where no path leads.
extern "C" int32_t word_jps(
    const uint8_t* free, int32_t height, int32_t width, int32_t row, int32_t col, int32_t goal_row, int32_t goal_col, double* length) {
    static thread_local Search map;
    map.read(free, height, width);
    *length = __builtin_inf();
    if (!map.is_free(row, col) || !map.is_free(goal_row, goal_col)) return 0;
    map.rows.stop_at(goal_row, goal_col);
    map.columns.stop_at(goal_col, goal_row);
    std::priority_queue<Entry> queue;
    auto estimate = [&](int r, int c) {
        const int32_t a = std::abs(r - goal_row), b = std::abs(c - goal_col);
        return std::max(a, b) * STRAIGHT + std::min(a, b) * (DIAGONAL - STRAIGHT);
    };
    auto offer = [&](int r, int c, int32_t g, int ways) {
        const int cell = r * width + c;
        if (map.best[cell] == FAR) map.touched.push_back(cell);
        if (g < map.best[cell]) {
            map.best[cell] = g;
            queue.push({g + estimate(r, c), g, cell, ways});
        }
    };
    // Along a row or a column to the next stop; there straight on, and into what opens on either side.
    auto along_row = [&](int r, int c, int32_t g, int way) {
        const int x = map.rows.next(r, c, way);
        if (!map.is_free(r, x)) return;
        int ways = bit(0, way);
        for (int side : {-1, 1})
            if (map.is_free(r + side, x) && !map.is_free(r + side, x - way)) ways |= bit(side, 0) | bit(side, way);
        offer(r, x, g + STRAIGHT * std::abs(x - c), ways);
    };
    auto along_column = [&](int r, int c, int32_t g, int way) {
        const int x = map.columns.next(c, r, way);
        if (!map.is_free(x, c)) return;
        int ways = bit(way, 0);
        for (int side : {-1, 1})
            if (map.is_free(x, c + side) && !map.is_free(x - way, c + side)) ways |= bit(0, side) | bit(way, side);
        offer(x, c, g + STRAIGHT * std::abs(x - r), ways);
    };
    auto diagonal = [&](int r, int c, int32_t g, int dr, int dc) {
        while (map.is_free(r + dr, c) && map.is_free(r, c + dc) && map.is_free(r + dr, c + dc)) {
            r += dr, c += dc, g += DIAGONAL;
            if (r == goal_row && c == goal_col) return offer(r, c, g, 0);
            along_row(r, c, g, dc);
            along_column(r, c, g, dr);
        }
    };
    offer(row, col, 0, 511);
    int32_t expanded = 0;
    while (!queue.empty()) {
        const Entry entry = queue.top();
        queue.pop();
        if (entry.g != map.best[entry.cell]) continue;
        const int r = entry.cell / width, c = entry.cell % width;
        if (r == goal_row && c == goal_col) {
            *length = entry.g / static_cast<double>(STRAIGHT);
            break;
        }
        ++expanded;
        for (int way : {-1, 1}) {
            if (entry.ways & bit(0, way)) along_row(r, c, entry.g, way);
            if (entry.ways & bit(way, 0)) along_column(r, c, entry.g, way);
            for (int other : {-1, 1})
                if (entry.ways & bit(way, other)) diagonal(r, c, entry.g, way, other);
        }
    }
    return expanded;
}
