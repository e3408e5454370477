// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/block_matcher.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

// Compiled for AVX2, SSE4.1 and any x86-64; the loader takes what the processor has.
#if defined(__x86_64__) && defined(__gnu_linux__)
#define TLD_VECTORISED __attribute__((target_clones("avx2", "sse4.1", "default")))
#else
#define TLD_VECTORISED
#endif
// Compiled as part of its caller, for the same processor.
#define TLD_INLINE inline __attribute__((always_inline))

namespace tld_follower::stereo {
namespace {

constexpr int kLanes = 8;     // Disparities at a time.
constexpr int kColumns = 32;  // Columns at a time: their sums stay in the fastest cache.

// So many numbers, anywhere in memory; the compiler makes vector instructions of their operators.
template <typename Number>
struct LanesOf {
  typedef Number Type __attribute__((vector_size(kLanes * sizeof(Number)), aligned(1), may_alias));
};
template <typename Number>
using Lanes = typename LanesOf<Number>::Type;

template <typename Number>
TLD_INLINE Lanes<Number>& At(Number* memory) {
  return *reinterpret_cast<Lanes<Number>*>(memory);
}

// What moves the windows of a row of pixels down by one row: the prefiltered rows that enter and
// that leave them, and the sums that they change. Columns are numbered from the first one whose
// whole search lies in the right image.
template <typename Sum>
struct Row {
  int width;  // Columns.
  // Beyond this column, where the search would leave the right image, it stays.
  int last_searched;
  const uint8_t *left_in, *left_out;
  const uint8_t *right_in, *right_out;  // At the largest disparity of column 0.
  // Of column c, over the window's height: sums of differences, one a disparity, at
  // [(window + c) * range], and the sum of gradients. `window` columns of 0 come first.
  Sum* columns;
  int* textures;
  // Of kColumns windows, and before them of the last one before these: `range` sums each, then
  // kLanes numbers, and kLanes before them all, that are larger than any sum.
  Sum* window_sums;
};

// The smallest sum of every column's window, and what else decides over its disparity.
struct Candidates {
  std::vector<int> sum, next, previous;  // The smallest, and those of the disparities beside it.
  std::vector<int> index;                // The first one with that sum.
  std::vector<int> rivals;               // Others, not beside it, that come within the margin.
  std::vector<int> texture;              // Of column c at c + 1; 0 comes first.

  explicit Candidates(size_t width)
      : sum(width), next(width), previous(width), index(width), rivals(width), texture(width + 1) {}
};

// Folds the lanes onto each other with an operator, and returns what is left.
template <typename Number, typename Operator>
TLD_INLINE Number Folded(Lanes<Number> v, Operator combine) {
  static_assert(kLanes == 8);
  v = combine(v, __builtin_shufflevector(v, v, 4, 5, 6, 7, 0, 1, 2, 3));
  v = combine(v, __builtin_shufflevector(v, v, 2, 3, 0, 1, 2, 3, 0, 1));
  v = combine(v, __builtin_shufflevector(v, v, 1, 0, 1, 0, 1, 0, 1, 0));
  return v[0];
}

template <typename Number>
TLD_INLINE Number SmallestLane(const Lanes<Number>& lanes) {
  return Folded<Number>(
      lanes, [](const Lanes<Number>& a, const Lanes<Number>& b)
                 __attribute__((always_inline)) { return a < b ? a : b; });
}

template <typename Number>
TLD_INLINE Number SumOfLanes(const Lanes<Number>& lanes) {
  return Folded<Number>(
      lanes, [](const Lanes<Number>& a, const Lanes<Number>& b)
                 __attribute__((always_inline)) { return a + b; });
}

// Moves windows on by a column each: columns begin..end - 1, of which the sums of differences go to
// `sums`, `stride` numbers from one column to the next; those of column begin - 1 are before it.
template <typename Sum>
TLD_INLINE void Slide(const BlockMatcherParameters& p, const Row<Sum>& row, int begin, int end,
                      Sum* sums, int stride, int* textures) {
  const int range = p.range, window = p.window, cap = p.prefilter_cap;
  const int last_searched = row.last_searched;
  Sum* column = row.columns + static_cast<ptrdiff_t>(window + begin) * range;
  const Sum* leaving = row.columns + static_cast<ptrdiff_t>(begin) * range;
  int* texture = row.textures + window + begin;
  for (int c = begin; c < end; ++c, column += range, leaving += range, sums += stride, ++texture) {
    const int searched = std::min(c, last_searched);
    const auto left_in = static_cast<int8_t>(row.left_in[c]);
    const auto left_out = static_cast<int8_t>(row.left_out[c]);
    const auto* right_in = reinterpret_cast<const int8_t*>(row.right_in + searched);
    const auto* right_out = reinterpret_cast<const int8_t*>(row.right_out + searched);
    const Sum* before = sums - stride;
    for (int i = 0; i < range; i += kLanes) {
      // Gradients are at most 126: differences of these fit a signed byte, and so do theirs.
      const Lanes<int8_t> in = left_in - At(right_in + i);
      const Lanes<int8_t> out = left_out - At(right_out + i);
      const Lanes<int8_t> change = (in < 0 ? -in : in) - (out < 0 ? -out : out);
      const Lanes<Sum> column_sum = At(column + i) + __builtin_convertvector(change, Lanes<Sum>);
      At(column + i) = column_sum;
      At(sums + i) = At(before + i) + column_sum - At(leaving + i);
    }
    *texture += std::abs(left_in - cap) - std::abs(left_out - cap);
    textures[c] = textures[c - 1] + *texture - texture[-window];
  }
}

// Index i of a sum stands for the disparity min_disparity + range - 1 - i: so right pixels are read
// from left to right. Nothing branches on what the images show, and no column waits for another:
// the processor works on several of them at a time.
template <typename Sum>
TLD_INLINE void Search(const BlockMatcherParameters& p, const Row<Sum>& row, Candidates* out) {
  constexpr Sum kMost = std::numeric_limits<Sum>::max();  // No sum is as large.
  const int range = p.range, margin = p.uniqueness_ratio, stride = range + kLanes;
  int *const out_sum = out->sum.data(), *const out_next = out->next.data();
  int *const out_previous = out->previous.data(), *const out_index = out->index.data();
  int* const out_rivals = out->rivals.data();
  Lanes<Sum> first_indices;
  for (int i = 0; i < kLanes; ++i) first_indices[i] = static_cast<Sum>(i);
  const Lanes<Sum> none = kMost - Lanes<Sum>{};
  std::fill_n(row.window_sums, range, Sum{0});
  Sum* const first = row.window_sums + stride;
  for (int begin = 0; begin < row.width; begin += kColumns) {
    const int end = std::min(begin + kColumns, row.width);
    Slide(p, row, begin, end, first, stride, out->texture.data() + 1);
    const Sum* sums = first;
    for (int c = begin; c < end; ++c, sums += stride) {
      Lanes<Sum> least = none, indices = first_indices, least_at = first_indices;
      for (int i = 0; i < range; i += kLanes, indices += kLanes) {
        const Lanes<Sum> sum = At(sums + i);
        least_at = sum < least ? indices : least_at;
        least = sum < least ? sum : least;
      }
      out_sum[c] = SmallestLane<Sum>(least);
      out_index[c] = SmallestLane<Sum>(least == static_cast<Sum>(out_sum[c]) ? least_at : none);
    }
    sums = first;
    for (int c = begin; c < end; ++c, sums += stride) {
      const int index = out_index[c];
      const Sum after = sums[index + 1], before = sums[index - 1];
      out_next[c] = index < range - 1 ? after : before;
      out_previous[c] = index > 0 ? before : after;
      const int bound = out_sum[c] + out_sum[c] * margin / 100;
      const auto limit = static_cast<Sum>(std::min(bound, kMost - 1));
      Lanes<Sum> within{};
      for (int i = 0; i < range; i += kLanes) within -= At(sums + i) <= limit;
      out_rivals[c] = SumOfLanes<Sum>(within) - 1 - (after <= limit) - (before <= limit);
    }
    std::copy_n(sums - stride, range, row.window_sums);
  }
}

// Clones cannot be templates.
TLD_VECTORISED void SearchShort(const BlockMatcherParameters& p, const Row<int16_t>& row,
                                Candidates* out) {
  Search(p, row, out);
}
TLD_VECTORISED void SearchLong(const BlockMatcherParameters& p, const Row<int32_t>& row,
                               Candidates* out) {
  Search(p, row, out);
}

// Disparities of the candidates that hold: the vertex of the parabola to 1/256 pixel, rounded up to
// 1/16.
TLD_VECTORISED void Decide(const BlockMatcherParameters& p, const Candidates& from, int begin,
                           int end, int16_t* out) {
  const int *const sum = from.sum.data(), *const next = from.next.data();
  const int *const previous = from.previous.data(), *const index = from.index.data();
  const int *const rivals = from.rivals.data(), *const texture = from.texture.data() + 1;
  const int largest = p.range - 1 + p.min_disparity;
  const auto none = static_cast<int16_t>((p.min_disparity - 1) * 16);
  const int least_texture = p.texture_threshold;
  const int allowed = p.uniqueness_ratio > 0 ? 0 : p.range;
  for (int c = begin; c < end; ++c) {
    const int slope = next[c] - previous[c];
    const int curvature = next[c] + previous[c] - 2 * sum[c] + std::abs(slope);
    // As exact in double precision as in whole numbers, and there are instructions for it.
    const int fraction = static_cast<int>(256.0 * slope / std::max(curvature, 1));
    out[c - begin] = static_cast<int16_t>(((largest - index[c]) * 256 + fraction + 15) >> 4);
  }
  // A loop of its own: a condition around the above would keep it from being vectorised.
  for (int c = begin; c < end; ++c) {
    const bool holds = (texture[c] >= least_texture) & (rivals[c] <= allowed);
    out[c - begin] = holds ? out[c - begin] : none;
  }
}

template <typename Sum>
void MatchRows(const cv::Mat& left, const cv::Mat& right, const BlockMatcherParameters& p,
               void (*search)(const BlockMatcherParameters&, const Row<Sum>&, Candidates*),
               std::vector<Sum>* sums, cv::Mat* disparity) {
  const int largest = p.min_disparity + p.range - 1;
  const int begin = std::max(0, largest);
  const int beyond = std::max(0, -p.min_disparity);
  const int end = left.cols - std::max(0, beyond - p.window / 2);
  if (end - begin < p.window) return;
  Row<Sum> row;
  row.width = end - begin;
  row.last_searched = left.cols - beyond - 1 - begin;
  const size_t stride = p.range + kLanes, windows = kLanes + stride * (kColumns + 1);
  sums->assign(windows + static_cast<size_t>(p.window + row.width) * p.range, 0);
  std::fill_n(sums->begin(), windows, std::numeric_limits<Sum>::max());
  row.window_sums = sums->data() + kLanes;
  row.columns = sums->data() + windows;
  std::vector<int> textures(p.window + row.width);
  row.textures = textures.data();
  Candidates candidates(row.width);
  // Leaves the window while it is not yet full: no gradient, no difference.
  const std::vector<uint8_t> nothing(left.cols, static_cast<uint8_t>(p.prefilter_cap));
  for (int y = 0; y < left.rows; ++y) {
    const bool is_full = y >= p.window;
    row.left_in = left.ptr(y) + begin;
    row.right_in = right.ptr(y) + begin - largest;
    row.left_out = (is_full ? left.ptr(y - p.window) : nothing.data()) + begin;
    row.right_out = (is_full ? right.ptr(y - p.window) : nothing.data()) + begin - largest;
    search(p, row, &candidates);
    if (y < p.window - 1) continue;
    // A window is complete at its last column, and belongs to its middle one.
    Decide(p, candidates, p.window - 1, row.width,
           disparity->ptr<int16_t>(y - p.window / 2) + begin + p.window / 2);
  }
}

// Sobel's horizontal gradient, bounded to +-cap and shifted by cap. As in cv::StereoBM the first
// and the last column, and the last row of an odd number of them, hold none.
TLD_VECTORISED void PrefilterRow(const uint8_t* above, const uint8_t* here, const uint8_t* below,
                                 int width, int cap, uint8_t* out) {
  out[0] = out[width - 1] = static_cast<uint8_t>(cap);
  for (int x = 1; x < width - 1; ++x) {
    const int gradient =
        above[x + 1] - above[x - 1] + 2 * (here[x + 1] - here[x - 1]) + below[x + 1] - below[x - 1];
    out[x] = static_cast<uint8_t>(std::min(std::max(gradient, -cap), cap) + cap);
  }
}

void Prefilter(const cv::Mat& image, int cap, cv::Mat* out) {
  out->create(image.size(), CV_8UC1);
  const int last = image.rows - 1;
  for (int y = 0; y <= last; ++y) {
    if (y == last && image.rows % 2 == 1) {
      out->row(y).setTo(cap);
      continue;
    }
    // Beyond the border the image goes back the way it came.
    PrefilterRow(image.ptr(y == 0 ? 1 : y - 1), image.ptr(y),
                 image.ptr(y == last ? last - 1 : y + 1), image.cols, cap, out->ptr(y));
  }
}

}  // namespace

void BlockMatcher::Match(const cv::Mat& left, const cv::Mat& right,
                         const BlockMatcherParameters& parameters, cv::Mat* disparity) {
  disparity->create(left.size(), CV_16SC1);
  disparity->setTo((parameters.min_disparity - 1) * 16);
  Prefilter(left, parameters.prefilter_cap, &left_);
  Prefilter(right, parameters.prefilter_cap, &right_);
  const int largest_sum = parameters.window * parameters.window * 2 * parameters.prefilter_cap;
  if (largest_sum < std::numeric_limits<int16_t>::max() - 1) {
    MatchRows(left_, right_, parameters, SearchShort, &short_sums_, disparity);
  } else {
    MatchRows(left_, right_, parameters, SearchLong, &long_sums_, disparity);
  }
}

}  // namespace tld_follower::stereo
