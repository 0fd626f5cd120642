#include "tools/touchstone/referee/passivity.hpp"

#include <algorithm>
#include <cmath>

#include "haptics/hands/hand.hpp"
#include "haptics/loop/distances.hpp"

namespace touchstone::app {
namespace {

constexpr double kLowest = 0.001, kHighest = 100;              // N/mm, of the setting
constexpr double kPress = 4, kPressing = 100, kResting = 900;  // mm, ms, ms
constexpr double kStill = 1e-4;                                // mm/ms, below which the hand rests
constexpr double kFine = 1.0 / 400;                            // ms: step of the hand at most
constexpr double kRoundingEnergy = 1e-6;                       // mJ
constexpr int kHalvings = 12;

struct Press {
    bool passive = true, rests = false;
};

Press press(const World& world, const Settings& settings, double gap) {
    Press result;
    const HandParameters hand;
    const double mass = 1000 * hand.mass;  // N·ms²/mm
    const double period = 1000 / settings.rate, end = kPressing + kResting;
    const int steps = std::max(1, int(std::ceil(period / kFine)));
    const double dt = period / steps, speed = -(gap + kPress) / kPressing;
    TickState state(world);
    Pose X_WT = world.X_WT_start;
    double y = 0, v = 0, energy = 0, t = 0, fastest = 0;
    while (t < end) {
        X_WT.p.y() = world.X_WT_start.p.y() + y;
        const double force = step(world, settings, {.X_WT_device = X_WT}, state).wrench_C.force.y();
        for (int n = 0; n < steps; ++n, t += dt) {
            const double wanted = std::min(t, kPressing) * speed, wantedSpeed = t < kPressing ? speed : 0;
            const double pull = hand.spring * (wanted - y) + hand.damping * (wantedSpeed - v);
            v += dt * (force + pull) / mass;
            y += dt * v;
            energy += dt * pull * v;
            if (t > end - 100) fastest = std::max(fastest, std::abs(v));
        }
        if (energy < -kRoundingEnergy) result.passive = false;
        if (std::abs(y) > 1e3) return result;
    }
    result.rests = fastest < kStill;
    return result;
}

}  // namespace

std::vector<nlohmann::ordered_json> greatestStiffness(const World& world, Settings settings,
                                                      std::span<const int> rates) {
    settings.shadow = kNoSolver;
    const double gap = trueClearance(world, world.X_WT_start, 1e3, {}, settings.geometry);
    std::vector<nlohmann::ordered_json> rows;
    for (const int rate : rates) {
        settings.rate = rate;
        const auto greatest = [&](auto holds) {
            const auto holdsAt = [&](double stiffness) {
                settings.stiffness = stiffness;
                return holds(press(world, settings, gap));
            };
            double low = kLowest, high = kHighest;
            if (holdsAt(high)) return high;
            for (int i = 0; i < kHalvings; ++i) {
                const double middle = std::sqrt(low * high);
                (holdsAt(middle) ? low : high) = middle;
            }
            return low;
        };
        rows.push_back({{"rate_Hz", rate},
                        {"passive_N_per_mm", greatest([](Press p) { return p.passive && p.rests; })},
                        {"rests_N_per_mm", greatest([](Press p) { return p.rests; })},
                        {"bound_N_per_mm", 2 * HandParameters{}.damping * rate / 1000}});
    }
    return rows;
}

}  // namespace touchstone::app
