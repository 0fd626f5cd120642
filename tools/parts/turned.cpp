#include "tools/parts/turned.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

#include "tools/parts/angles.hpp"
#include "tools/parts/shapes.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::app {
namespace {

constexpr double kSame = 1e-9;

int pieces(double length, double step) { return std::max(1, static_cast<int>(std::ceil(length / step - kSame))); }

/// Places along one axis: the limits of the blocks, and intermediate places so that gaps stay small.
struct Axis {
    std::vector<double> limits, places;
    std::vector<int> cell;  // the cell between two limits that each piece between two places belongs to

    Axis(std::vector<double> values, double spacing) : limits(std::move(values)) {
        std::ranges::sort(limits);
        const auto same = [](double a, double b) { return b - a < kSame; };
        limits.erase(std::unique(limits.begin(), limits.end(), same), limits.end());
        for (std::size_t i = 0; i + 1 < limits.size(); ++i) {
            const int n = pieces(limits[i + 1] - limits[i], spacing);
            for (int k = 0; k < n; ++k) {
                places.push_back(limits[i] + (limits[i + 1] - limits[i]) * k / n);
                cell.push_back(static_cast<int>(i));
            }
        }
        places.push_back(limits.back());
    }

    int index(double value) const {
        return static_cast<int>(std::ranges::lower_bound(limits, value - kSame) - limits.begin());
    }
};

/// The flanks in their order around the axis, and planes between them.
struct Round {
    struct Line {
        Flank flank;
        double inner;  // smallest radius at which a block uses it
        double at(double r) const { return flank.angle + std::asin(flank.offset / std::max(r, inner)); }
    };
    double outer;
    std::vector<Line> lines;
    std::vector<std::pair<int, double>> places;  // a line, and the fraction of the way to the next one

    explicit Round(double outerRadius) : outer(outerRadius) {}

    double order(const Flank& flank) const {
        const double angle = std::fmod(flank.angle + std::asin(flank.offset / outer), kTau);
        return angle < -kSame ? angle + kTau : angle;
    }
    int index(const Flank& flank) const {
        const auto same = [&](const Line& line) {
            return line.flank.offset == flank.offset && std::abs(order(line.flank) - order(flank)) < kSame;
        };
        return static_cast<int>(std::ranges::find_if(lines, same) - lines.begin());
    }
    void take(const Flank& flank, double inner) {
        if (inner <= std::abs(flank.offset))
            throw std::invalid_argument("a flank stands further off the axis than its block's inner radius");
        const auto known = static_cast<std::size_t>(index(flank));
        if (known == lines.size()) lines.push_back({flank, inner});
        lines[known].inner = std::min(lines[known].inner, inner);
    }
    /// Near the axis a sector with parallel flanks spans a larger angle: the radius that needs the most pieces decides.
    void divide(std::span<const double> radii, double spacing) {
        if (lines.empty()) lines.push_back({{0}, 1});
        for (Line& line : lines) line.flank.angle = order(line.flank) - std::asin(line.flank.offset / outer);
        std::ranges::sort(lines, {}, [&](const Line& line) { return order(line.flank); });
        for (int i = 0; i < static_cast<int>(lines.size()); ++i) {
            int n = 1;
            for (const double r : radii) {
                const double step = std::min(2 * std::acos(1 - std::min(1.0, kChordError / r)), spacing / r);
                if (r > 0) n = std::max(n, pieces(next(i, r) - lines[i].at(r), step));
            }
            for (int k = 0; k < n; ++k) places.emplace_back(i, double(k) / n);
        }
    }
    double next(int line, double r) const {
        const bool last = line + 1 == static_cast<int>(lines.size());
        return lines[last ? 0 : line + 1].at(r) + (last ? kTau : 0);
    }
    double angle(int place, double r) const {
        const auto [line, share] = places[place % places.size()];
        return std::lerp(lines[line].at(r), next(line, r), share);
    }
};

}  // namespace

engine::MeshData TurnedSolid::mesh(double spacing) const {
    // A grid of cells in cylindrical coordinates that follows all limits of the blocks.
    std::vector<double> radii, heights;
    for (const auto& [block, added] : steps_) {
        radii.insert(radii.end(), {block.inner, block.outer});
        heights.insert(heights.end(), {block.low, block.high});
    }
    const Axis r(radii, spacing), y(heights, spacing);
    const double outer = r.limits.back();
    Round round(outer);
    const auto whole = [](const TurnedBlock& b) { return b.from.angle == b.to.angle && b.from.offset == b.to.offset; };
    for (const auto& [block, added] : steps_)
        if (!whole(block)) round.take(block.from, block.inner), round.take(block.to, block.inner);
    round.divide(r.limits, spacing);

    // Blocks fill or empty cells, in their order.
    const int rings = static_cast<int>(r.limits.size()) - 1, layers = static_cast<int>(y.limits.size()) - 1;
    const int sectors = static_cast<int>(round.lines.size());
    std::vector<char> full(static_cast<std::size_t>(rings * sectors * layers), 0);
    const auto cell = [&](int ring, int sector, int layer) -> char& {
        return full[static_cast<std::size_t>((ring * sectors + sector) * layers + layer)];
    };
    for (const auto& [block, added] : steps_) {
        const int first = whole(block) ? 0 : round.index(block.from);
        const int last = whole(block) ? sectors : round.index(block.to);
        for (int ring = r.index(block.inner); ring < r.index(block.outer); ++ring)
            for (int layer = y.index(block.low); layer < y.index(block.high); ++layer)
                for (int s = first; s < (last > first ? last : last + sectors); ++s)
                    cell(ring, s % sectors, layer) = added;
    }

    // The places of the grid, finer than its cells.
    const glm::ivec3 count(r.cell.size(), round.places.size(), y.cell.size());
    const auto filled = [&](glm::ivec3 at) {
        if (at.x < 0 || at.x >= count.x || at.z < 0 || at.z >= count.z) return false;
        const int place = (at.y + count.y) % count.y;
        return cell(r.cell[at.x], round.places[place].first, y.cell[at.z]) != 0;
    };
    const auto point = [&](glm::ivec3 at) {
        const double radius = r.places[at.x], angle = round.angle(at.y, radius);
        return glm::dvec3(radius * std::cos(angle), y.places[at.z], -radius * std::sin(angle));
    };
    for (const double radius : r.places)
        for (int place = 0; place < count.y; ++place)
            if (radius > 0 && round.angle(place, radius) >= round.next(round.places[place].first, radius))
                throw std::invalid_argument("flanks cross; make what lies between them narrower or fewer");

    // A face wherever a full cell borders an empty one.
    Solid solid;
    for (glm::ivec3 at(0); at.x < count.x; ++at.x)
        for (at.y = 0; at.y < count.y; ++at.y)
            for (at.z = 0; at.z < count.z; ++at.z) {
                if (!filled(at)) continue;
                for (int axis = 0; axis < 3; ++axis)
                    for (const int side : {0, 1}) {
                        glm::ivec3 out(0), u(0), v(0);
                        out[axis] = 1, u[(axis + 1) % 3] = 1, v[(axis + 2) % 3] = 1;
                        if (filled(side ? at + out : at - out)) continue;
                        if (!side) std::swap(u, v);
                        const glm::ivec3 from = side ? at + out : at;
                        const glm::dvec3 a = point(from), c = point(from + u + v);
                        solid.add(a, point(from + u), c);
                        solid.add(a, c, point(from + v));
                    }
            }
    return finished(solid);
}

}  // namespace touchstone::app
