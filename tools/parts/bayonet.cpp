#include "tools/parts/bayonet.hpp"

#include <stdexcept>

#include "tools/parts/angles.hpp"
#include "tools/parts/turned.hpp"

namespace touchstone::app {
namespace {

constexpr double kFoot = 4;  ///< of the cap's body below the lugs' middle, mm

void check(const BayonetFit& fit) {
    const double least = fit.lugHeight / 2 + fit.clearance;
    if (fit.lugs < 1 || fit.clearance <= 0 || fit.lugWidth <= 0 || fit.lugHeight <= 0 || fit.lugReach <= 0)
        throw std::invalid_argument("lugs, their measures and the clearance of a bayonet must be positive");
    if (fit.turn <= 0 || fit.turn > 2.5)
        throw std::invalid_argument("the cap must turn by more than 0 and at most 2.5 rad");
    if (-fit.locked() <= least)
        throw std::invalid_argument("the pockets break through the rim; make the depth greater or the rise smaller");
    if (fit.turn + (fit.lugWidth + 2 * fit.clearance + 2) * 2 / fit.diameter > kTau / fit.lugs)
        throw std::invalid_argument("the slots run into each other; make lugs fewer or the turn smaller");
}

}  // namespace

engine::MeshData bayonetCap(const BayonetFit& fit) {
    check(fit);
    const double body = fit.diameter / 2, grip = fit.depth + 1, half = fit.lugHeight / 2;
    TurnedSolid cap;
    cap.add({0, body, -kFoot, grip});
    cap.add({0, body + fit.lugReach, grip, grip + 8});
    for (int i = 0; i < fit.lugs; ++i) {
        const double angle = kTau * i / fit.lugs, side = fit.lugWidth / 2;
        cap.add({body, body + fit.lugReach, -half, half, {angle, -side}, {angle, side}});
        cap.add({body + fit.lugReach, body + fit.lugReach + 2, grip, grip + 8, {angle, -side}, {angle, side}});
    }
    return cap.mesh(fit.spacing);
}

engine::MeshData bayonetHolder(const BayonetFit& fit) {
    check(fit);
    const double bore = fit.diameter / 2 + fit.clearance, outer = bore + fit.lugReach;
    const double floor = -fit.depth - fit.lugHeight / 2, way = fit.lugHeight + 2 * fit.clearance;
    const double bottom = floor - kFoot;
    TurnedSolid holder;
    holder.add({0, outer + 6, bottom - 4, bottom});
    holder.add({bore, outer, bottom, 0});
    for (int i = 0; i < fit.lugs; ++i) {
        const double angle = kTau * i / fit.lugs, side = fit.lugWidth / 2 + fit.clearance;
        const Flank entry[] = {{angle, -side}, {angle, side}};
        const Flank pocket[] = {{angle - fit.turn, -side}, {angle - fit.turn, side}};
        holder.cut({bore, outer, floor, 0, entry[0], entry[1]});
        holder.cut({bore, outer, floor, floor + way, pocket[0], entry[1]});
        holder.cut({bore, outer, floor, floor + way + fit.rise, pocket[0], pocket[1]});
    }
    return holder.mesh(fit.spacing);
}

}  // namespace touchstone::app
