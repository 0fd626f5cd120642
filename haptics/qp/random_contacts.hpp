#pragma once
// Random problems that look like contact, for measuring and testing solvers.
#include <random>

#include "haptics/qp/problem.hpp"

namespace touchstone {

/// A problem that owns its rows.
struct Contacts {
    Vec6 stiffness = (Vec6() << 1, 1, 1, 1000, 1000, 1000).finished();
    Vec6 wanted = Vec6::Zero();
    RowSet rows{1};

    explicit Contacts(int capacity) : rows(capacity) {}
    /// Adds the row (n, r x n) of a contact at r. Identities ascend by ten, so that tests can insert others.
    Contacts& wall(const Vec3& n, double gap, const Vec3& r = Vec3::Zero());
    Contacts& row(const Vec6& j, double gap);
    QpProblem problem() const { return {stiffness, wanted, &rows}; }
};

/// Kinds of contact-like problems, with |r| <= 50 mm and h up to 5 mm inside. The first three are feasible.
enum class ContactKind { Slide, Wedge, Pinch, Scattered, Degenerate, Squeeze };
inline constexpr ContactKind kContactKinds[] = {ContactKind::Slide,     ContactKind::Wedge,      ContactKind::Pinch,
                                                ContactKind::Scattered, ContactKind::Degenerate, ContactKind::Squeeze};
Contacts randomContacts(std::mt19937_64& random, ContactKind kind, int m);

}  // namespace touchstone
