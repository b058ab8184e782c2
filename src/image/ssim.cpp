#include "image/ssim.h"

#include <array>
#include <cmath>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {
namespace {

constexpr int window = 11;

std::array<double, window> gaussian_window() {
  constexpr double sigma = 1.5;
  std::array<double, window> weights{};
  double sum = 0;
  for (int i = 0; i < window; ++i) {
    const double offset = i - window / 2;
    weights[static_cast<std::size_t>(i)] = std::exp(-offset * offset / (2 * sigma * sigma));
    sum += weights[static_cast<std::size_t>(i)];
  }
  for (double& w : weights) w /= sum;
  return weights;
}

double luma(const Image& image, int x, int y) {
  if (image.channels == 1) return static_cast<double>(image.at(x, y));
  return 0.2126 * static_cast<double>(image.at(x, y, 0)) + 0.7152 * static_cast<double>(image.at(x, y, 1)) +
         0.0722 * static_cast<double>(image.at(x, y, 2));
}

/// Weighted means of a, b and their products.
struct Moments {
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double weight, const Moments& m) {
    a += weight * m.a;
    b += weight * m.b;
    aa += weight * m.aa;
    bb += weight * m.bb;
    ab += weight * m.ab;
  }
};

double similarity(const Moments& m) {
  constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
  const double variance_a = m.aa - m.a * m.a, variance_b = m.bb - m.b * m.b, covariance = m.ab - m.a * m.b;
  return (2 * m.a * m.b + c1) * (2 * covariance + c2) / ((m.a * m.a + m.b * m.b + c1) * (variance_a + variance_b + c2));
}

/// Sum of the similarities of the windows whose top row is `top`; `columns` is scratch of the picture's width.
double row_of_windows(const Image& a, const Image& b, int top, const std::array<double, window>& weights,
                      std::vector<Moments>& columns) {
  for (int x = 0; x < a.width; ++x) {
    Moments column;
    for (int k = 0; k < window; ++k) {
      const double va = luma(a, x, top + k), vb = luma(b, x, top + k);
      column.add(weights[static_cast<std::size_t>(k)], {va, vb, va * va, vb * vb, va * vb});
    }
    columns[static_cast<std::size_t>(x)] = column;
  }
  double sum = 0;
  for (std::size_t x = 0; x + window <= columns.size(); ++x) {
    Moments moments;
    for (std::size_t k = 0; k < window; ++k) moments.add(weights[k], columns[x + k]);
    sum += similarity(moments);
  }
  return sum;
}

}  // namespace

std::optional<double> structural_similarity(const Image& a, const Image& b) {
  EMBRUN_CHECK(a.width == b.width && a.height == b.height && a.channels == b.channels);
  EMBRUN_CHECK(a.channels == 1 || a.channels == 3);
  if (a.width < window || a.height < window) return std::nullopt;
  const std::array<double, window> weights = gaussian_window();
  std::vector<double> rows(static_cast<std::size_t>(a.height - window + 1));
  parallel_for(rows.size(), 8, [&](std::size_t begin, std::size_t end) {
    std::vector<Moments> columns(static_cast<std::size_t>(a.width));
    for (std::size_t y = begin; y < end; ++y) rows[y] = row_of_windows(a, b, static_cast<int>(y), weights, columns);
  });
  double sum = 0;
  for (double row : rows) sum += row;
  return sum / (static_cast<double>(rows.size()) * static_cast<double>(a.width - window + 1));
}

}  // namespace embrun
