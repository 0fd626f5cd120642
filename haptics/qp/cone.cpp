#include "haptics/qp/cone.hpp"

#include <algorithm>

namespace touchstone {
namespace {

/// (x)+ with its corner rounded, and its derivatives by x and by the rounding.
struct Rounded {
    double value = 0, byX = 0, byRounding = 0;
};
Rounded rounded(double x, double rounding) {
    if (x <= -rounding) return {};
    if (x >= rounding) return {x, 1, 0};
    const double up = x + rounding;
    return {up * up / (4 * rounding), up / (2 * rounding), up * (rounding - x) / (4 * rounding * rounding)};
}

}  // namespace

ConeForce projectRounded(const Vec3& w, const Vec3& n, double mu, double rounding, Vec3& widened) {
    ConeForce to;
    widened.setZero();
    const double wn = n.dot(w);
    const auto [normal, rise, normalWidened] = rounded(wn, rounding);
    if (!(normal > 0)) return to;
    to.mode = ContactMode::Slide;
    to.rise = rise;
    to.force = normal * n;
    widened = normalWidened * n;
    const Vec3 tangential = w - wn * n;
    const double size = tangential.norm(), limit = mu * normal;
    if (!(limit > 0)) return to;
    const auto [beyond, byBeyond, beyondWidened] = rounded(size - limit, mu * rounding);
    const double sum = limit + beyond, square = sum * sum;
    if (size > 0) to.along = tangential * (1 / size);
    to.share = limit / sum;
    to.fall = size * limit * byBeyond / square;
    const double byLimit = size * (beyond + limit * byBeyond) / square;  // of |f_t|
    to.lean = byLimit * mu * rise;
    to.force += to.share * tangential;
    widened += (byLimit * mu * normalWidened - size * limit / square * mu * beyondWidened) * to.along;
    return to;
}

}  // namespace touchstone
