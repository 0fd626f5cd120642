#include "haptics/sandbox/scene/mate_seat.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <utility>

namespace touchstone::sandbox {
namespace {

using engine::CadSurface;
using glm::dvec3;

constexpr double kFullTurn = 2 * std::numbers::pi;
constexpr double kParallelAxes = 1e-5;  // rad
constexpr double kLoosest = 0.1;        // of the radius: a wider hole is no fit
constexpr double kUsual = 0.02;         // of the radius: a clearance that halves a fit's weight
constexpr double kPressed = 0.005;      // of the radius: a shaft that is drawn thicker by more does not go in
constexpr double kThreadDepth = 0.7;    // of the pitch: of a thread that is drawn as a cylinder
constexpr double kLeadDigits = 0.005;   // of the lead
constexpr double kLeastEngaged = 0.05;  // of the shorter cylinder
constexpr double kSideGap = 0.05;       // of the radius: with a wider gap beside it, a key does not mate
constexpr double kSameTurn = 1e-4;      // rad
constexpr double kStopped = 1.2;        // times the weight: a tool that stops somewhere is more likely meant
constexpr double kLeadIn = 1.1;         // times the weight: the end of a hole that has a chamfer is more likely meant
constexpr double kAsGood = 0.99;        // of the weight: places that are equally good
constexpr std::size_t kMostCandidates = 50;  // pairs of axes that are tried

MateBand seen(MateBand band, bool flipped) {
    if (flipped) band.from = -std::exchange(band.to, -band.from);
    return band;
}

class MateSearch {
  public:
    MateSearch(std::span<const MatePart> tool, std::span<const MatePart> obstacles, const MateConstraints& given)
        : given_(given),
          tool_(mateFaces(tool)),
          obstacle_(mateFaces(obstacles)),
          toolAxes_(mateAxes(tool_)),
          obstacleAxes_(mateAxes(obstacle_)) {}

    std::optional<MateSeat> best() {
        if (std::optional<MateSeat> seat = bestOnAxes()) return seat;
        toolAxes_ = prismAxes(tool_);
        obstacleAxes_ = prismAxes(obstacle_);
        return bestOnAxes();
    }

  private:
    std::optional<MateSeat> bestOnAxes() const {
        if (std::optional<MateSeat> seat = asModeled()) return finished(*seat);
        if (given_.tool == MateConstraints::Tool::AtGoal) return {};
        std::optional<MateSeat> best;
        for (const Candidate& candidate : candidates())
            for (const bool down : {false, true})
                for (const bool turned : {false, true}) {
                    const MateAxis &tool = *candidate.tool, &obstacle = *candidate.obstacle;
                    const bool against = glm::dot(tool.direction, obstacle.direction) < 0;
                    if (given_.tool == MateConstraints::Tool::OnAxis && turned != (against != down)) continue;
                    if (std::optional<MateSeat> seat = slidIn(tool, turned, obstacle, down))
                        if (!best || better(*seat, *best)) best = seat;
                }
        if (!best) return {};
        return finished(*best);
    }

    static bool coaxial(const MateAxis& a, const MateAxis& b, double aside = kSamePlace) {
        return glm::length(glm::cross(a.direction, b.direction)) < kParallelAxes &&
               glm::length(glm::cross(a.point - b.point, b.direction)) < aside;
    }

    struct Candidate {
        const MateAxis *tool, *obstacle;
        double weight, away;
    };
    /// Axes with a shaft and a hole that fit, those with the longest and closest first, and of equal ones the nearest.
    std::vector<Candidate> candidates() const {
        std::vector<Candidate> found;
        for (const MateAxis& tool : toolAxes_)
            for (const MateAxis& obstacle : obstacleAxes_) {
                if (given_.tool == MateConstraints::Tool::OnAxis && !coaxial(tool, obstacle)) continue;
                double weight = 0;
                for (const MateBand& a : tool.bands)
                    for (const MateBand& b : obstacle.bands)
                        if (const MatePair pair{a, b}; pair.fits(given_.lead))
                            weight = std::max(weight, pair.weight(std::min(a.to - a.from, b.to - b.from)));
                if (weight > 0) found.push_back({&tool, &obstacle, weight, glm::length(tool.point - obstacle.point)});
            }
        std::ranges::stable_sort(found, [](const Candidate& a, const Candidate& b) {
            return std::lround(100 * std::log(a.weight)) != std::lround(100 * std::log(b.weight)) ? a.weight > b.weight
                                                                                                  : a.away < b.away;
        });
        if (found.size() > kMostCandidates) found.resize(kMostCandidates);
        return found;
    }

    MateSeat finished(MateSeat seat) const {
        seat.fold = symmetry(tool_, seat.tool, top(seat) - seat.travel);
        return seat;
    }

    bool allowed(const dvec3& out) const { return !given_.out || glm::length(out - *given_.out) < 1e-4; }

    static bool better(const MateSeat& a, const MateSeat& b) {
        if (a.weight < kAsGood * b.weight) return false;
        return a.weight * kAsGood > b.weight || a.moved < b.moved;
    }

    /// The frames of both axes, with the least turn between them.
    static MateSeat framed(const MateAxis& tool, bool turned, const MateAxis& obstacle, bool down) {
        MateSeat seat;
        seat.obstacle.point = obstacle.point;
        seat.obstacle.up = down ? -obstacle.direction : obstacle.direction;
        seat.tool.point = tool.point;
        seat.tool.up = turned ? -tool.direction : tool.direction;
        const dvec3 &from = seat.tool.up, &to = seat.obstacle.up;
        const dvec3 hinge = glm::cross(from, to);
        const auto aside = [](const dvec3& up) {
            const dvec3 least = std::abs(up.x) <= std::abs(up.y) && std::abs(up.x) <= std::abs(up.z) ? dvec3(1, 0, 0)
                                : std::abs(up.y) <= std::abs(up.z)                                   ? dvec3(0, 1, 0)
                                                                                                     : dvec3(0, 0, 1);
            return glm::normalize(glm::cross(glm::cross(up, least), up));
        };
        if (glm::length(hinge) < kParallelAxes) {
            seat.tool.first = aside(from);
            seat.obstacle.first = glm::normalize(seat.tool.first - glm::dot(seat.tool.first, to) * to);
        } else {
            seat.tool.first = seat.obstacle.first = glm::normalize(hinge);
        }
        return seat;
    }

    static std::vector<MatePair> pairs(const MateAxis& tool, bool turned, const MateAxis& obstacle, bool down) {
        std::vector<MatePair> all;
        for (const MateBand& a : tool.bands)
            for (const MateBand& b : obstacle.bands)
                if (a.hollow != b.hollow) all.push_back({seen(a, turned), seen(b, down)});
        return all;
    }

    /// Chooses the main pair and the weight at the seat's travel; false if a shaft would be in too narrow a hole, or
    /// none is in any.
    bool weigh(MateSeat& seat, const std::vector<MatePair>& all) const {
        double best = 0;
        for (const MatePair& pair : all) {
            const double length = pair.engaged(seat.travel);
            if (length <= kSamePlace) continue;
            if (!pair.fits(given_.lead)) {
                if (pair.clearance() < 0) return false;
                continue;
            }
            const double shorter = std::min(pair.tool.to - pair.tool.from, pair.obstacle.to - pair.obstacle.from);
            if (length < kLeastEngaged * shorter) continue;
            const double weight = pair.weight(length);
            seat.weight += weight;
            if (weight > best) {
                best = weight;
                seat.main = pair;
                seat.engaged = length;
            }
        }
        return best > 0;
    }

    /// Finds the least turn in which most of what lies beside the axis meets; with `keep` it stays as it is modeled.
    void findTurn(MateSeat& seat, double radius, bool keep) const {
        const std::vector<MateSide> tool = mateSides(tool_, seat.tool), obstacle = mateSides(obstacle_, seat.obstacle);
        const auto meet = [&](const MateSide& a, const MateSide& b) {
            if ((a.radius > 0) != (b.radius > 0)) return false;
            if (a.radius > 0) {
                const double room = a.hollow ? a.radius - b.radius : b.radius - a.radius;
                return a.hollow != b.hollow && room > -kSamePlace && room < kLoosest * a.radius &&
                       std::abs(a.distance - b.distance) < room + kSamePlace;
            }
            const double gap = -b.distance - a.distance;
            return gap > -kSamePlace && gap < kSideGap * radius;
        };
        const auto turnOf = [](const MateSide& a, const MateSide& b) {
            return std::remainder(b.angle - a.angle + (a.radius > 0 ? 0 : kFullTurn / 2), kFullTurn);
        };
        // All turns in which some side meets one of the obstacle, each once.
        std::vector<double> turns;
        for (const MateSide& a : tool)
            for (const MateSide& b : obstacle)
                if (meet(a, b)) turns.push_back(turnOf(a, b));
        std::ranges::sort(turns);
        const auto near = [](double a, double b) { return std::abs(std::remainder(a - b, kFullTurn)) < kSameTurn; };
        turns.erase(std::unique(turns.begin(), turns.end(), near), turns.end());
        if (turns.size() > 1 && near(turns.front(), turns.back())) turns.pop_back();
        // The area and number of sides that meet in each turn.
        std::vector<std::pair<double, std::size_t>> scores;
        for (const double turn : turns) {
            double score = 0;
            std::size_t count = 0;
            for (const MateSide& a : tool) {
                double area = 0;
                for (const MateSide& b : obstacle)
                    if (meet(a, b) && near(turnOf(a, b), turn)) area = std::max(area, std::min(a.area, b.area));
                score += area;
                count += area > 0;
            }
            scores.emplace_back(score, count);
        }
        // Among those that are as good as the best, the one nearest to how the tool is modeled.
        const auto top = std::ranges::max_element(scores);
        if (top == scores.end()) return;
        double least = 1e30;
        const double modeled = seat.turn;
        for (std::size_t i = 0; i < turns.size(); ++i) {
            const double away = std::abs(std::remainder(turns[i] - modeled, kFullTurn));
            if (scores[i].first < kAsGood * top->first || away >= least) continue;
            least = away;
            if (!keep) seat.turn = turns[i];
        }
        if (!keep || least < kSameTurn) seat.sides = top->second;
    }

    /// What the tool meets first on its way in; nothing if the shaft is thicker than the hole.
    std::optional<MateStop> findStop(const MateSeat& seat, const MatePair& pair) const {
        const std::vector<MateLevel> under = mateLevels(tool_, seat.tool, false);
        const std::vector<MateLevel> over = mateLevels(obstacle_, seat.obstacle, true);
        const bool ragged = pair.threads() || pair.clearance() < 0;
        const double inner = ragged ? std::min(pair.tool.inner, pair.obstacle.inner) : 0;
        const double outer = ragged ? std::max(pair.tool.radius, pair.obstacle.radius) : 0;
        struct Meeting {
            double travel;
            std::size_t tool, obstacle;
        };
        std::vector<Meeting> meetings;
        for (std::size_t i = 0; i < under.size(); ++i)
            for (std::size_t j = 0; j < over.size(); ++j) meetings.push_back({over[j].height - under[i].height, i, j});
        std::ranges::stable_sort(meetings, std::greater(), &Meeting::travel);
        std::optional<MateStop> stop;
        for (const Meeting& meeting : meetings)
            if (overlap(under[meeting.tool], over[meeting.obstacle], seat.turn, inner, outer)) {
                stop = MateStop{meeting.travel, false, over[meeting.obstacle].part,
                                under[meeting.tool].height < under.back().height + kSamePlace};
                break;
            }
        if (const std::optional<MateStop> cone = coneStop(seat);
            cone && (!stop || cone->travel > stop->travel + kSamePlace))
            stop = cone;
        return stop;
    }

    struct Cone {
        double apex, angle, low, high;
        std::size_t part;
    };
    /// Cones about the axis that widen upward.
    static std::vector<Cone> cones(std::span<const MateFace> faces, const MateFrame& frame, bool hollow) {
        std::vector<Cone> found;
        for (const MateFace& placed : faces) {
            const engine::CadFace& face = placed.face;
            if (face.surface != CadSurface::Cone || face.hollow != hollow ||
                glm::length(face.axis - frame.up) > kParallelAxes ||
                glm::length(frame.across(face.origin)) > kSamePlace)
                continue;
            Cone cone{frame.height(face.origin) - face.radius / std::tan(face.halfAngle), face.halfAngle, 1e30, 0,
                      placed.part};
            for (const dvec3& p : placed.points) {
                cone.low = std::min(cone.low, glm::length(frame.across(p)));
                cone.high = std::max(cone.high, glm::length(frame.across(p)));
            }
            found.push_back(cone);
        }
        return found;
    }
    /// Whether a chamfer leads into the hole.
    bool hasLeadIn(const MateSeat& seat) const {
        if (seat.main.tool.hollow) return false;
        return std::ranges::any_of(cones(obstacle_, seat.obstacle, true), [&](const Cone& cone) {
            return std::abs(cone.low - seat.main.obstacle.radius) < kSamePlace;
        });
    }
    std::optional<MateStop> coneStop(const MateSeat& seat) const {
        std::optional<MateStop> stop;
        const std::vector<Cone> seats = cones(obstacle_, seat.obstacle, true);
        for (const Cone& tool : cones(tool_, seat.tool, false))
            for (const Cone& other : seats) {
                const bool meets = std::abs(tool.angle - other.angle) < 1e-3 && tool.low < other.high - kSamePlace &&
                                   other.low < tool.high - kSamePlace;
                const double travel = other.apex - tool.apex;
                if (meets && (!stop || travel > stop->travel)) stop = MateStop{travel, true, other.part, false};
            }
        return stop;
    }

    std::optional<MateSeat> slidIn(const MateAxis& tool, bool turned, const MateAxis& obstacle, bool down) const {
        MateSeat seat = framed(tool, turned, obstacle, down);
        if (!allowed(seat.obstacle.up)) return {};
        const std::vector<MatePair> all = pairs(tool, turned, obstacle, down);
        const auto first = std::ranges::max_element(
            all, {}, [&](const MatePair& pair) { return pair.fits(given_.lead) ? pair.shaft().radius : 0.0; });
        if (first == all.end() || !first->fits(given_.lead)) return {};
        findTurn(seat, first->shaft().radius, given_.tool == MateConstraints::Tool::OnAxis);
        seat.stop = findStop(seat, *first);
        seat.travel = seat.stop ? seat.stop->travel : first->obstacle.from - first->tool.from;
        if (!weigh(seat, all)) return {};
        if (seat.stop) seat.weight *= kStopped;
        if (hasLeadIn(seat)) seat.weight *= kLeadIn;
        const engine::RigidPart pose = poseOf(seat);
        const double size = seat.main.shaft().radius;
        seat.moved = glm::length(pose.translation + pose.rotation * tool.point - tool.point) +
                     size * 2 * std::acos(std::min(1.0, std::abs(pose.rotation.w)));
        return seat;
    }

    /// The tool's own place, if it fits there.
    std::optional<MateSeat> asModeled() const {
        std::optional<MateSeat> best;
        for (const MateAxis& tool : toolAxes_)
            for (const MateAxis& obstacle : obstacleAxes_) {
                if (glm::length(glm::cross(tool.direction, obstacle.direction)) > kParallelAxes) continue;
                const bool against = glm::dot(tool.direction, obstacle.direction) < 0;
                for (const bool down : {false, true}) {
                    const bool turned = against != down;
                    MateSeat seat = framed(tool, turned, obstacle, down);
                    if (!allowed(seat.obstacle.up)) continue;
                    seat.modeled = true;
                    seat.travel = seat.obstacle.height(tool.point);
                    const std::vector<MatePair> all = pairs(tool, turned, obstacle, down);
                    if (!weigh(seat, all)) continue;
                    if (!coaxial(tool, obstacle, std::max(kSamePlace, seat.main.clearance()))) continue;
                    findTurn(seat, seat.main.shaft().radius, true);
                    seat.stop = findStop(seat, seat.main);
                    const bool blocked = seat.stop && seat.stop->travel > seat.travel + kSamePlace;
                    if (blocked) continue;
                    const bool meets = seat.stop && seat.stop->travel > seat.travel - kSamePlace;
                    if (meets) seat.weight *= kStopped;
                    seat.moved = wayOut(seat);
                    if (!best || better(seat, *best)) best = seat;
                }
            }
        return best;
    }

    /// How far the tool must move until its lowest point is above the obstacles.
    double wayOut(const MateSeat& seat) const {
        double low = 1e30;
        for (const MateFace& face : tool_)
            for (const dvec3& p : face.points) low = std::min(low, seat.tool.height(p) + seat.travel);
        return top(seat) - low;
    }
    double top(const MateSeat& seat) const {
        double highest = -1e30;
        for (const MateFace& face : obstacle_)
            for (const dvec3& p : face.points) highest = std::max(highest, seat.obstacle.height(p));
        return highest;
    }

    MateConstraints given_;
    std::vector<MateFace> tool_, obstacle_;
    std::vector<MateAxis> toolAxes_, obstacleAxes_;
};

}  // namespace

double MatePair::clearance() const {
    return threads() ? std::min(hole().radius - shaft().radius, hole().inner - shaft().inner)
                     : hole().inner - shaft().radius;
}

bool MatePair::fits(double lead) const {
    if (tool.hollow == obstacle.hollow) return false;
    const double radius = shaft().radius, pressed = kPressed * radius;
    if (threads())
        return std::abs(tool.lead - obstacle.lead) < kLeadDigits * std::abs(tool.lead) && clearance() > -pressed;
    return clearance() >= -std::max(pressed, kThreadDepth * std::abs(lead)) && clearance() <= kLoosest * radius;
}

double MatePair::weight(double length) const {
    const double loose = std::max(0.0, clearance()) / shaft().radius;
    return length * shaft().radius / (1 + loose / kUsual);
}

double MatePair::engaged(double travel) const {
    return std::min(tool.to + travel, obstacle.to) - std::max(tool.from + travel, obstacle.from);
}

engine::RigidPart poseOf(const MateSeat& seat) {
    const auto basis = [](const MateFrame& frame) {
        return glm::dmat3(frame.first, glm::cross(frame.up, frame.first), frame.up);
    };
    const double c = std::cos(seat.turn), s = std::sin(seat.turn);
    const glm::dmat3 turn(dvec3(c, s, 0), dvec3(-s, c, 0), dvec3(0, 0, 1));
    const glm::dmat3 rotation = basis(seat.obstacle) * turn * glm::transpose(basis(seat.tool));
    engine::RigidPart pose;
    pose.rotation = glm::normalize(glm::quat_cast(rotation));
    pose.translation = seat.obstacle.point + seat.travel * seat.obstacle.up - pose.rotation * seat.tool.point;
    return pose;
}

std::optional<MateSeat> findSeat(std::span<const MatePart> tool, std::span<const MatePart> obstacles,
                                 const MateConstraints& given) {
    return MateSearch(tool, obstacles, given).best();
}

}  // namespace touchstone::sandbox
