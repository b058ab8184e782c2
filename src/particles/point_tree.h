#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "math/vec.h"

namespace embrun {

/// A balanced k-d tree over points [Bentley1975], for the nearest neighbours in clouds of any density. Answers are exact and
/// a function of the points alone: where distances are equal, the lower index comes first.
class PointTree {
 public:
  struct Neighbour {
    double distance_squared = 0;
    std::uint32_t index = 0;
    bool operator<(const Neighbour& other) const {
      return distance_squared != other.distance_squared ? distance_squared < other.distance_squared
                                                        : index < other.index;
    }
  };
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  /// Positions finite, fewer than 2^32 - 1. Built in parallel; the points are copied.
  explicit PointTree(std::span<const Vec3d> points);

  std::size_t size() const { return points_.size(); }
  /// Looks up the k nearest others of every point once and keeps them, 4 k bytes a point, for nearest_others().
  void remember_neighbours(std::size_t k);
  /// nearest() of the tree's own point i, without itself; from memory where that holds as many.
  std::size_t nearest_others(std::uint32_t i, std::span<Neighbour> found) const;
  /// All indices in the order of the tree: points near each other stand together, which keeps queries in cache.
  std::span<const std::uint32_t> order() const { return indices_; }
  /// Fills `found` with the points nearest to p, nearest first, without the one of index `except`; returns how many
  /// there are (fewer than asked for only where the tree has fewer). `within` is a distance within which there surely
  /// are as many, for who knows one: it spares looking farther.
  std::size_t nearest(Vec3d p, std::span<Neighbour> found, std::uint32_t except = none,
                      double within = std::numeric_limits<double>::infinity()) const;

 private:
  struct Query;
  std::vector<Vec3d> points_;           // in the order of the tree
  std::vector<std::uint32_t> indices_;  // of those
  std::vector<std::uint8_t> axes_;      // by node: children of n are 2n + 1 and 2n + 2, each with half the points
  std::vector<double> splits_;
  std::size_t levels_ = 0;
  std::vector<std::uint32_t> places_;      // in that order, of indices
  std::vector<std::uint32_t> remembered_;  // by index, nearest first
  std::size_t remembered_count_ = 0;       // for each point

  Vec3d point(std::uint32_t i) const { return points_[places_[i]]; }

  void visit(Query& query, std::size_t node, std::size_t level, std::size_t begin, std::size_t end, double distance,
             Vec3d outside) const;
};

/// Calls body(i, neighbours) for every point of the tree with its k nearest others, nearest first, in parallel; body must write
/// only to what belongs to i.
template <class Body>
void for_each_neighbourhood(const PointTree& tree, std::size_t k, const Body& body) {
  constexpr std::size_t grain = 512;
  parallel_for(tree.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<PointTree::Neighbour> found(k);
    for (std::size_t place = begin; place < end; ++place) {
      const std::uint32_t i = tree.order()[place];
      const std::size_t count = tree.nearest_others(i, found);
      body(i, std::span<const PointTree::Neighbour>(found).first(count));
    }
  });
}

}  // namespace embrun
