#include "haptics/builder/wall_crossings.hpp"

#include "haptics/builder/box_search.hpp"

namespace touchstone {
namespace {

constexpr int kMaxNeighbors = 100;  // maximum number of neighbors that are tested for one face

/// Squared distance of the segments p + s d and q + t e, s and t in [0, 1].
/// Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.9.
double squaredDistance(const Vec3& p, const Vec3& d, const Vec3& q, const Vec3& e) {
    const Vec3 r = p - q;
    const double dd = d.squaredNorm(), ee = e.squaredNorm(), de = d.dot(e), dr = d.dot(r), er = e.dot(r);
    const auto clamped = [](double numerator, double denominator) {
        return denominator > 0 ? std::clamp(numerator / denominator, 0.0, 1.0) : 0.0;
    };
    double s = clamped(de * er - dr * ee, dd * ee - de * de);
    const double t = clamped(de * s + er, ee);
    s = clamped(de * t - dr, dd);
    return (r + s * d - t * e).squaredNorm();
}

/// Whether the segment comes within kTouching of the triangle: it passes through it, or it is near at an end or at a
/// side.
bool touches(const Vec3& p, const Vec3& q, const Triangle& t) {
    const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]);
    const double slack = kTouching * n.norm();
    const double sp = n.dot(p - t[0]), sq = n.dot(q - t[0]);
    if ((sp > slack && sq > slack) || (sp < -slack && sq < -slack)) return false;
    const Vec3 lo = t[0].cwiseMin(t[1]).cwiseMin(t[2]), hi = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    if ((p.cwiseMin(q).array() > hi.array() + kTouching).any() ||
        (p.cwiseMax(q).array() < lo.array() - kTouching).any())
        return false;
    const auto near = [&](const Vec3& x) { return (closestPoint(x, t, !isUsable(t)) - x).norm() <= kTouching; };
    if ((sp < 0) != (sq < 0) && near(p + sp / (sp - sq) * (q - p))) return true;
    for (int k = 0; k < 3; ++k)
        if (squaredDistance(p, q - p, t[k], t[(k + 1) % 3] - t[k]) <= kTouching * kTouching) return true;
    return near(p) || near(q);
}

/// Result of testing a face against the others.
enum class Finding : char {
    Unknown,  // not tested yet
    Clear,    // no other face crosses it
    Crossed,  // another face may cross it
    Crowded,  // too many neighbors to decide
};

class Crossings {
  public:
    Crossings(const std::vector<Vec3>& vertices, const std::vector<Corners>& faces, Pulse& pulse)
        : vertices_(vertices), faces_(faces), pulse_(pulse), findings_(faces.size(), Finding::Unknown) {
        std::vector<int> some(faces.size());
        std::iota(some.begin(), some.end(), 0);
        // A crowded face, such as one of a fan around a vertex, may be decided from the tests of its neighbors. The
        // faces that remain crowded are then tested only against each other, as long as that halves their number.
        for (std::size_t before = 2 * some.size() + 1; 2 * some.size() < before;) {
            before = some.size();
            test(some);
            std::erase_if(some, [&](int f) { return findings_[f] != Finding::Crowded; });
        }
    }

    bool clear(std::size_t face) const { return findings_[face] == Finding::Clear; }

  private:
    Triangle triangle(const Corners& c) const { return {vertices_[c[0]], vertices_[c[1]], vertices_[c[2]]}; }

    // Tests each face of `some` against the others in `some`, at a bounded cost.
    void test(const std::vector<int>& some) {
        std::vector<Box> boxes(some.size());
        for (std::size_t i = 0; i < some.size(); ++i)
            for (const Vec3& v : triangle(faces_[some[i]])) boxes[i].add(v);
        const BoxTree tree(boxes);
        boxes = inOrder(tree.order(), boxes);
        std::vector<Corners> faces;
        faces.reserve(some.size());
        for (const int i : tree.order()) faces.push_back(faces_[some[i]]);
        std::vector<Finding> found(some.size(), Finding::Unknown);
        for (int f = 0; f < static_cast<int>(faces.size()); ++f) {
            pulse_();
            if (found[f] == Finding::Crossed) continue;
            Box around = boxes[f];
            around.lo.array() -= kTouching;
            around.hi.array() += kTouching;
            int tests = 0;
            found[f] = Finding::Clear;
            anyMeeting(tree, boxes, around, [&](int other) {
                if (other == f || found[other] == Finding::Clear) return false;
                if (++tests > kMaxNeighbors) {
                    found[f] = Finding::Crowded;
                    return true;
                }
                if (!mayCross(faces[f], faces[other])) return false;
                found[f] = found[other] = Finding::Crossed;
                return true;
            });
        }
        for (std::size_t i = 0; i < some.size(); ++i) findings_[some[tree.order()[i]]] = found[i];
    }

    bool mayCross(const Corners& a, const Corners& b) const {
        const auto has = [](const Corners& c, int v) { return v == c[0] || v == c[1] || v == c[2]; };
        const auto pierces = [&](const Corners& s, const Corners& t) {
            for (int k = 0; k < 3; ++k) {
                const int p = s[k], q = s[(k + 1) % 3];
                if (!has(t, p) && !has(t, q) && touches(vertices_[p], vertices_[q], triangle(t))) return true;
            }
            return false;
        };
        return pierces(a, b) || pierces(b, a);
    }

    const std::vector<Vec3>& vertices_;
    const std::vector<Corners>& faces_;
    Pulse& pulse_;
    std::vector<Finding> findings_;
};

}  // namespace

std::vector<char> crossedFaces(const std::vector<Vec3>& vertices, const std::vector<Corners>& faces, Pulse& pulse) {
    const Crossings crossings(vertices, faces, pulse);
    std::vector<char> out(faces.size());
    for (std::size_t f = 0; f < faces.size(); ++f) out[f] = !crossings.clear(f);
    return out;
}

}  // namespace touchstone
