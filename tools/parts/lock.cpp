#include "tools/parts/lock.hpp"

#include <stdexcept>

#include "tools/parts/turned.hpp"

namespace touchstone::app {
namespace {

void check(const LockFit& fit) {
    if (fit.clearance <= 0 || fit.plate <= 0 || fit.pilot <= 0 || fit.bitWidth <= 0)
        throw std::invalid_argument("clearance, plate, pilot and the bit's width must be positive");
    if (fit.stem / 2 + fit.clearance >= fit.wardReach || fit.wardReach + fit.clearance >= fit.bitReach)
        throw std::invalid_argument("the ward must end between the stem and the edge of the bit");
    if (fit.wardWidth <= 0 || fit.wardWidth + 2 * fit.play() >= fit.bitLength)
        throw std::invalid_argument("the ward must be narrower than the bit is long");
    if (fit.bitWidth / 2 + fit.clearance >= fit.stem / 2)
        throw std::invalid_argument("the bit must be narrower than the stem");
    if (fit.turn <= 0 || fit.turn > 2.5)
        throw std::invalid_argument("the key must turn by more than 0 and at most 2.5 rad");
}

}  // namespace

engine::MeshData key(const LockFit& fit) {
    check(fit);
    const double stem = fit.stem / 2, half = fit.bitLength / 2, notch = fit.wardWidth / 2 + fit.play();
    const double neck = half + fit.plate + fit.play() + 8;
    const Flank from{0, -fit.bitWidth / 2}, to{0, fit.bitWidth / 2};
    TurnedSolid key;
    key.add({0, stem, -half - fit.pilot, neck});
    key.add({stem, fit.bitReach, -half, half, from, to});
    key.cut({fit.wardReach, fit.bitReach, -notch, notch, from, to});
    key.add({0, stem + 2, neck, neck + 2});
    // The bow: a stem on the collar with a loop on each side.
    const double low = neck + 2, high = low + 14;
    key.add({0, stem, low, high});
    for (const double angle : {0.0, std::numbers::pi}) {
        const Flank wing[] = {{angle, from.offset}, {angle, to.offset}};
        key.add({stem, fit.bitReach + 2, low, high, wing[0], wing[1]});
        key.cut({stem + 2, fit.bitReach - 1, low + 3, high - 3, wing[0], wing[1]});
    }
    return key.mesh(fit.spacing);
}

engine::MeshData lock(const LockFit& fit) {
    check(fit);
    const double c = fit.clearance, bore = fit.stem / 2 + c, reach = fit.bitReach + c;
    const double home = fit.home(), back = home - fit.bitLength / 2 - fit.play(),
                 end = home - fit.bitLength / 2 - fit.pilot;
    const Flank hole[] = {{0, -fit.bitWidth / 2 - c}, {0, fit.bitWidth / 2 + c}};
    const Flank stop{-fit.turn, -fit.bitWidth / 2 - c};
    TurnedSolid lock;
    lock.add({0, reach + 4, end - 3, 0});
    lock.cut({0, bore, end, 0});
    lock.cut({bore, reach, back, 0, hole[0], hole[1]});
    lock.cut({bore, reach, back, -fit.plate, stop, hole[1]});
    lock.add({fit.wardReach + c, reach, home - fit.wardWidth / 2, home + fit.wardWidth / 2, stop, hole[0]});
    return lock.mesh(fit.spacing);
}

}  // namespace touchstone::app
