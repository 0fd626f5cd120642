#include "haptics/sandbox/scene/mate_faces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace touchstone::sandbox {
namespace {

using engine::CadSurface;
using glm::dvec2;
using glm::dvec3;

constexpr double kBetweenAxes =
    1e-5;  // rad: axes of one file that differ by less are parallel; files have 6 digits or more
constexpr double kBesideAxis = 1e-6;   // m: the same for places
constexpr double kAroundAxis = 0.3;    // of a whole cylinder: a rounded edge has a quarter
constexpr double kSameThread = 0.005;  // of the lead: fitted to a free-form surface
constexpr double kCommonArea = 0.01;   // of the smaller plane: above what the chords of close edges cover
constexpr double kSameSpot = 0.01;     // of area and reach: that of faces that are the same but for their triangles
constexpr double kLeastCorner = 0.5;   // sine of the angle between the sides of a prism
constexpr std::size_t kMostSides = 64;

/// Widens a band by another on the same axis.
void join(MateBand& band, const MateBand& other) {
    band.from = std::min(band.from, other.from);
    band.to = std::max(band.to, other.to);
    band.radius = std::max(band.radius, other.radius);
    band.inner = std::min(band.inner, other.inner);
    band.area += other.area;
}

bool apart(const MateBand& a, const MateBand& b) { return a.from > b.to + kBesideAxis || b.from > a.to + kBesideAxis; }

/// Pieces of the same cylinder or thread.
bool sameBand(const MateBand& a, const MateBand& b) {
    if (a.part != b.part || a.hollow != b.hollow || apart(a, b)) return false;
    if (a.lead != 0 && b.lead != 0) return std::abs(a.lead - b.lead) < kSameThread * std::abs(a.lead);
    // Crests and roots of a thread are cylinders.
    const bool within = std::min(a.radius, b.radius) > std::max(a.inner, b.inner) - kBesideAxis;
    return a.lead != 0 || b.lead != 0 ? within : std::abs(a.radius - b.radius) < kBesideAxis;
}

void joinBands(std::vector<MateBand>& bands) {
    std::ranges::stable_sort(bands, {}, [](const MateBand& band) { return band.lead == 0; });  // threads first
    for (bool changed = true; changed;) {
        changed = false;
        for (std::size_t i = 0; i < bands.size(); ++i)
            for (std::size_t j = bands.size(); --j > i;)
                if (sameBand(bands[i], bands[j])) {
                    join(bands[i], bands[j]);
                    bands.erase(bands.begin() + std::ptrdiff_t(j));
                    changed = true;
                }
    }
    std::erase_if(bands, [](const MateBand& band) {
        const double whole = 2 * std::numbers::pi * band.radius * (band.to - band.from);
        return band.lead == 0 && band.area < kAroundAxis * whole;
    });
}

double cross(const dvec2& a, const dvec2& b) { return a.x * b.y - a.y * b.x; }

using Outline = std::array<dvec2, 9>;  // a triangle cut by three lines has at most six corners

/// Area of what two counterclockwise triangles cover together.
double commonArea(const dvec2* a, const dvec2* b) {
    Outline shape{a[0], a[1], a[2]}, cut;
    std::size_t count = 3;
    for (int k = 0; k < 3 && count > 0; ++k) {
        const dvec2 &p = b[k], along = b[(k + 1) % 3] - p;
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const dvec2 &from = shape[i], &to = shape[(i + 1) % count];
            const double s = cross(along, from - p), t = cross(along, to - p);
            if (s >= 0) cut[kept++] = from;
            if ((s < 0) != (t < 0)) cut[kept++] = from + (to - from) * (s / (s - t));
        }
        std::swap(shape, cut);
        count = kept;
    }
    double area = 0;
    for (std::size_t i = 2; i < count; ++i) area += cross(shape[i - 1] - shape[0], shape[i] - shape[0]) / 2;
    return area;
}

double areaOf(const std::vector<dvec2>& corners) {
    double area = 0;
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
        area += std::abs(cross(corners[i + 1] - corners[i], corners[i + 2] - corners[i])) / 2;
    return area;
}

/// Whether a point lies in the plane's face.
bool covers(const MateLevel& level, const dvec2& p) {
    for (std::size_t i = 0; i + 2 < level.corners.size(); i += 3) {
        const dvec2* t = &level.corners[i];
        if (cross(t[1] - t[0], p - t[0]) >= 0 && cross(t[2] - t[1], p - t[1]) >= 0 && cross(t[0] - t[2], p - t[2]) >= 0)
            return true;
    }
    return false;
}

/// Whether a face is the same in any turn about the axis, but for its outline.
bool isRound(const engine::CadFace& face, const MateFrame& frame) {
    const bool onAxis = glm::length(frame.across(face.origin)) < kBesideAxis;
    if (face.surface == CadSurface::Sphere) return onAxis;
    if (face.surface == CadSurface::Other) return false;
    const bool along = glm::length(glm::cross(face.axis, frame.up)) < kBetweenAxes;
    return along && (onAxis || face.surface == CadSurface::Plane);
}

/// Where a face begins and ends along a direction.
dvec2 extent(const MateFace& face, const dvec3& along) {
    dvec2 range(1e30, -1e30);
    for (const dvec3& p : face.points) {
        const double at = glm::dot(p, along);
        range = {std::min(range.x, at), std::max(range.y, at)};
    }
    return range;
}
bool meet(const dvec2& a, const dvec2& b) { return a.x < b.y - kBesideAxis && b.x < a.y - kBesideAxis; }

/// Tests circles inside and outside the thread.
bool overlapBeside(const MateLevel& a, const MateLevel& b, double turn, double inner, double outer) {
    constexpr int kSamples = 48;
    for (const double radius : {0.3 * inner, 0.6 * inner, 0.9 * inner, 1.03 * outer, 1.1 * outer, 1.25 * outer})
        for (int i = 0; i < kSamples; ++i) {
            const double angle = 2 * std::numbers::pi * (i + 0.5) / kSamples;
            const auto at = [&](double w) { return radius * dvec2(std::cos(w), std::sin(w)); };
            if (covers(a, at(angle - turn)) && covers(b, at(angle))) return true;
        }
    return false;
}

}  // namespace

std::vector<MateFace> mateFaces(std::span<const MatePart> parts) {
    std::vector<MateFace> faces;
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const engine::CadShape& shape = *parts[k].shape;
        const glm::dmat4& placement = parts[k].placement;
        const bool mirrored = glm::determinant(glm::dmat3(placement)) < 0;
        std::size_t next = 0;
        for (const engine::CadFace& face : shape.faces) {
            MateFace& placed = faces.emplace_back(MateFace{face, k, {}});
            placed.face.origin = dvec3(placement * glm::dvec4(face.origin, 1));
            placed.face.axis = dvec3(placement * glm::dvec4(face.axis, 0));
            if (mirrored) placed.face.lead = -face.lead;
            for (std::size_t i = 0; i < face.triangles && next < shape.triangles.size(); ++i, ++next) {
                std::array<std::uint32_t, 3> corners = shape.triangles[next];
                if (mirrored) std::swap(corners[1], corners[2]);
                for (const std::uint32_t corner : corners)
                    placed.points.emplace_back(placement * glm::dvec4(shape.vertices[corner], 1));
            }
        }
    }
    return faces;
}

std::vector<MateAxis> mateAxes(std::span<const MateFace> faces) {
    std::vector<MateAxis> axes;
    for (const MateFace& placed : faces) {
        const engine::CadFace& face = placed.face;
        const bool thread = face.surface == CadSurface::Helicoid;
        if (face.surface != CadSurface::Cylinder && !thread) continue;
        // Faces on one line share an axis.
        const auto same = std::ranges::find_if(axes, [&](const MateAxis& axis) {
            const dvec3 aside = glm::cross(face.origin - axis.point, axis.direction);
            return glm::length(glm::cross(face.axis, axis.direction)) < kBetweenAxes &&
                   glm::length(aside) < kBesideAxis;
        });
        MateAxis& axis = same != axes.end() ? *same : axes.emplace_back(MateAxis{face.origin, face.axis, {}});
        const bool against = glm::dot(face.axis, axis.direction) < 0;
        const double base = glm::dot(face.origin - axis.point, axis.direction);
        MateBand band{.hollow = face.hollow,
                      .radius = face.radius,
                      .inner = face.radius,
                      .from = base + (against ? -face.to : face.from),
                      .to = base + (against ? -face.from : face.to),
                      .lead = thread ? face.lead : 0,
                      .area = face.area,
                      .part = placed.part};
        // A thread reaches from its root to its crest.
        if (thread) {
            band.radius = 0;
            band.inner = 1e30;
            for (const dvec3& p : placed.points) {
                const double r = glm::length(glm::cross(p - axis.point, axis.direction));
                band.radius = std::max(band.radius, r);
                band.inner = std::min(band.inner, r);
            }
        }
        axis.bands.push_back(band);
    }
    for (MateAxis& axis : axes) joinBands(axis.bands);
    std::erase_if(axes, [](const MateAxis& axis) { return axis.bands.empty(); });
    return axes;
}

std::vector<MateAxis> prismAxes(std::span<const MateFace> faces) {
    /// Two parallel planes that bound a common part of space.
    struct Slab {
        const MateFace *first, *second;
        double width;
    };
    std::vector<Slab> slabs[2];  // of shafts, and of holes
    // Pairs of antiparallel planes of a part: facing each other (a hole) or back to back (a shaft).
    for (std::size_t i = 0; i < faces.size(); ++i)
        for (std::size_t j = i + 1; j < faces.size(); ++j) {
            const engine::CadFace &a = faces[i].face, &b = faces[j].face;
            if (a.surface != CadSurface::Plane || b.surface != CadSurface::Plane || faces[i].part != faces[j].part ||
                glm::length(a.axis + b.axis) > kBetweenAxes)
                continue;
            const double width = glm::dot(b.origin - a.origin, a.axis);
            const dvec3 along =
                glm::normalize(glm::cross(a.axis, std::abs(a.axis.x) < 0.7 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
            const bool beside =
                meet(extent(faces[i], along), extent(faces[j], along)) &&
                meet(extent(faces[i], glm::cross(a.axis, along)), extent(faces[j], glm::cross(a.axis, along)));
            if (std::abs(width) > kBesideAxis && beside) slabs[width > 0].push_back({&faces[i], &faces[j], width});
        }
    // Two slabs that are not parallel make a prism; its axis is where their middle planes meet.
    std::vector<MateAxis> axes;
    for (std::vector<Slab>& found : slabs) {
        std::ranges::stable_sort(found, {}, [](const Slab& slab) { return std::abs(slab.width); });
        if (found.size() > kMostSides) found.resize(kMostSides);
        for (std::size_t i = 0; i < found.size(); ++i)
            for (std::size_t j = i + 1; j < found.size(); ++j) {
                const Slab &a = found[i], &b = found[j];
                const dvec3 &n = a.first->face.axis, &m = b.first->face.axis, axis = glm::cross(n, m);
                if (a.first->part != b.first->part || glm::length(axis) < kLeastCorner) continue;
                const double s = glm::dot(a.first->face.origin, n) + a.width / 2;
                const double t = glm::dot(b.first->face.origin, m) + b.width / 2;
                const double c = glm::dot(n, m), sin2 = 1 - c * c;
                MateAxis made{((s - c * t) * n + (t - c * s) * m) / sin2, glm::normalize(axis), {}};
                MateBand band{.hollow = a.width > 0,
                              .radius = std::abs(a.width) / 2,
                              .inner = std::abs(a.width) / 2,
                              .from = -1e30,
                              .to = 1e30,
                              .part = a.first->part,
                              .flat = true};
                // The prism is as long as all four sides.
                for (const MateFace* side : {a.first, a.second, b.first, b.second}) {
                    const dvec2 range = extent(*side, made.direction) - glm::dot(made.point, made.direction);
                    band.from = std::max(band.from, range.x);
                    band.to = std::min(band.to, range.y);
                }
                if (band.to - band.from < kBesideAxis) continue;
                made.point += band.from * made.direction;
                band.to -= band.from;
                band.from = 0;
                made.bands.push_back(band);
                axes.push_back(made);
            }
    }
    return axes;
}

dvec2 MateFrame::across(const dvec3& p) const {
    return {glm::dot(p - point, first), glm::dot(p - point, glm::cross(up, first))};
}

std::vector<MateLevel> mateLevels(std::span<const MateFace> faces, const MateFrame& frame, bool lookUp) {
    std::vector<MateLevel> levels;
    const dvec3 normal = lookUp ? frame.up : -frame.up;
    for (const MateFace& placed : faces) {
        const engine::CadFace& face = placed.face;
        if (face.surface != CadSurface::Plane || placed.points.empty() || glm::dot(face.axis, normal) < 0 ||
            glm::length(glm::cross(face.axis, normal)) > kBetweenAxes)
            continue;
        MateLevel& level = levels.emplace_back();
        level.height = frame.height(face.origin);
        level.part = placed.part;
        for (const dvec3& p : placed.points) level.corners.push_back(frame.across(p));
        for (std::size_t i = 0; i + 2 < level.corners.size(); i += 3) {
            dvec2* t = &level.corners[i];
            if (cross(t[1] - t[0], t[2] - t[0]) < 0) std::swap(t[1], t[2]);
        }
        for (const dvec2& corner : level.corners) level.outer = std::max(level.outer, glm::length(corner));
    }
    std::ranges::stable_sort(levels, std::greater(), &MateLevel::height);
    return levels;
}

bool overlap(const MateLevel& a, const MateLevel& b, double turn, double inner, double outer) {
    if (outer > 0) return overlapBeside(a, b, turn, inner, outer);
    const double enough = kCommonArea * std::min(areaOf(a.corners), areaOf(b.corners));
    std::vector<dvec2> turned = a.corners;
    for (dvec2& p : turned)
        p = {std::cos(turn) * p.x - std::sin(turn) * p.y, std::sin(turn) * p.x + std::cos(turn) * p.y};
    double common = 0;
    for (std::size_t i = 0; i + 2 < turned.size(); i += 3) {
        const dvec2* s = &turned[i];
        const dvec2 low = glm::min(glm::min(s[0], s[1]), s[2]), high = glm::max(glm::max(s[0], s[1]), s[2]);
        for (std::size_t j = 0; j + 2 < b.corners.size(); j += 3) {
            const dvec2* t = &b.corners[j];
            const dvec2 lowT = glm::min(glm::min(t[0], t[1]), t[2]), highT = glm::max(glm::max(t[0], t[1]), t[2]);
            if (lowT.x > high.x || lowT.y > high.y || highT.x < low.x || highT.y < low.y) continue;
            common += commonArea(s, t);
            if (common > enough) return true;
        }
    }
    return false;
}

std::vector<MateSide> mateSides(std::span<const MateFace> faces, const MateFrame& frame) {
    std::vector<MateSide> sides;
    for (const MateFace& placed : faces) {
        const engine::CadFace& face = placed.face;
        const bool plane = face.surface == CadSurface::Plane;
        if (!plane && face.surface != CadSurface::Cylinder) continue;
        const double lean =
            plane ? std::abs(glm::dot(face.axis, frame.up)) : glm::length(glm::cross(face.axis, frame.up));
        if (lean > kBetweenAxes) continue;
        const dvec2 place = frame.across(face.origin), normal = frame.across(frame.point + face.axis);
        if (!plane && glm::length(place) < kBesideAxis) continue;  // about the axis itself
        MateSide side{.hollow = face.hollow, .from = 1e30, .to = -1e30, .area = face.area};
        side.angle = plane ? std::atan2(normal.y, normal.x) : std::atan2(place.y, place.x);
        side.distance = plane ? glm::dot(place, normal) : glm::length(place);
        side.radius = plane ? 0 : face.radius;
        for (const dvec3& p : placed.points) {
            side.from = std::min(side.from, frame.height(p));
            side.to = std::max(side.to, frame.height(p));
        }
        sides.push_back(side);
    }
    std::ranges::stable_sort(sides, std::greater(), &MateSide::area);
    if (sides.size() > kMostSides) sides.resize(kMostSides);
    return sides;
}

int symmetry(std::span<const MateFace> faces, const MateFrame& frame, double top) {
    struct Spot {
        dvec2 place;
        double height, area;
    };
    // Each face that is not round about the axis and reaches below the top becomes its centroid and area.
    std::vector<Spot> spots;
    double reach = 0;
    for (const MateFace& placed : faces) {
        if (placed.points.empty() || isRound(placed.face, frame)) continue;
        double low = 1e30, whole = 0;
        dvec3 middle(0);
        for (std::size_t i = 0; i + 2 < placed.points.size(); i += 3) {
            const dvec3* t = &placed.points[i];
            const double area = glm::length(glm::cross(t[1] - t[0], t[2] - t[0])) / 2;
            middle += area / 3 * (t[0] + t[1] + t[2]);
            whole += area;
            for (int k = 0; k < 3; ++k) low = std::min(low, frame.height(t[k]));
        }
        if (low > top - kBesideAxis || !(whole > 0)) continue;
        middle /= whole;
        spots.push_back({frame.across(middle), frame.height(middle), whole});
        reach = std::max(reach, glm::length(spots.back().place));
    }
    // The greatest fold that maps all centroids to others of the same area.
    const double near = kSameSpot * reach;
    const auto matches = [&](int fold) {
        const double c = std::cos(2 * std::numbers::pi / fold), s = std::sin(2 * std::numbers::pi / fold);
        return std::ranges::all_of(spots, [&](const Spot& a) {
            const dvec2 place(c * a.place.x - s * a.place.y, s * a.place.x + c * a.place.y);
            return std::ranges::any_of(spots, [&](const Spot& b) {
                return glm::length(b.place - place) < near && std::abs(b.height - a.height) < near &&
                       std::abs(b.area - a.area) < kSameSpot * a.area;
            });
        });
    };
    if (spots.empty()) return 0;
    for (int fold = int(spots.size()); fold > 1; --fold)
        if (matches(fold)) return fold;
    return 1;
}

}  // namespace touchstone::sandbox
