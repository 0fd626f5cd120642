#include "haptics/surface/feature_pair_finder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "haptics/math/tick_tuning.hpp"
#include "haptics/surface/feature_crossing.hpp"
#include "haptics/surface/feature_query.hpp"

namespace touchstone {

using namespace simd;
using Eigen::Matrix3f;
using Eigen::Vector3f;

namespace {

/// a where the lane of `which` is set, and else b.
Separation8 choose(const Int8& which, const Separation8& a, const Separation8& b) {
    Separation8 s;
    for (int k = 0; k < 3; ++k) {
        s.n[k] = which ? a.n[k] : b.n[k];
        s.a[k] = which ? a.a[k] : b.a[k];
        s.b[k] = which ? a.b[k] : b.b[k];
    }
    s.offset = which ? a.offset : b.offset;
    return s;
}

/// The tools and the obstacles of eight entries.
TOUCHSTONE_INLINE std::pair<Int8, Int8> columnsOf(const PairEntry* entries) {
    Int8 low, high;
    std::memcpy(&low, entries, sizeof low);
    std::memcpy(&high, entries + 4, sizeof high);
    return {__builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14),
            __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15)};
}

/// Collects pairs and calls visit(kind, features of the tool, of the obstacle, their number) for up to eight of one
/// kind at a time. Places behind the number repeat the first pair. push() and flush() return false if `visit` did.
template <class Visit>
class Eights {
  public:
    explicit Eights(const Visit& visit) : visit_(visit) {}
    bool push(PairKind kind, const Int8& ours, const Int8& others, Mask of) {
        if (kind != kind_ && !flush()) return false;
        kind_ = kind;
        compressStore(ours_ + count_, ours, of);
        compressStore(others_ + count_, others, of);
        count_ += std::popcount(of);
        if (count_ < 8) return true;
        const bool goOn = visit_(kind_, ours_, others_, 8);
        count_ -= 8;
        std::copy_n(ours_ + 8, 8, ours_);
        std::copy_n(others_ + 8, 8, others_);
        return goOn;
    }
    bool flush() {
        if (count_ == 0) return true;
        for (int i = count_; i < 8; ++i) ours_[i] = ours_[0], others_[i] = others_[0];
        return visit_(kind_, ours_, others_, std::exchange(count_, 0));
    }

  private:
    Visit visit_;
    PairKind kind_{};
    int ours_[16], others_[16], count_ = 0;
};

}  // namespace

FeaturePairFinder::FeaturePairFinder(const Surface& tool, const Surface& obstacle)
    : PairFinder(tool.extent, 1),
      tool_(&tool),
      obstacle_(&obstacle),
      leastAbout_(std::min(tool.extent.about.minCoeff(), tool.extent.reach)) {
    const auto eights = [](const std::vector<int>& starts) {
        int most = 1;
        for (std::size_t i = 1; i < starts.size(); ++i) most = std::max(most, starts[i] - starts[i - 1]);
        return std::size_t(paddedToEight(most)) / 8;
    };
    const Vec8 zero = Vector3f(Vector3f::Zero());
    placed_.resize(std::max(eights(tool.firstVertex), eights(tool.firstEdge)), {zero, zero});
    placedEdges_.resize(placed_.size(), {zero, {zero, zero}});
    resting_.resize(eights(obstacle.firstEdge), {{zero, zero}, zero, {zero, zero}});
    // A walk holds the obstacle's nodes of each height up to three times; where the tool is higher, those of the
    // highest more often. Eight lanes may be written behind the last.
    std::size_t nodes = 8;
    for (int height = 0; !obstacle.tree.empty() && height <= obstacle.tree.height(); ++height)
        nodes += 3 * std::size_t(obstacle.tree.count(height));
    nodes_.resize(nodes + 2 * std::size_t(std::max(0, tool.tree.height() - obstacle.tree.height())));
}

PairEntries FeaturePairFinder::entries() const {
    const SurfaceFeatures &ours = tool_->features, &others = obstacle_->features;
    const auto pairs = [](const auto& a, const auto& b) { return std::int64_t(a.size()) * std::int64_t(b.size()); };
    PairEntries entries(pairs(ours.vertices, others.faces) + pairs(ours.faces, others.vertices) +
                        pairs(ours.edges, others.edges));
    entries.apart.resize(int(paddedToEight(std::min(entries.capacity, kSeparated))));
    return entries;
}

float FeaturePairFinder::guard(const Pose& X_OT) const {
    const double t = (X_OT * tool_->extent.center - obstacle_->extent.center).norm();
    return float(16 * 0x1p-24 * (tool_->extent.reach + obstacle_->extent.reach + t) + 1e-7);
}

/// Visits all patches of the tool below a node, each with those patches of the obstacle whose features of these kinds
/// come within the margin and can oppose its own: visit(patch, Swept, others). `others`: the nodes of the obstacle that
/// the node may meet; what is behind them in memory is overwritten. Returns false if `visit` did.
template <class Visit>
bool FeaturePairFinder::descend(const Query& q, FeatureKind kind, FeatureKind other, Node a, const Swept& swept,
                                Nodes others, Visit& visit) {
    constexpr int n = FeatureTree::kChildren;
    const FeatureTree& tree = obstacle_->tree;
    std::int32_t* behind = others.all.data() + others.all.size();
    while (others.height > a.height) {
        std::size_t count = 0;
        if (!spend(std::int64_t(others.all.size()))) return false;
        for (const std::int32_t b : others.all) {
            const Mask met = swept.meets(tree.children(other, others.height, b));
            compressStore(behind + count, splat(n * b) + lanes(), met);
            count += std::size_t(std::popcount(met));
        }
        others = {others.height - 1, {behind, count}};
        behind += count;
    }
    if (others.all.empty()) return true;
    if (!spend(std::int64_t(others.all.size()))) return false;
    if (a.height == 0) return visit(a.index, swept, others.all);
    const Swept8 children(q, tool_->tree.children(kind, a.height, a.index));
    std::int32_t *const met = behind, *const list = behind + others.all.size();
    Mask any = 0;
    for (std::size_t k = 0; k < others.all.size(); ++k) {
        const std::int32_t b = others.all[k];
        const Mask mask = children.box.meets(boxOf(tree.eight(other, others.height, b / n), b % n));
        met[k] = std::int32_t(mask);
        any |= mask;
    }
    for (; any; any &= any - 1) {
        const int i = std::countr_zero(any);
        std::size_t count = 0;
        for (std::size_t k = 0; k < others.all.size(); ++k) {
            list[count] = others.all[k];
            count += std::size_t(met[k] >> i & 1);
        }
        const Node child{a.height - 1, n * a.index + i};
        if (!descend(q, kind, other, child, children.lane(i), {others.height, {list, count}}, visit)) return false;
    }
    return true;
}

template <class Visit>
bool FeaturePairFinder::walkKinds(const Query& q, FeatureKind kind, FeatureKind other, Visit&& visit) {
    const FeatureTree &ours = tool_->tree, &others = obstacle_->tree;
    if (ours.empty() || others.empty()) return true;
    const Node root{ours.height(), 0};
    const Swept8 roots(q, ours.eight(kind, root.height, 0));
    if (!(roots.box.meets(boxOf(others.eight(other, others.height(), 0), 0)) & 1)) return true;
    nodes_[0] = 0;
    return descend(q, kind, other, root, roots.lane(0), {others.height(), {nodes_.data(), 1}}, visit);
}

bool FeaturePairFinder::walkErased(const Coverage& asked, Bounds bounds, ErasedVisit visit, void* context) {
    const Query q(*tool_, *obstacle_, asked, guard(asked.motion.X_OT), leastAbout_, bounds);
    constexpr int n = FeatureTree::kChildren;
    // Few of the pairs of two patches are near. Those whose boxes meet are measured eight at a time.
    Eights eights([&](PairKind kind, const int* ours, const int* others, int count) {
        Separation8 apart;
        if (!spend(kMeasure)) return false;
        const Float8 gaps = q.measure(kind, ours, others, apart);
        const Mask near = lessEqual(gaps, splat(q.margin)) & ((1u << count) - 1);
        return !near || visit(context, kind, ours, others, near, gaps, apart);
    });
    const auto first = [](int count) { return count < n ? (1u << count) - 1 : (1u << n) - 1; };
    const auto spendAll = [&](int features, std::span<const std::int32_t> others) {
        return spend(std::int64_t((features + n - 1) / n) * std::int64_t(others.size()));
    };
    auto vertexFaces = [&](int patch, const Swept&, std::span<const std::int32_t> others) {
        const int begin = tool_->firstVertex[patch], end = tool_->firstVertex[patch + 1];
        if (!spendAll(end - begin, others)) return false;
        for (int v = begin; v < end; v += n) {
            int eight[n];
            for (int i = 0; i < n; ++i) eight[i] = std::min(v + i, end - 1);
            placed_[std::size_t(v - begin) / n] = q.swept(q.R * verticesOf(*tool_, eight));
        }
        for (const int other : others) {
            const Box8 box = boxOf(obstacle_->tree.eight(FeatureKind::Face, 0, other / n), other % n);
            for (int eight = begin; eight < end; eight += n) {
                const Box8& mine = placed_[std::size_t(eight - begin) / n];
                Mask near = mine.meets(box) & first(end - eight);
                if (!near) continue;
                if (!spend(std::popcount(near))) return false;
                const FaceLanes faces(Eight(obstacle_->faces, n * other));
                const Box8 boxes = faces.box();
                const Vec8 normals = q.R.transpose() * faces.normal;
                for (; near; near &= near - 1) {
                    const int i = std::countr_zero(near);
                    Mask mask = mine.all(i).meets(boxes) & first(obstacle_->facesOf(other));
                    if (mask) mask &= q.opposes(*tool_, eight + i, normals);
                    if (mask && !eights.push(PairKind::VertexFace, splat(eight + i), splat(n * other) + lanes(), mask))
                        return false;
                }
            }
        }
        return true;
    };
    auto facesVertex = [&](int patch, const Swept& swept, std::span<const std::int32_t> others) {
        if (!spendAll(n, others)) return false;
        const FaceLanes faces = q.R * FaceLanes(Eight(tool_->faces, n * patch));
        const Box8 placed = q.swept(faces.a) | q.swept(faces.b) | q.swept(faces.c);
        for (const int other : others)
            for (int v = obstacle_->firstVertex[other]; v < obstacle_->firstVertex[other + 1]; ++v) {
                const Vector3f& p = obstacle_->points[obstacle_->features.vertices[v].point];
                if (!swept.meets(p, p)) continue;
                Mask mask = placed.meets({p, p}) & first(tool_->facesOf(patch));
                if (mask) mask &= q.opposes(*obstacle_, v, faces.normal);
                if (mask && !eights.push(PairKind::FaceVertex, splat(n * patch) + lanes(), splat(v), mask))
                    return false;
            }
        return true;
    };
    auto edges = [&](int patch, const Swept&, std::span<const std::int32_t> others) {
        const int begin = tool_->firstEdge[patch], end = tool_->firstEdge[patch + 1];
        if (!spendAll(end - begin, others)) return false;
        for (int e = begin; e < end; e += n) {
            const Eight tools(tool_->edges, e);
            const EdgeLanes ends = q.R * EdgeLanes::ends(tools);
            placed_[std::size_t(e - begin) / n] = q.swept(ends.first) | q.swept(ends.second);
            placedEdges_[std::size_t(e - begin) / n] = {ends.second - ends.first, q.R * EdgeLanes::wings(tools)};
        }
        for (const int other : others) {
            const Box8 box = boxOf(obstacle_->tree.eight(FeatureKind::Edge, 0, other / n), other % n);
            const int otherBegin = obstacle_->firstEdge[other], otherEnd = obstacle_->firstEdge[other + 1];
            bool rests = false;
            for (int eight = begin; eight < end; eight += n) {
                const Box8& boxes = placed_[std::size_t(eight - begin) / n];
                const auto& [u, wings] = placedEdges_[std::size_t(eight - begin) / n];
                for (Mask near = boxes.meets(box) & first(end - eight); near; near &= near - 1) {
                    const int i = std::countr_zero(near);
                    const Box8 mine = boxes.all(i);
                    if (!spend((otherEnd - otherBegin + n - 1) / n)) return false;
                    if (!std::exchange(rests, true))
                        for (int from = otherBegin; from < otherEnd; from += n) {
                            const Eight theirs(obstacle_->edges, from);
                            const EdgeLanes ends = EdgeLanes::ends(theirs);
                            resting_[std::size_t(from - otherBegin) / n] = {ends.box(), ends.second - ends.first,
                                                                            EdgeLanes::wings(theirs)};
                        }
                    for (int from = otherBegin; from < otherEnd; from += n) {
                        const auto& [theirs, v, otherWings] = resting_[std::size_t(from - otherBegin) / n];
                        Mask mask = mine.meets(theirs) & first(otherEnd - from);
                        if (mask) mask &= toMask(q.opposing(u.all(i), wings.all(i), v, otherWings));
                        if (mask && !eights.push(PairKind::EdgeEdge, splat(eight + i), splat(from) + lanes(), mask))
                            return false;
                    }
                }
            }
        }
        return true;
    };
    walkKinds(q, FeatureKind::Vertex, FeatureKind::Face, vertexFaces) &&
        walkKinds(q, FeatureKind::Face, FeatureKind::Vertex, facesVertex) &&
        walkKinds(q, FeatureKind::Edge, FeatureKind::Edge, edges) && eights.flush();
    return fits();
}

bool FeaturePairFinder::search(const Coverage& asked, PairEntries& out) {
    out.count = 0;
    bool fits = true;
    auto add = [&](PairKind kind, const int* ours, const int* others, Mask near, const Float8& gaps,
                   const Separation8& apart) {
        const int first = out.count;
        fits = first + std::popcount(near) <= out.capacity;
        if (!fits) return false;
        compressStore(&out.gap[std::size_t(first)], gaps, near);
        store(&out.sum[std::size_t(first)], splat(1.0f));
        out.apart.write(first, apart, near);
        for (; near; near &= near - 1) {
            const int i = std::countr_zero(near);
            out.at[std::size_t(out.count++)] = {toolFeature(kind, ours[i]), others[i]};
        }
        return true;
    };
    const bool finished = walk(asked, Bounds::Quick, add);
    return fits && finished;
}

/// The two ends of a motion in which points of the tool move straight.
struct FeaturePairFinder::Ends {
    struct Place {
        Matrix3f M;
        Vector3f m;

        TOUCHSTONE_INLINE Float8 apart(const Separation8& s) const {
            Float8 n[3];
            for (int k = 0; k < 3; ++k) n[k] = sumOfProducts(M(0, k), s.n[0], M(1, k), s.n[1], M(2, k), s.n[2]);
            const Float8 a = sumOfProducts(n[0], s.a[0], n[1], s.a[1], n[2], s.a[2]),
                         b = sumOfProducts(n[0], s.b[0], n[1], s.b[1], n[2], s.b[2]);
            return min(a, b) + (sumOfProducts(m[0], s.n[0], m[1], s.n[1], m[2], s.n[2]) - s.offset);
        }
    };
    Place tool[2];      ///< of the tool in the obstacle's frame
    Place obstacle[2];  ///< of the obstacle in the tool's frame
    float bend = 0;     ///< by which those of the obstacle leave their straight paths in the tool's frame, mm

    /// Lower bounds on the distances of eight pairs of these kinds.
    TOUCHSTONE_INLINE Float8 apart(const Separation8& s, const Int8& kinds) const {
        const Int8 inTool = kinds == splat(std::int32_t(PairKind::FaceVertex));
        const Mask lanes = toMask(inTool);
        Float8 bound = splat(0.0f);
        if (lanes != 0xff) bound = min(tool[0].apart(s), tool[1].apart(s));
        if (lanes) bound = inTool ? min(obstacle[0].apart(s), obstacle[1].apart(s)) - bend : bound;
        return bound;
    }
    static Place inverse(const Place& place) { return {place.M.transpose(), -(place.M.transpose() * place.m)}; }
};

/// Calls visit(first, mask, bounds on the gaps) for eight neighboring entries at a time of which the lanes of the mask
/// may hold a pair of the coverage. ends: those of the coverage's motion. apartFromFaces: pairs of a vertex and a face
/// that are farther apart by their separation are left out.
template <class Visit>
void FeaturePairFinder::forEachNear(const PairEntries& entries, const Coverage& asked, const Ends& ends,
                                    float apartFromFaces, Visit&& visit) const {
    const float about = guard(asked.motion.X_OT), margin = float(asked.within.margin) + about,
                moved = float(deviationFrom(entries, asked.motion)) + about;
    for (int first = 0; first < entries.count; first += 8) {
        const int n = std::min(8, entries.count - first);
        Float8 gap = load(&entries.gap[std::size_t(first)]) - splat(moved);
        Mask mask = lessEqual(gap, splat(margin)) & ((1u << n) - 1);
        if (!mask) continue;
        if (first < entries.apart.capacity()) {
            const Int8 kinds = columnsOf(&entries.at[std::size_t(first)]).first >> kFeatureBits;
            const Float8 apart = ends.apart(entries.apart.eight(first), kinds);
            mask &= lessEqual(apart, kinds == splat(std::int32_t(PairKind::EdgeEdge)) ? splat(margin)
                                                                                      : splat(apartFromFaces + about));
            gap = max(apart, gap);
        }
        if (mask && !visit(first, mask, gap)) return;
    }
}

void FeaturePairFinder::select(const PairEntries& from, const Coverage& asked, PairEntries& out, bool renew) {
    const Query q(*tool_, *obstacle_, asked, guard(asked.motion.X_OT), leastAbout_, Bounds::Quick);
    // Points of the tool move straight. In its frame those of the obstacle do not.
    const Vector3f w = q.turn;
    Matrix3f cross;
    cross << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
    const Ends::Place start{q.R, q.t};
    const Ends::Place end{expRotation(asked.motion.turn).toRotationMatrix().cast<float>() * q.R, q.t + q.shift};
    const float turned = w.norm();
    const Ends ends{{start, {q.R + cross * q.R, q.t + q.shift}},
                    {Ends::inverse(start), Ends::inverse(end)},
                    turned * turned * float(extent_.reach) + turned * q.shift.norm() / 2};
    const Separation8 none{{}, splat(HUGE_VALF), {}, {}};  // bounds no distance
    int count = 0;
    forEachNear(from, asked, ends, float(asked.within.margin), [&](int first, Mask mask, const Float8& gap) {
        // Where the sets are the same, what is written has been read.
        Separation8 apart = first < from.apart.capacity() ? from.apart.eight(first) : none;
        Float8 gaps = max(gap, splat(0.0f));
        const Int8 through = gap <= 0.0f;
        const auto entryAt = [&](int i) { return from.at[std::size_t(first + i)]; };
        const int last = std::bit_width(mask) - 1;
        if (const PairKind kind = kindOf(entryAt(0).tool);
            renew && (mask & toMask(through)) && kind == kindOf(entryAt(last).tool)) {
            int ours[8], others[8];
            for (int i = 0; i < 8; ++i) {
                const PairEntry entry = entryAt(std::min(i, last));
                ours[i] = featureOf(entry.tool);
                others[i] = entry.obstacle;
            }
            Separation8 now;
            gaps = through ? q.measure(kind, ours, others, now) : gaps;
            apart = choose(through, now, apart);
            mask &= lessEqual(gaps, splat(q.margin));
        }
        compressStore(&out.gap[std::size_t(count)], gaps, mask);
        store(&out.sum[std::size_t(count)], splat(1.0f));
        out.apart.write(count, apart, mask);
        for (; mask; mask &= mask - 1)
            out.at[std::size_t(count++)] = from.at[std::size_t(first + std::countr_zero(mask))];
        return true;
    });
    out.count = count;
}

void FeaturePairFinder::crossErased(const PairEntries& entries, const Coverage& asked, const Pose& before,
                                    const Pose& after, double least, double inside, ErasedCrossing visit,
                                    void* context) const {
    const CrossingSieve sieve(*tool_, *obstacle_, before, after, asked.motion.turn.norm(), least,
                              std::max(guard(before), guard(after)), inside);
    const auto placeAt = [&](const Pose& X_OT) {
        return Ends::Place{X_OT.R().cast<float>(), (X_OT * extent_.center - obstacle_->extent.center).cast<float>()};
    };
    const Ends::Place from = placeAt(before), to = placeAt(after);
    Eights eights([&](PairKind kind, const int* ours, const int* others, int n) {
        for (Mask mask = sieve.test(kind, ours, others) & ((1u << n) - 1); mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            if (!visit(context, {toolFeature(kind, ours[i]), others[i]})) return false;
        }
        return true;
    });
    bool goOn = true;
    const double turned = asked.motion.turn.norm();
    const double sag = sagOf(turned, asked.motion.shift.norm() + turned * extent_.reach);
    // A vertex crosses a face where it is nearer than that; the lines of edges may be farther apart where they cross.
    forEachNear(entries, asked, {{from, to}, {Ends::inverse(from), Ends::inverse(to)}, float(sag)},
                float(least + 2 * inside) + 1e-6f, [&](int first, Mask mask, const Float8&) {
                    const auto [tools, others] = columnsOf(&entries.at[std::size_t(first)]);
                    while (goOn && mask) {
                        const PairKind kind = kindOf(tools[std::countr_zero(mask)]);
                        const Mask same = mask & toMask((tools >> kFeatureBits) == splat(std::int32_t(kind)));
                        goOn = eights.push(kind, tools & splat((1 << kFeatureBits) - 1), others, same);
                        mask &= ~same;
                    }
                    return goOn;
                });
    if (goOn) eights.flush();
}

NearestPoints FeaturePairFinder::nearest(const Pose& X_OT, const PairEntry& pair) const {
    const SurfaceFeatures &tool = tool_->features, &obstacle = obstacle_->features;
    const int feature = featureOf(pair.tool);
    switch (kindOf(pair.tool)) {
        case PairKind::VertexFace: {
            const Vec3 p = X_OT * tool.points[tool.vertices[feature].point];
            return {p, closestPoint(p, obstacle.triangle(pair.obstacle), false)};
        }
        case PairKind::FaceVertex: {
            Triangle face = tool.triangle(feature);
            for (Vec3& corner : face) corner = X_OT * corner;
            const Vec3& p = obstacle.points[obstacle.vertices[pair.obstacle].point];
            return {closestPoint(p, face, false), p};
        }
        default: {
            const auto &ends = tool.edges[feature].points, &others = obstacle.edges[pair.obstacle].points;
            const Vec3 a = X_OT * tool.points[ends[0]], u = X_OT * tool.points[ends[1]] - a;
            const Vec3 &b = obstacle.points[others[0]], v = obstacle.points[others[1]] - b;
            const auto [s, t] = nearestFractions<Vec3>(u, v, a - b);
            return {a + s * u, b + t * v};
        }
    }
}

}  // namespace touchstone
