// What the searches of a tick may take, whatever the parts and however the device jumps.
#include <catch2/catch.hpp>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/loop/work_limits.hpp"
#include "tests/support/exact_judge.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/random.hpp"

namespace touchstone::search_budget_tests {

using namespace touchstone::test;

namespace {

constexpr double kTau = 2 * std::numbers::pi;

/// A shaft and a sleeve about z whose walls run in waves: as a thread, as teeth or straight.
struct Fit {
    const char* name;
    double wave;        ///< height of a wave above the mean radius of 8 mm
    int around, along;  ///< number of waves around the axis, and of turns along 16 mm
    std::uint32_t sides, rows;

    double radius(double angle, double z) const { return 8 + wave * std::cos(around * angle - kTau * along * z / 16); }
    TriangleMesh shaft() const {
        return lathe(sides, rows, -15, 15, [this](double a, double t) {
            const double z = 28 * t - 14, r = radius(a, z);
            return Vec3(r * std::cos(a), r * std::sin(a), z);
        });
    }
    /// 8 mm high, 0.4 mm around the shaft.
    TriangleMesh sleeve() const {
        return closedGrid(sides, rows, [this](double u, double v) {
            const double a = kTau * u, share = std::min(v / 0.75, 1.0), z = 8 * (v < 0.75 ? share : 4 - 4 * v) - 4;
            const double r = v < 0.75 ? radius(a, z) + 0.4 : 14;
            return Vec3(r * std::cos(a), r * std::sin(a), z);
        });
    }
};

std::shared_ptr<const SphereTree> spheresOn(const TriangleMesh& mesh, float radius) {
    std::vector<Sphere> spheres;
    for (const Vec3& p : mesh.vertices) spheres.push_back({float(p.x()), float(p.y()), float(p.z()), radius});
    return treeOf(std::move(spheres));
}

struct Parts {
    const char* name;
    TriangleMesh tool, obstacle;
};

std::vector<Parts> partsToJump() {
    std::vector<Parts> parts;
    for (const Fit& fit : {Fit{"nut on a thread", 0.8, 1, 8, 96, 120}, Fit{"gear in a ring", 1.2, 16, 0, 192, 48},
                           Fit{"sleeve on a peg", 0, 0, 0, 180, 40}})
        parts.push_back({fit.name, fit.sleeve(), fit.shaft()});
    parts.push_back({"dense ball on a dense ring", sphereMesh(6, 120, 80), torusMesh(12, 5, 160, 90)});
    return parts;
}

/// The parts' world and its judges, for many motions.
struct Table {
    explicit Table(const Parts& parts)
        : name(parts.name),
          world(withMeshes(worldOf(spheresOn(parts.tool, 0.2F), spheresOn(parts.obstacle, 0.2F), at(0, 0, 40)),
                           parts.tool, parts.obstacle)),
          judge(parts.tool, parts.obstacle) {}

    const char* name;
    World world;
    ExactJudge judge;
};

/// Steps, and checks what holds in every tick.
class Stepper {
  public:
    Stepper(const Table& table, Geometry geometry, const Pose& start)
        : table_(table), settings_(settingsFor(geometry)), state_(table.world) {
        state_.reset(start);
    }

    /// `judged`: whether the judges look at the answer.
    TickRecord step(const Pose& device, bool judged) {
        const TickRecord record = touchstone::step(table_.world, settings_, {device}, state_);
        CAPTURE(record.tick, record.flags, record.linearizations);
        // A tick ends with the linearization that exceeds its sum, which may still search for its list twice.
        REQUIRE(searches(state_).spent() <= kSearchLimits.tick + 2 * kSearchLimits.list);
        REQUIRE((record.flags & (kListOverflow | kNonFinite | kOverlapping | kBadInput)) == 0);
        if (judged && settings_.geometry == Geometry::Mesh) REQUIRE_FALSE(table_.judge.overlap(record.X_WT));
        if (judged && settings_.geometry == Geometry::Spheres)  // one linearization may leave 0.5 µm
            REQUIRE(trueClearance(table_.world, record.X_WT, 0) >= -1e-3);
        return record;
    }
    bool isShortened() const { return searches(state_).isShortened(); }

  private:
    const Table& table_;
    Settings settings_;
    TickState state_;
};

constexpr double kJumps[] = {2, 4, 20, 100};  // mm
constexpr double kTurns[] = {0, 1};           // rad
constexpr Geometry kGeometries[] = {Geometry::Mesh, Geometry::Spheres};

/// Jumps from where parts touch. Returns whether any of them took a search to its limit.
bool leap(const Table& table, Geometry geometry, double jump, double turn) {
    bool shortened = false;
    Pose device = at(0.1, 0.05, 19.5);
    Stepper stepper(table, geometry, device);
    Random random(7);
    for (int leaps = 0; leaps < 8; ++leaps) {
        for (int tick = 0; tick < 8; ++tick) {
            stepper.step(device, tick == 0 || tick == 7);
            shortened = shortened || stepper.isShortened();
        }
        device.p += jump * random.vector().normalized();
        if (device.p.norm() > 60) device.p *= 20 / device.p.norm();
        device.q = (expRotation(turn * random.vector().normalized()) * device.q).normalized();
    }
    return shortened;
}

/// The number of ticks in which a free tool arrives after a jump past the other part, 1 mm beside it.
int flyPast(const Table& table, Geometry geometry, double jump, double turn) {
    // The outer radii of the fits are 14 and 9 mm, of ball and ring 6 and 17 mm.
    Stepper stepper(table, geometry, at(-jump / 2, 24, 1));
    const Pose device = at(jump / 2, 24, 1, Vec3(0, 0, turn));
    for (int ticks = 1; ticks < 100; ++ticks) {
        const TickRecord record = stepper.step(device, true);
        REQUIRE(record.wrench_C.isZero());
        if (record.X_WT.p == device.p) return ticks;
        REQUIRE((record.flags & kUnfinished) != 0);
    }
    return 100;
}

}  // namespace

TEST_CASE("search budget: whatever a jump is, the searches of a tick are bounded and nothing enters", "[step]") {
    int shortened = 0;
    for (const Parts& parts : partsToJump()) {
        const Table table(parts);
        for (const Geometry geometry : kGeometries)
            for (const double jump : kJumps)
                for (const double turn : kTurns) {
                    CAPTURE(parts.name, jump, turn, int(geometry));
                    shortened += leap(table, geometry, jump, turn);
                    CHECK(flyPast(table, geometry, jump, turn) <= 5);
                }
    }
    CHECK(shortened > 0);  // else the matrix does not reach the limits
}

}  // namespace touchstone::search_budget_tests
