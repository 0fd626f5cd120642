#pragma once
// Two sphere trees against each other, level by level.
#include <array>
#include <cstdint>
#include <vector>

#include "haptics/collision/sphere_tree.hpp"

namespace touchstone {

/// A tool leaf and a bucket of eight obstacle leaves, [8·bucket, 8·bucket + 8), that may be near each other.
struct LeafBucket {
    std::int32_t toolLeaf;
    std::int32_t bucket;
};

/// Bound on the error, in mm, of a distance computed in float at this pose: added wherever a float test must not miss.
float floatGuard(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT);

/// Finds the leaf buckets within a margin. Breadth first in blocks that fit the cache: one tool block (as a sphere)
/// against eight obstacle blocks (as rounded boxes and spheres), or eight tool blocks against one, whichever side has
/// the larger blocks. The schedule is fixed per pair of trees and the memory is taken in the constructor.
class TreeWalk {
  public:
    TreeWalk(const SphereTree& tool, const SphereTree& obstacle);

    /// Calls sink(const LeafBucket*, count) with runs of entries that together hold every leaf pair with gap <= margin
    /// mm, margin >= 0. Buckets of one tool leaf arrive in ascending order; tool leaves arrive in any. X_OT: tool node
    /// in the obstacle's frame. Real time: no allocation, lock or throw beyond the sink's own.
    template <class Sink>
    void run(const Pose& X_OT, double margin, Sink&& sink) {
        runErased(
            X_OT, margin, [](void* s, const LeafBucket* e, int n) { (*static_cast<Sink*>(s))(e, n); }, &sink);
    }

  private:
    using ErasedSink = void (*)(void*, const LeafBucket*, int);
    struct Frontier {
        std::vector<std::int32_t> tool, obstacle;
    };
    struct Query;

    void runErased(const Pose& X_OT, double margin, ErasedSink sink, void* context);
    void descend(const Query& query, int depth, int count);
    int expandObstacle(const Query& query, int depth, int first, int count, int& used);
    int expandTool(const Query& query, int depth, int first, int count, int& used);

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    /// levels_[d] = {tool level, obstacle level} of the pairs in frontiers_[d].
    std::vector<std::array<int, 2>> levels_;
    std::vector<Frontier> frontiers_;
    std::vector<LeafBucket> out_;
};

}  // namespace touchstone
