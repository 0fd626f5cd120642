#include "tests/haptics/qp/qp_hard_problems.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace touchstone::test {
namespace {

/// Makes one problem hard in the ways that its hardness bits select.
class Hardener {
  public:
    Hardener(std::mt19937_64& random, HardProblem& problem) : random_(random), problem_(problem) {}

    void run() {
        if (has(kIllLevers)) illLevers();
        if (has(kSharpWedges)) sharpWedges();
        if (has(kOpposed)) opposed();
        if (has(kInfeasible)) infeasible();
        if (has(kCopies)) copies(0);
        if (has(kNearCopies)) copies(1e-9);
        if (has(kZeroRows)) zeroRows();
        if (has(kUnevenStiffness))
            for (int k = 0; k < 6; ++k) contacts().stiffness[k] *= power(-2, 2);
        if (has(kStiffnessScale)) {
            const double scale = power(-6, 6);
            contacts().stiffness *= scale;
            problem_.N = std::max(1.0, scale);
        }
        if (has(kMeters)) {
            lengths(1e-3);
            problem_.mm = 1e-3;
        }
        if (has(kLengthScale)) {
            const double scale = power(-6, 6);
            lengths(scale);
            problem_.mm *= std::max(1.0, scale);
        }
        if (has(kRowScales))
            for (int i = 0; i < rows(); ++i) times(i, power(-6, 6));
        if (has(kNotFinite)) notFinite();
    }

  private:
    Contacts& contacts() { return problem_.contacts; }
    int rows() { return contacts().rows.size(); }
    bool has(Hardness hardness) const { return problem_.hardness & hardness; }
    double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
    double power(double from, double to) { return std::pow(10, uniform(from, to)); }
    int anyRow() { return int(random_() % std::uint64_t(rows())); }
    Vec3 direction() {
        std::normal_distribution<double> normal;
        return Vec3(normal(random_), normal(random_), normal(random_)).normalized();
    }
    int few() { return 1 + int(random_() % 6); }

    void times(int row, double scale) {
        for (int k = 0; k < 7; ++k) contacts().rows.column(k)[row] *= scale;
    }
    void illLevers() {
        for (int i = few(); i > 0; --i) {
            if (random_() % 3 == 0) {
                Vec6 j;
                j << power(-12, -3) * direction(), 30 * direction();
                contacts().row(j, uniform(0, 0.3));
            } else {
                contacts().wall(direction(), uniform(0, 2), power(2, 4) * direction());
            }
        }
    }
    void sharpWedges() {
        const Vec3 n = direction(), aside = n.unitOrthogonal(), r = uniform(0, 50) * direction();
        const double opening = power(-4, -1);
        contacts().wall((n + opening * aside).normalized(), uniform(0, 0.1), r);
        contacts().wall((-n + opening * aside).normalized(), uniform(0, 0.1), r);
    }
    void opposed() {
        for (int i = few(); i > 0; --i) {
            const int row = anyRow();
            const double widths[] = {0, uniform(0, 0.1), power(-6, -1), -uniform(0, 0.05)};
            contacts().row(-contacts().rows.row(row), widths[random_() % 4] - contacts().rows.gap()[row]);
        }
    }
    void infeasible() {
        const int row = anyRow();
        contacts().row(-contacts().rows.row(row), -contacts().rows.gap()[row] - uniform(0.01, 1));
    }
    void copies(double off) {
        std::normal_distribution<double> normal;
        for (int i = few(); i > 0; --i) {
            const int row = anyRow();
            Vec6 j = contacts().rows.row(row);
            double gap = contacts().rows.gap()[row];
            for (int k = 0; k < 6; ++k) j[k] += (k < 3 ? 1 : 30) * off * normal(random_);
            if (off > 0 && random_() % 2) gap += off * normal(random_);
            const double scale = off > 0 ? 1 : std::ldexp(1.0, int(random_() % 5) - 2);  // exact
            contacts().row(scale * j, scale * gap);
        }
    }
    void zeroRows() {
        for (int i = few(); i > 0; --i) contacts().row(Vec6::Zero(), random_() % 8 ? uniform(0, 1) : -uniform(0, 1));
    }
    /// Multiplies every length by `scale` and keeps the forces.
    void lengths(double scale) {
        Contacts& c = contacts();
        c.wanted.head<3>() *= scale;
        c.stiffness.head<3>() /= scale;
        c.stiffness.tail<3>() *= scale;
        for (int i = 0; i < rows(); ++i) {
            c.rows.gap()[i] *= scale;
            for (int k = 3; k < 6; ++k) c.rows.column(k)[i] *= scale;
        }
    }
    void notFinite() {
        constexpr double kBad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                                   -std::numeric_limits<double>::infinity()};
        const double bad = kBad[random_() % 3];
        const int k = int(random_() % 7);
        switch (random_() % 3) {
            case 0:
                contacts().wanted[k % 6] = bad;
                break;
            case 1:
                contacts().stiffness[k % 6] = bad;
                break;
            default:
                contacts().rows.column(k)[anyRow()] = bad;
        }
    }

    std::mt19937_64& random_;
    HardProblem& problem_;
};

}  // namespace

HardProblem hardProblem(std::mt19937_64& random) {
    const int m = random() % 50 == 0 ? 300 : 1 + int(random() % (random() % 4 ? 20 : 60));
    const ContactKind kind = kContactKinds[random() % std::size(kContactKinds)];
    const Contacts made = randomContacts(random, kind, m);
    HardProblem problem;
    problem.contacts = Contacts(made.rows.size() + 40);
    problem.contacts.wanted = made.wanted;
    for (int i = 0; i < made.rows.size(); ++i) problem.contacts.row(made.rows.row(i), made.rows.gap()[i]);
    for (int i = int(random() % 4); i > 0; --i) problem.hardness |= 1u << random() % 13;
    if (problem.hardness & kNotFinite && random() % 2) problem.hardness &= ~unsigned(kNotFinite);
    Hardener(random, problem).run();
    return problem;
}

}  // namespace touchstone::test
