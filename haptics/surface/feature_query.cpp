#include "haptics/surface/feature_query.hpp"

namespace touchstone {

using namespace simd;
using Eigen::Vector3f;

namespace {

TOUCHSTONE_INLINE Separation8 separation(const Vec8& n, const Float8& offset, const Vec8& a, const Vec8& b) {
    return {{n.x, n.y, n.z}, offset, {a.x, a.y, a.z}, {b.x, b.y, b.z}};
}

}  // namespace

TOUCHSTONE_INLINE Float8 FeaturePairFinder::Query::vertexFaces(const Vec8& vertices, const FaceLanes& f,
                                                               Separation8& apart) const {
    const Vec8 arm = R * vertices, from = arm + Vec8(t), path = displacement(arm);
    const auto at = [&](float s) { return fromFace(fma(splat(s), path, from), f.a, f.b, f.c, f.normal); };
    const Near8 near = alongMotion(dot(path, path), splat(0.0f), guard, quick, at);
    const auto offset = [&](const Vec8& n) { return max(max(dot(n, f.a), dot(n, f.b)), dot(n, f.c)); };
    const Vec8 nearest = direction(near.off);
    const Float8 before = dot(nearest, from), bound = min(before, before + dot(nearest, path)) - offset(nearest);
    const Vec8 n = orAtStart(nearest, through(bound), at);
    apart = separation(n, offset(n), vertices, vertices);
    return quick ? max(near.gap, bound) : near.gap;
}

TOUCHSTONE_INLINE Float8 FeaturePairFinder::Query::facesVertex(const FaceLanes& faces, const Vec8& vertices,
                                                               Separation8& apart) const {
    // The motion is seen from the face, on which the vertex moves.
    const FaceLanes f = R * faces;
    const Vec8 p = vertices - Vec8(t), wa = displacement(f.a), wb = displacement(f.b), wc = displacement(f.c);
    const Vec8 ab = wb - wa, ac = wc - wa;
    const Float8 spread = 2.0f * simd::sqrt(max(dot(ab, ab), dot(ac, ac)));
    const auto at = [&](float s) {
        const Float8 share = splat(s);
        // The corners have moved by I + W with W v = w x v, so the normal by its cofactors I + W + w w'.
        const Vec8 w = Vector3f(s * turn), n = fma(dot(w, f.normal), w, f.normal + cross(w, f.normal));
        return fromFace(p, fma(share, wa, f.a), fma(share, wb, f.b), fma(share, wc, f.c),
                        1.0f / simd::sqrt(dot(n, n)) * n);
    };
    const Near8 near = alongMotion(max(max(dot(wa, wa), dot(wb, wb)), dot(wc, wc)), spread, guard, quick, at);
    const Vec8 nearest = direction(near.off);
    const auto farthest = [&](const Vec8& corner, const Vec8& by) {
        const Float8 before = dot(nearest, corner);
        return max(before, before + dot(nearest, by));
    };
    const Float8 bound = dot(nearest, p) - max(max(farthest(f.a, wa), farthest(f.b, wb)), farthest(f.c, wc));
    const Int8 atStart = through(bound);
    const Vec8 turned = orAtStart(nearest, atStart, at), w = (atStart ? splat(0.0f) : near.fraction) * Vec8(turn),
               back = turned - cross(w, turned);
    const Vec8 n = R.transpose() * fma(splat(0.5f), cross(w, cross(w, turned)), back);
    apart = separation(n, max(max(dot(n, faces.a), dot(n, faces.b)), dot(n, faces.c)), vertices, vertices);
    return quick ? max(near.gap, bound) : near.gap;
}

TOUCHSTONE_INLINE Float8 FeaturePairFinder::Query::edges(const EdgeLanes& mine, const EdgeLanes& theirs,
                                                         Separation8& apart) const {
    const EdgeLanes ours = R * mine;
    const Vec8 u = ours.second - ours.first, v = theirs.second - theirs.first;
    const Vec8 path = displacement(ours.first), bend = displacement(ours.second) - path,
               w = ours.first + Vec8(t) - theirs.first;
    const Float8 length2 = max(dot(path, path), dot(path + bend, path + bend));
    const auto at = [&](float s) {
        const Float8 share = splat(s);
        return fromEdge(fma(share, bend, u), v, fma(share, path, w));
    };
    const Near8 near = alongMotion(length2, simd::sqrt(dot(bend, bend)), guard, quick, at);
    const auto offset = [&](const Vec8& n) { return max(dot(n, theirs.first), dot(n, theirs.second)); };
    const Vec8 nearest = direction(near.off), first = ours.first + Vec8(t);
    const auto least = [&](const Vec8& end, const Vec8& by) {
        const Float8 before = dot(nearest, end);
        return min(before, before + dot(nearest, by));
    };
    const Float8 bound = min(least(first, path), least(first + u, path + bend)) - offset(nearest);
    const Vec8 n = orAtStart(nearest, through(bound), at);
    apart = separation(n, offset(n), mine.first, mine.second);
    return quick ? max(near.gap, bound) : near.gap;
}

Float8 FeaturePairFinder::Query::measure(PairKind kind, const int* ours, const int* others, Separation8& apart) const {
    switch (kind) {
        case PairKind::VertexFace:
            return vertexFaces(verticesOf(tool, ours), FaceLanes(Eight(obstacle.faces, others)), apart);
        case PairKind::FaceVertex:
            return facesVertex(FaceLanes(Eight(tool.faces, ours)), verticesOf(obstacle, others), apart);
        default:
            return edges(EdgeLanes::ends({tool.edges, ours}), EdgeLanes::ends({obstacle.edges, others}), apart);
    }
}

Mask FeaturePairFinder::Query::opposes(const Surface& part, int vertex, const Vec8& normals) const {
    const SurfaceFeatures::Vertex& v = part.features.vertices[vertex];
    Float8 least = splat(1.0f);
    for (int k = v.firstSpoke; k < v.firstSpoke + v.spokes; ++k) least = min(least, dot(Vec8(part.spokes[k]), normals));
    return lessEqual(splat(-sine), least);
}

}  // namespace touchstone
